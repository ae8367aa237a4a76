"""Stability maps as tables of a page: engine against the values of all axes, colour and text saying the same."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from proofroll.report.labels import number, unit
from proofroll.report.stability_map import LETTERS, cell
from proofroll.report.stability_tables import label

# From here on a colour is dark enough for light letters.
_DEEP = 0.5


def table(study: Mapping[str, Any], prefix: str) -> dict[str, Any]:
    """The map and the list of its points.

    Args:
        study: as :func:`proofroll.studies.stability_content.content` has it.
        prefix: of the points' ids.

    Returns:
        ``axes`` with ``name``, ``unit``, ``meaning`` and ``values``; ``groups``: engine -> lines with ``name`` and
        ``cells``, None where there is no point; ``letters`` of what occurs; ``points``.
    """
    axes = [
        {
            "name": axis["name"],
            "unit": unit(axis["unit"]),
            "meaning": axis["meaning"],
            "values": list(dict.fromkeys(p["value"] for p in study["points"] if p["axis"] == axis["name"])),
        }
        for axis in study["axes"]
    ]
    axes = [axis for axis in axes if axis["values"]]
    columns = {(axis["name"], value): index for index, (axis, value) in enumerate(_columns(axes))}
    lines: dict[str, dict[str, Any]] = {}
    points = []
    for index, point in enumerate(study["points"]):
        name, settings = label(point), _rest(point)
        line = lines.setdefault(
            point["curve"], {"engine": point["engine"], "name": settings, "cells": [None] * len(columns)}
        )
        href = f"{prefix}{index}"
        points.append({**point, "id": href, "label": name})
        at = columns.get((point["axis"], point["value"]))
        if at is not None:
            line["cells"][at] = _cell(point, href)
    groups: dict[str, list[dict[str, Any]]] = {}
    for line in lines.values():
        groups.setdefault(line["engine"], []).append(line)
    seen = {point["failure"] for point in study["points"]}
    return {
        "axes": axes,
        "groups": groups,
        "letters": {letter: kind for kind, letter in LETTERS.items() if kind in seen},
        "points": points,
    }


def _columns(axes: list[dict[str, Any]]) -> list[tuple[dict[str, Any], float]]:
    return [(axis, value) for axis in axes for value in axis["values"]]


def _rest(point: Mapping[str, Any]) -> str:
    """Formulation and preset."""
    settings = point["settings"]
    return " ".join(filter(None, (settings.get("formulation"), settings.get("preset")))) or str(point["curve"])


def told(point: Mapping[str, Any]) -> str:
    """Who was told of a failure: nobody, or before the run, or the engine said so."""
    if point["failure"] == "refused":
        return "before the run"
    return "silent" if point["silent"] else "says so"


def _cell(point: Mapping[str, Any], href: str) -> dict[str, Any]:
    text, shade = cell(point)
    words = [f"{label(point)} at {point['axis']} = {point['value']:g}"]
    if point["problem"]:
        words.append("there is no truth")
    elif point["largest_accurate"] is None:
        words.append("no affordable step or tolerance holds 1 %")
    else:
        words.append(f"1 % up to {point['resolution']} {number(point['largest_accurate'])}")
    if point["failure"]:
        words.append(f"beyond: {point['failure']}, {told(point)}")
    return {
        "text": text,
        "shade": None if shade is None else round(min(max(shade, 0.0), 1.0), 2),
        "deep": shade is not None and shade > _DEEP,
        "never": point["largest_accurate"] is None,
        "href": href,
        "title": "; ".join(words),
    }
