"""The statements of an article as rows of a page."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from blajer_2006.judging import count
from proofroll.report.labels import number, unit


def titled(name: str) -> str:
    """A figure's name as a heading: ``figure3`` is ``Figure 3``."""
    return re.sub(r"(?<=[a-z])(?=\d)", " ", name.replace("_", " ")).capitalize()


def rows(study: Mapping[str, Any]) -> list[dict[str, Any]]:
    """What an article states and what the runs give, one line for each run."""
    lines, before = [], None
    for item in study["statements"]:
        of = unit(item["unit"])
        lines.append(
            {
                **item,
                "first": item["says"] != before,
                "runs": ", ".join(item["runs"]),
                "found": _said(item["found"], of),
                "truth": _said(item["truth"], of),
            }
        )
        before = item["says"]
    return lines


def counted(study: Mapping[str, Any]) -> str:
    """How many statements hold."""
    return count(study["statements"])


def _said(found: Any, of: str) -> str:
    if found is None:
        return "–"
    if isinstance(found, list):
        parts = [part if isinstance(part, str) else number(part, 3) for part in found]
        return f"{', '.join(parts)} {of}".strip() if parts else "nothing"
    return f"{number(found, 7)} {of}".strip()
