"""What must follow when the parts of a mechanism are listed in another order, or have other names."""

from __future__ import annotations

import dataclasses
import functools
import random
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

from proofroll.core.scene import Scene
from proofroll.elements.mechanism.element import MechanismElement
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate

# Lists of a mechanism whose order is that of its file.
LISTS = ("bodies", "joints", "loops", "springs", "points", "geometries", "pairs", "actuators", "couplings")
# A coupling, two contacts of one body; a loop, three contacts of one body, contacts with an actuator.
QUICK, SLOW = ("gear_pair", "rocking_block"), ("slider_crank", "sled", "flick")


def run(scene: Scene) -> xr.Dataset:
    """Two steps of the scene, in the engine that is part of the project."""
    return simulate(scene, "projection[formulation=dependent]", until=2e-3, every=1e-3)


@functools.cache
def as_written(name: str) -> xr.Dataset:
    """The scene's run as its file has it."""
    return run(load_scene(name))


def shuffled(scene: Scene, order: random.Random) -> tuple[Scene, dict[str, str]]:
    """The same scene with its lists in another order and each of their names replaced; and old name -> new name."""
    (element,) = scene.elements
    assert isinstance(element, MechanismElement)
    lists = {name: list(getattr(element.mechanism, name)) for name in LISTS}
    old = sorted({item.name for items in lists.values() for item in items})
    new = [f"part{number}" for number in range(len(old))]
    order.shuffle(new)
    names = dict(zip(old, new, strict=True))
    for items in lists.values():
        order.shuffle(items)
    parts: Any = {name: tuple(_renamed(item, names) for item in items) for name, items in lists.items()}
    mechanism = dataclasses.replace(element.mechanism, **parts)
    return dataclasses.replace(scene, elements=(MechanismElement(mechanism),)), names


def _renamed(item: Any, names: Mapping[str, str]) -> Any:
    """A part of a mechanism with new names, also of the parts that it refers to; a word that is no name stays."""
    words = {"kind", "unmodelled"}
    changes: dict[str, Any] = {}
    for key in (field.name for field in dataclasses.fields(item) if field.name not in words):
        value = getattr(item, key)
        if isinstance(value, str):
            changes[key] = names.get(value, value)
        elif isinstance(value, tuple) and value and all(isinstance(part, str) for part in value):
            changes[key] = tuple(names.get(part, part) for part in value)
    return dataclasses.replace(item, **changes)


@pytest.mark.parametrize("name", [*QUICK, *(pytest.param(name, marks=pytest.mark.drill) for name in SLOW)])
@given(order=st.randoms(use_true_random=False))
def test_order_and_names_change_nothing(name: str, order: random.Random) -> None:
    """Bodies move alike, and joints and contacts bear alike, whatever the order and the names of all parts."""
    other, names = shuffled(load_scene(name), order)
    one, two = as_written(name), run(other)
    bodies = [names[body] for body in one["body"].to_numpy()]
    for quantity in ("p_WB", "v_WB", "w_WB", "q_WB"):
        expected, found = one[quantity].to_numpy(), two[quantity].sel(body=bodies).to_numpy()
        assert found == pytest.approx(expected, abs=1e-10 * max(1.0, float(np.abs(expected).max()))), quantity
    loads = [key for key in one if str(key).split(".")[0] in {"force", "torque", "gap", "slip"}]
    assert loads
    for key in map(str, loads):
        kind, of, *rest = key.split(".")
        expected, found = one[key].to_numpy(), two[".".join([kind, names[of], *rest])].to_numpy()
        size = max(1.0, float(np.abs(expected).max()))
        assert found == pytest.approx(expected, abs=1e-8 * size, nan_ok=True), key
