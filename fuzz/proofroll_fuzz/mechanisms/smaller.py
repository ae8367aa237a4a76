"""Changes that make a random mechanism simpler, the boldest first; some lead to scenes that the reader refuses."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator, Mapping
from functools import partial
from typing import Any

import numpy as np

from proofroll.adapter import WORLD, JointKind, frame_of_axis, from_quaternion
from proofroll.elements.mechanism.scene.joint_kinds import WITH_QUATERNION
from proofroll.elements.mechanism.scene.rotations import from_rpy
from proofroll_fuzz.drawing import Change
from proofroll_fuzz.mechanisms.poses import floats
from proofroll_fuzz.mechanisms.turned_world import Turn

_LAWS = ("loops", "springs", "bushings", "forces", "actuators", "couplings", "pairs")
# Keys that tell which parts a row is about, or of which kind it is.
STRUCTURE = frozenset(
    {"name", "kind", "parent", "child", "body", "body_a", "body_b", "joint", "joint_a", "joint_b", "geometries"}
)
_O, _Z = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
_STILL = [1.0, 0.0, 0.0, 0.0]
_NUMBER = re.compile(r"\d+\.\d*(?:e[-+]?\d+)?|\d+e[-+]?\d+")


def smaller(tables: Mapping[str, Any]) -> Iterator[Change]:
    """Changes of a scene file that each make the scene simpler."""
    bodies = [row["name"] for row in tables["bodies"]]
    yield from (_shorter, _shorter, _plain)
    for body in reversed(bodies):
        yield partial(remove, names={body})
        yield partial(_splice, body=body)
    for table in _LAWS:
        for row in tables.get(table, ()):
            yield partial(remove, names={row["name"]})
    yield lambda content: content.pop("control") and None
    yield _upright
    yield _make_round
    yield from _roundings(tables)
    rows = [(table, row) for table, content in tables.items() if isinstance(content, list) for row in content]
    for key in dict.fromkeys(key for _, row in rows for key in row if key not in STRUCTURE):
        yield partial(_drop, key=key)
    for _, row in rows:
        for key in row:
            if key not in STRUCTURE:
                yield partial(_drop, key=key, name=row["name"])
    for joint in tables["joints"]:
        for kind in (JointKind.REVOLUTE, JointKind.PRISMATIC):
            yield partial(_make_simple, name=joint["name"], kind=kind)
    yield partial(_set_rows, table="bodies", mass=1.0)
    yield lambda content: content["gravity"].update(magnitude=10.0, direction=[0.0, 0.0, -1.0])
    for digits in (1, 2):
        for _, row in rows:
            yield partial(_round_rows, digits=digits, name=row["name"])


def _roundings(tables: Mapping[str, Any]) -> Iterator[Change]:
    """Changes that round all numbers, or those of one table."""
    for digits in (1, 2):
        yield partial(_round_rows, digits=digits)
        for table in (name for name, content in tables.items() if isinstance(content, list)):
            yield partial(_round_rows, digits=digits, table=table)


def remove(tables: dict[str, Any], names: Collection[str]) -> None:
    """Removes rows of a scene file by name, with all that hangs on them.

    Raises:
        LookupError: no body, or no joint, would be left.
    """
    gone = set(names)
    while True:
        named = {row["name"] for row in rows_of(tables) if row["name"] in gone or _refers(row) & gone}
        named |= {row["child"] for row in tables["joints"] if row["name"] in named}
        if named <= gone:
            break
        gone |= named
    for table, content in list(tables.items()):
        if isinstance(content, list):
            tables[table] = [row for row in content if row["name"] not in gone]
            if not tables[table]:
                del tables[table]
    if "control" in tables and set(tables["control"]["actuators"]) & gone:
        del tables["control"]
    free = not {"loops", "couplings"} & tables.keys()
    for joint in tables["joints"]:  # raises KeyError where none is left
        if free:
            joint.pop("dependent", None)


def rows_of(tables: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Rows of all tables of a scene file that have several."""
    return [row for content in tables.values() if isinstance(content, list) for row in content]


def _refers(row: Mapping[str, Any]) -> set[str]:
    """Names of the parts that a row is about."""
    values = [row[key] for key in row if key in STRUCTURE - {"name", "kind"}]
    return {name for value in values for name in ([value] if isinstance(value, str) else value)}


def named(tables: Mapping[str, Any], name: str) -> dict[str, Any]:
    """Row of a name. Raises LookupError if it is gone."""
    rows = [row for row in rows_of(tables) if row["name"] == name]
    return rows[0]


def _shorter(tables: dict[str, Any]) -> None:
    """Halves the duration, down to one sample."""
    samples = math.ceil(tables["duration"] / tables["every"] / 2 - 1e-6)
    tables["duration"] = float(f"{samples * tables['every']:.6g}")


