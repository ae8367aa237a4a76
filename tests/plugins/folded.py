"""HTML of a report's page with the content of all its folds inserted."""

from __future__ import annotations

import base64
import gzip
import json
import re

_PLACE = re.compile(r'<div data-fold="(\d+)"></div>')


def texts(html: str) -> list[str]:
    """Contents of a page's folds, in order of their numbers."""
    found = re.search(r'<script type="text/plain" id="folds">([^<]*)</script>', html)
    return json.loads(gzip.decompress(base64.b64decode(found[1]))) if found else []


def whole(html: str) -> str:
    """HTML of a page with each fold replaced by its content."""
    kept = texts(html)
    while _PLACE.search(html):
        html = _PLACE.sub(lambda place: kept[int(place[1])], html)
    return html
