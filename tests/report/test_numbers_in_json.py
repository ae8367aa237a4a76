"""Numbers of the page's tables and captions, each of which report.json has."""

from __future__ import annotations

import re
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from folded import whole
from numpy.typing import NDArray

from proofroll.files.json_data import plain

_NUMBER = re.compile(r"(?<![\w.\-−])[-−]?\d+(?:\.\d+)?(?:e[-+−]?\d+)?(?![\w]|\.\d)", re.IGNORECASE)
# What is no result: counts of certificates' lines, half-widths of intervals of costs in per cent, multiples of a
# tolerance, and the confidence of those intervals.
_NO_RESULT = re.compile(r"\b\d+ of \d+\b|±\s?\d+\s?%|\d+\s%|(?:more than )?[\d.]+ times better than asked")
# Versions and titles of findings; speeds, which are reciprocals of costs.
_OF_FILES = {"Findings about engines", "What to use for each scene", "Which engine for which scenes, and how fast"}


class Cells(HTMLParser):
    """Text of each cell of a table's body and of each caption, with the label of its table."""

    def __init__(self, html: str) -> None:
        super().__init__(convert_charrefs=True)
        self.found: list[tuple[str, str]] = []
        self._label, self._text, self._inside = "", "", False
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Begins a cell or a caption."""
        given = {name: value or "" for name, value in attrs}
        classes = given.get("class", "").split()
        if "scroll" in classes:
            self._label = given["aria-label"]
        if tag in {"td", "th"} or (tag == "p" and "caption" in classes):
            self._text, self._inside = "", True

    def handle_data(self, data: str) -> None:
        """Adds to the cell."""
        self._text += data if self._inside else ""

    def handle_endtag(self, tag: str) -> None:
        """Ends the cell."""
        if tag in {"td", "th", "p"} and self._inside:
            self.found.append((self._label if tag != "p" else "caption", " ".join(self._text.split())))
            self._inside = False


def _numbers(text: str) -> list[str]:
    return [found[0].replace("−", "-").lstrip("-").lower() for found in _NUMBER.finditer(_NO_RESULT.sub(" ", text))]


def _sizes(content: dict[str, Any]) -> NDArray[np.float64]:
    """Sizes of all numbers in report.json: those in its sentences, errors in parts of scales, steps a period, ±."""
    table = content["table"]
    rows = [dict(zip(table["columns"], row, strict=True)) for row in table["data"]]
    values = [row[name] / row["scale"] for row in rows for name in ("error", "tolerance") if row["scale"] and row[name]]
    return np.sort(np.abs(np.array([*values, *_values(content)], float)))


def _values(value: Any) -> Iterator[float]:
    if isinstance(value, dict):
        if value.get("period") and value.get("largest_accurate"):  # as a stability map has them
            yield value["period"] / value["largest_accurate"]
        if value.get("order_high") is not None and value.get("order_low") is not None:
            yield (value["order_high"] - value["order_low"]) / 2
        value = list(value.values())
    if isinstance(value, list):
        for item in value:
            yield from _values(item)
    elif isinstance(value, str):
        yield from map(float, _numbers(value))
    elif isinstance(value, int | float):
        yield value


def _is_in(text: str, sizes: NDArray[np.float64]) -> bool:
    """True if one of the sorted sizes rounds to a number as it is shown."""
    mantissa, _, power = text.partition("e")
    before, _, after = mantissa.partition(".")
    last = -len(after) if after else len(before) - len(before.rstrip("0") or before)
    half = 0.501 * 10.0 ** (last + int(power or 0))
    return bool(sizes.searchsorted(float(text) + half, "right") > sizes.searchsorted(float(text) - half))


def missing_numbers(html: str, content: dict[str, Any]) -> dict[str, list[tuple[str, str]]]:
    """Numbers of a page's cells and captions that report.json lacks, with their cell, by table."""
    sizes, missing = _sizes(content), dict[str, list[tuple[str, str]]]()
    for label, cell in Cells(whole(html)).found:
        lacking = [(text, cell) for text in _numbers(cell) if not _is_in(text, sizes)]
        if lacking and label not in _OF_FILES:
            missing.setdefault(label, []).extend(lacking)
    return missing


@pytest.mark.drill
def test_the_json_has_every_number_of_the_page(report_page: Path, everything: Any) -> None:
    """Each number in a cell or caption of the page is one of report.json, rounded, but for what is no result."""
    html, content = report_page.read_text(encoding="utf-8"), plain(everything.content)
    assert missing_numbers(html, content) == {}
    assert missing_numbers(html, {"table": content["table"]}), (
        "lines of runs alone have neither certificates nor claims"
    )
