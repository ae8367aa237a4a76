"""Changes of one thing in a random mechanism: the nearest scene that passes tells the cause of a surprise."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np

from proofroll.adapter import JointKind
from proofroll.elements.mechanism.scene.joint_kinds import DISTANCE, LOOP_FACTS, ONE_COORDINATE
from proofroll.elements.mechanism.scene.rotations import from_rpy
from proofroll_fuzz.drawing import Change
from proofroll_fuzz.mechanisms.smaller import named, rows_of
from proofroll_fuzz.mechanisms.turned_world import Turn

_QUARTER = math.pi / 2
# Laws of a joint of one coordinate, which another such joint may have in its place.
_LAWS = ("friction", "damping", "stiffness", "torque", "armature", "limits", "motion")
_NO_NUMBERS = frozenset({"q0", "axis", "second_axis", "axis_a", "axis_b", "normal", "orientation", "name", "kind"})


def nearest(tables: Mapping[str, Any]) -> Iterator[tuple[str, Change]]:
    """Changes of one thing in a scene file, with words for those that change several numbers alike."""
    for joint in tables["joints"]:
        if np.any(joint.get("v0", 0.0)):
            yield "", partial(_times, name=joint["name"], key="v0", factor=-1.0)
    for axis, turns in (("x", (_QUARTER, 0.0, 0.0)), ("y", (0.0, _QUARTER, 0.0))):
        yield f"turned by 90° about {axis}", Turn(from_rpy(turns), np.zeros(3))
    for loop in tables.get("loops", ()):
        kinds = {*LOOP_FACTS} - {loop["kind"], JointKind.FREE, DISTANCE}
        for kind in sorted(kinds) if loop["kind"] != DISTANCE else ():  # whose ends are apart
            yield "", partial(_set, name=loop["name"], key="kind", value=str(kind))
    yield from _frictions(tables)
    yield from _other_places(tables)
    for factor in (0.5, 2.0):
        for row in rows_of(tables):
            for key, value in row.items():
                if key not in _NO_NUMBERS and _is_number(value):
                    yield "", partial(_times, name=row["name"], key=key, factor=factor)
        yield "", partial(_times_gravity, factor=factor)


def _frictions(tables: Mapping[str, Any]) -> Iterator[tuple[str, Change]]:
    """Each friction off where it is on, and on where it is off."""
    weight = 0.1 * sum(row["mass"] for row in tables["bodies"]) * tables["gravity"]["magnitude"]
    for joint in tables["joints"]:
        if joint["kind"] in ONE_COORDINATE and "motion" not in joint:
            value = 0.0 if joint.get("friction") else float(f"{weight:.1g}")
            yield "", partial(_set, name=joint["name"], key="friction", value=value)
    for pair in tables.get("pairs", ()):
        yield "", partial(_set, name=pair["name"], key="friction", value=0.0 if pair.get("friction") else 0.5)


def _other_places(tables: Mapping[str, Any]) -> Iterator[tuple[str, Change]]:
    """Each law of a joint, and each actuator, at another joint of one coordinate."""
    joints = [row for row in tables["joints"] if row["kind"] in ONE_COORDINATE]
    for joint in joints:
        for target in joints:
            for key in _LAWS:
                if key in joint and key not in target:
                    words = f"{key} at {target['name']} instead of {joint['name']}"
                    yield words, partial(_move, key=key, source=joint["name"], target=target["name"])
    for row in tables.get("actuators", ()):
        for target in joints:
            if target["name"] != row["joint"]:
                yield "", partial(_set, name=row["name"], key="joint", value=target["name"])


def _is_number(value: Any) -> bool:
    parts = value if isinstance(value, list) else [value]
    return bool(np.any([isinstance(part, int | float) and not isinstance(part, bool) and part for part in parts]))


def _times(tables: dict[str, Any], name: str, key: str, factor: float) -> None:
    _scale(named(tables, name), key, factor)


def _times_gravity(tables: dict[str, Any], factor: float) -> None:
    _scale(tables["gravity"], "magnitude", factor)


def _scale(row: dict[str, Any], key: str, factor: float) -> None:
    value = row[key]
    row[key] = [factor * part for part in value] if isinstance(value, list) else factor * value


def _set(tables: dict[str, Any], name: str, key: str, value: Any) -> None:
    named(tables, name)[key] = value


def _move(tables: dict[str, Any], key: str, source: str, target: str) -> None:
    named(tables, target)[key] = named(tables, source).pop(key)