def _splice(tables: dict[str, Any], body: str) -> None:
    """Removes a body, and hangs what hangs on it on its parent. Raises LookupError if nothing does."""
    joint = next(iter(row for row in tables["joints"] if row["child"] == body))
    children = [row for row in tables["joints"] if row["parent"] == body]
    children[0]  # raises IndexError
    for row in children:
        row["parent"] = joint["parent"]
    remove(tables, {body})


def _upright(tables: dict[str, Any]) -> None:
    """Turns the world until the frame of its first joint, or its first wall, stands along the axes."""
    walls = [row for row in tables.get("geometries", ()) if row["body"] == WORLD]
    if walls:
        normal = walls[0].get("normal", walls[0].get("axis", _Z))
        R, place = frame_of_axis(normal).T, walls[0].get("position", _O)
    else:
        joint = next(row for row in tables["joints"] if row["parent"] == WORLD)
        R, place = from_rpy(joint.get("orientation", _O)).T, joint.get("position", _O)
    Turn(R, -R @ np.array(place, dtype=float))(tables)
    for joint in tables["joints"]:
        if joint["kind"] in WITH_QUATERNION:
            _attitude_zero(joint)
    for row in [*rows_of(tables), tables["gravity"]]:
        for key, value in list(row.items()):
            if isinstance(value, list) and not isinstance(value[0], str):
                row[key] = [round(x, 12) + 0.0 for x in value]
            if key in {"position", "orientation"} and not any(row[key]):
                del row[key]


def _attitude_zero(joint: dict[str, Any]) -> None:
    """Lets a body that turns freely start along its parent's axes, with its velocities as they are in space."""
    frame = from_rpy(joint.pop("orientation", _O))
    attitude = frame @ from_quaternion(joint.get("q0", _STILL)[-4:])
    if joint["kind"] == JointKind.FREE:
        place = frame @ np.array(joint["q0"][:3]) + np.array(joint.pop("position", _O), dtype=float)
        joint["q0"] = [*floats(place), *_STILL]
    else:
        joint["q0"] = [*_STILL]
    if "v0" in joint:
        joint["v0"] = [x for part in np.array(joint["v0"]).reshape(-1, 3) for x in floats(attitude @ part)]


def _plain(tables: dict[str, Any]) -> None:
    """Turns the world upright, makes all bodies round, and leaves two digits: most surprises need none of these."""
    _upright(tables)
    _make_round(tables)
    _round_rows(tables, digits=2)


def _make_round(tables: dict[str, Any]) -> None:
    """Gives each body equal moments, of one digit, about its centre of mass in the origin of its frame."""
    for row in tables["bodies"]:
        row.pop("com", None)
        row["inertia"] = [rounded(max(row["inertia"]), 1)] * 3


def _drop(tables: dict[str, Any], key: str, name: str = "") -> None:
    """Removes a key of all rows, or of a named one."""
    rows = [named(tables, name)] if name else rows_of(tables)
    for row in rows:
        row.pop(key, None)


def _set_rows(tables: dict[str, Any], table: str, **values: Any) -> None:
    for row in tables[table]:
        row.update(values)


def _make_simple(tables: dict[str, Any], name: str, kind: str) -> None:
    """Makes a joint one of a single coordinate."""
    joint = named(tables, name)
    if joint["kind"] in {JointKind.REVOLUTE, JointKind.PRISMATIC, JointKind.FIXED}:
        raise LookupError(name)
    for key in joint.keys() - {"name", "parent", "child", "position", "orientation", "axis"}:
        del joint[key]
    joint |= {"kind": str(kind), "v0": 1.0}


def _round_rows(tables: dict[str, Any], digits: int, name: str = "", table: str = "") -> None:
    """Rounds the numbers of all rows, or of a table, or a named row, to some digits; unit quaternions stay."""
    rows = [named(tables, name)] if name else tables[table] if table else [*rows_of(tables), tables["gravity"]]
    for row in rows:
        for key, value in row.items():
            kept = 4 if key == "q0" and row.get("kind") in WITH_QUATERNION else 0
            if isinstance(value, list):
                end = len(value) - kept
                row[key] = [rounded(x, digits) for x in value[:end]] + value[end:]
            else:
                row[key] = rounded(value, digits)


def rounded(value: Any, digits: int) -> Any:
    """A number, or the numbers of a formula, rounded to a number of digits; other values as they are."""
    if isinstance(value, str) and value.startswith("="):
        return _NUMBER.sub(lambda match: repr(rounded(float(match[0]), digits)), value)
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(f"{value:.{digits}g}")
    return value
