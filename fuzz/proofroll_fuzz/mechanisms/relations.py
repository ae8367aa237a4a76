"""Relations of a random mechanism: scenes that have to move as it does."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from typing import Any

import numpy as np

from proofroll.adapter import JointKind
from proofroll.elements.mechanism.scene.joint_kinds import ONE_COORDINATE
from proofroll.elements.mechanism.scene.rotations import from_rpy
from proofroll_fuzz.drawing import Relation
from proofroll_fuzz.mechanisms.smaller import STRUCTURE, rows_of
from proofroll_fuzz.mechanisms.turned_world import Turn

_R, _SHIFT = from_rpy((0.3, -0.7, 1.1)), (0.4, -0.3, 0.2)
_LOSSES = frozenset({"friction", "damping", "motion", "limits", "torque"})  # keys of laws that are not reversible
_LOSSY = ("pairs", "actuators", "bushings")  # tables of such laws


def _size(tables: Mapping[str, Any]) -> float:
    """Largest coordinate in the rows of a scene file [m], for a shift of its size."""
    numbers = [row[key] for row in rows_of(tables) for key in row if key.startswith("position")]
    return float(np.abs(numbers).max(initial=0.0)) if numbers else 0.0


def _turn(tables: dict[str, Any], _: object) -> None:
    Turn(_R, _size(tables) * np.array(_SHIFT))(tables)


def _turned_back(truth: Mapping[Any, Any], tables: Mapping[str, Any]) -> dict[str, Any]:
    shift = _size(tables) * np.array(_SHIFT)
    places, speeds = truth["p_WB"].to_numpy(), truth["v_WB"].to_numpy()
    return _coordinates(truth) | {"p_WB": (places - shift) @ _R, "v_WB": speeds @ _R}


def _coordinates(truth: Mapping[Any, Any]) -> dict[str, Any]:
    """Coordinates of joints, which have no frame."""
    return {name: truth[name].to_numpy() for name in truth if name.startswith(("q.", "v."))}


def _names(tables: Mapping[str, Any]) -> dict[str, str]:
    """Name of each row -> another one; the order of names is reversed."""
    names = sorted(row["name"] for row in rows_of(tables))
    return {name: f"n{len(names) - number:03}" for number, name in enumerate(names)}


def _rename(tables: dict[str, Any], _: object) -> None:
    names = _names(tables)
    for row in rows_of(tables):
        for key in STRUCTURE - {"kind"} & row.keys():
            value = row[key]
            row[key] = [names.get(x, x) for x in value] if isinstance(value, list) else names.get(value, value)
    if "control" in tables:
        tables["control"]["actuators"] = [names[name] for name in tables["control"]["actuators"]]


def _renamed_back(truth: Mapping[Any, Any], tables: Mapping[str, Any]) -> dict[str, Any]:
    former = {new: name for name, new in _names(tables).items()}
    values = {name: truth[name].to_numpy() for name in ("p_WB", "v_WB")}
    for name, value in _coordinates(truth).items():
        letter, _, joint = name.partition(".")
        values[f"{letter}.{former[joint]}" if joint in former else name] = value
    return values


def _reorder(tables: dict[str, Any], _: object) -> None:
    for name, content in tables.items():
        if isinstance(content, list):
            tables[name] = content[::-1]


def _of_bodies(truth: Mapping[Any, Any], tables: Mapping[str, Any]) -> dict[str, Any]:
    """Coordinates, and places and velocities of the bodies of a scene file, then of those inside its joints."""
    names = truth["body"].to_numpy().tolist()
    order = [names.index(row["name"]) for row in tables["bodies"]]
    order += [k for row in tables["joints"] for k, name in enumerate(names) if name.startswith(f"{row['name']}.")]
    return _coordinates(truth) | {name: truth[name].to_numpy()[:, order] for name in ("p_WB", "v_WB")}


def _reverse(tables: dict[str, Any], truth: Mapping[Any, Any]) -> None:
    """Starts at the end with opposite speeds. Raises LookupError if the scene is not conservative."""
    lossy = any(_LOSSES & row.keys() for row in rows_of(tables)) or any(table in tables for table in _LOSSY)
    joints = tables["joints"]
    simple = all(row["kind"] in {*ONE_COORDINATE, JointKind.FIXED} for row in joints)
    solved = "loops" not in tables or any(row.get("dependent") for row in joints)
    if lossy or not simple or not solved or {"couplings", "control"} & tables.keys():
        raise LookupError
    for row in joints:
        if row["kind"] != JointKind.FIXED:
            row["q0"] = float(truth[f"q.{row['name']}"][-1])
            if not row.get("dependent"):
                row["v0"] = -float(truth[f"v.{row['name']}"][-1])


def _reversed_back(truth: Mapping[Any, Any], _: object) -> dict[str, Any]:
    signs = {"q": 1.0, "p": 1.0, "v": -1.0}
    values = _coordinates(truth) | {name: truth[name].to_numpy() for name in ("p_WB", "v_WB")}
    return {name: signs[name[0]] * value[::-1] for name, value in values.items()}


def _weld(tables: dict[str, Any], _: object) -> None:
    """Makes two halves of each body, one fixed in the other's frame. Raises LookupError if a body has no inertia."""
    halves = []
    for body in tables["bodies"]:
        body["mass"] /= 2
        body["inertia"] = [part / 2 for part in body["inertia"]]
        halves.append(deepcopy(body) | {"name": f"half_of_{body['name']}"})
    tables["joints"] += [
        {"name": f"weld_of_{body['name']}", "kind": "fixed", "parent": body["name"], "child": half["name"]}
        for body, half in zip(tables["bodies"], halves, strict=True)
    ]
    tables["bodies"] += halves


RELATIONS: Mapping[str, Relation] = {
    "turned": Relation(_turn, _turned_back),
    "renamed": Relation(_rename, _renamed_back),
    "reordered": Relation(_reorder, _of_bodies),
    "reversed": Relation(_reverse, _reversed_back),
    "welded": Relation(_weld, _of_bodies),
}
