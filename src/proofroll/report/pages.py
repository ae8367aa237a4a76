"""What every page is made with: templates that escape what is put into them, and large contents compressed."""

from __future__ import annotations

import base64
import gzip
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import jinja2


def environment(*folders: Path) -> jinja2.Environment:
    """The report's templates and those of further folders; everything is escaped, save what they mark as ours."""
    import jinja2

    return jinja2.Environment(
        loader=jinja2.FileSystemLoader([*dict.fromkeys([Path(__file__).parent / "templates", *folders])]),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def rendered(templates: jinja2.Environment, name: str, **said: Any) -> str:
    """A page; a lone surrogate from an engine's message becomes a question mark."""
    return templates.get_template(name).render(**said).encode("utf-8", "replace").decode("utf-8")


def packed(content: bytes) -> str:
    """Bytes as text that ``templates/unpack.js`` reads: gzip in base64, so no markup; always the same of the same."""
    return base64.b64encode(gzip.compress(content, compresslevel=9, mtime=0)).decode("ascii")
