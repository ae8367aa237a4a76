"""Turns the points of a comparison file into numbers."""

from __future__ import annotations

import dataclasses

from proofroll.core.comparison import Comparison, Edge
from proofroll.core.errors import InputError
from proofroll.files.scene_file import load_scene

_EDGE_OF = "mu_static"


def settled(comparison: Comparison) -> Comparison:
    """The comparison with every stair edge found, to six digits.

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
    from proofroll.truth.onset import edge_between

    where = f"{comparison.name}: points: {name}"
    if name != _EDGE_OF:
        raise InputError(where, "edge_between", f"an edge can be found only for {_EDGE_OF}")
    low, high = edge.edge_between
    others = {key: value for key, value in point.items() if isinstance(value, float)}
    scene = load_scene(comparison.scene, **others, mu_static=high)
    found = edge_between(scene, low, high, comparison.until)
    if found is None:
        raise InputError(where, list(edge.edge_between), "the first slip does not jump between these values")
    return found
