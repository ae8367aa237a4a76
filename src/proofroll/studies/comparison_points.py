"""Turns the points of a comparison file into numbers."""

from __future__ import annotations

import dataclasses

from proofroll.core.comparison import Comparison, Edge
from proofroll.core.errors import InputError
from proofroll.core.truth import edge_between
from proofroll.files.scene_file import load_scene


def settled(comparison: Comparison) -> Comparison:
    """The comparison with every edge found.

    Raises:
        InputError: an edge of a parameter for which it is not defined, or none between the two values.
    """
    points = [dict(point) for point in comparison.points]
    for point in points:
        for name, value in point.items():
            if isinstance(value, Edge):
                point[name] = _found(comparison, point, name, value)
    return dataclasses.replace(comparison, points=points)


def _found(comparison: Comparison, point: dict[str, float | Edge], name: str, edge: Edge) -> float:
    where = f"{comparison.name}: points: {name}"
    low, high = edge.edge_between
    others = {key: value for key, value in point.items() if isinstance(value, float)}
    scene = load_scene(comparison.scene, **{**others, name: high})
    try:
        found = edge_between(scene, name, low, high, comparison.until)
    except InputError as error:
        raise InputError(where, error.value, error.advice) from None
    if found is None:
        raise InputError(where, list(edge.edge_between), f"nothing jumps between these values of {name}")
    return found
