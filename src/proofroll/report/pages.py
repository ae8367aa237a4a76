"""Parts of every page: templates that escape, pictures as elements, and large contents compressed."""

from __future__ import annotations

import base64
import gzip
import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import jinja2


def environment(*folders: Path) -> jinja2.Environment:
    """The report's templates and those of further folders, as they are now: a long run ends with what it began with.

    Everything is escaped, save what they mark as ours.
    """
    import jinja2

    places = dict.fromkeys([Path(__file__).parent / "templates", *folders])  # of equal names the first counts
    files = [path for place in reversed(places) if place.is_dir() for path in place.iterdir() if path.is_file()]
    return jinja2.Environment(
        loader=jinja2.DictLoader({path.name: path.read_text(encoding="utf-8") for path in files}),
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


def folded(html: str) -> str:
    """A page whose closed folds (``<details>``) are built when they are opened.

    What follows the summary of each is moved into the element with the id ``folds``, compressed; ``templates/page.js``
    puts it back. A fold within a fold is one of its own, and one with the attribute ``data-whole`` stays as it is.
    So a browser reads, places and paints only what is open.
    """
    texts: list[str] = []
    levels: list[list[str]] = [[]]
    closed: list[bool] = []
    for piece in re.split(r"(<details\b[^>]*>|</summary>|</details>)", html):
        if piece == "</details>" and closed.pop():
            texts.append("".join(levels.pop()))
            levels[-1].append(f'<div data-fold="{len(texts) - 1}"></div>')
        levels[-1].append(piece)
        if piece.startswith("<details"):
            closed.append(not piece.endswith((" open>", " data-whole>")))
        elif piece == "</summary>" and closed[-1]:
            levels.append([])
    kept = packed(json.dumps(texts, ensure_ascii=False).encode("utf-8", "replace"))
    return "".join(levels[0]).replace('id="folds">', f'id="folds">{kept}', 1)


def element(text: str, prefix: str) -> str:
    """A picture from matplotlib as an element: its ids begin with ``prefix``, and no style of it reaches the page."""
    text = text[text.index("<svg") :]
    text = re.sub(r"<(metadata|style)\b.*?</\1>", "", text, flags=re.DOTALL)
    start, _, rest = text.partition(">")
    start = re.sub(r' (?:xmlns(?::\w+)?|version|width|height)="[^"]*"', "", start)
    text = f'{start} aria-hidden="true">{rest}'  # whoever shows it says in words what is on it
    # Only ids that something refers to: equal images would share theirs.
    text = re.sub(r' id="([^"]*)"', lambda found: f' id="{prefix}{found[1]}"' if f"#{found[1]}" in text else "", text)
    text = re.sub(r'href="#', f'href="#{prefix}', text)
    return re.sub(r"url\(#", f"url(#{prefix}", text)
