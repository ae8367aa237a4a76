"""A page of a report with its folds put back, as one reads it who opens all of them."""

from __future__ import annotations

import base64
import gzip
import json
import re

_PLACE = re.compile(r'<div data-fold="(\d+)"></div>')


def texts(html: str) -> list[str]:
    """Texts of the folds of a page."""
    found = re.search(r'<script type="text/plain" id="folds">([^<]*)</script>', html)
    return json.loads(gzip.decompress(base64.b64decode(found[1]))) if found else []


def whole(html: str) -> str:
    """The page with everything in its place."""
    kept = texts(html)
    while _PLACE.search(html):
        html = _PLACE.sub(lambda place: kept[int(place[1])], html)
    return html
