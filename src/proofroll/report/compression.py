"""Large texts inside a page: compressed, and unpacked by the browser when they are first needed."""

from __future__ import annotations

import base64
import gzip


def packed(text: str) -> str:
    """The text for an element that ``unpack`` in ``templates/unpack.js`` reads: gzip, in base64, so no markup.

    Equal texts give equal results.
    """
    return base64.b64encode(gzip.compress(text.encode("utf-8"), compresslevel=9, mtime=0)).decode("ascii")
