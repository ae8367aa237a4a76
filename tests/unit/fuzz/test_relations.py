"""Relations of the truth: a sound truth keeps each, and a scene that moves otherwise is a breach."""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from proofroll.running.case import Status
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll_fuzz.drawing import Relation
from proofroll_fuzz.evaluation import EvaluatedScene, evaluate_scene
from proofroll_fuzz.mechanisms.families import FAMILIES
from proofroll_fuzz.relations import relations_of, write_scene

_RELATIONS = relations_of(FAMILIES["tree"])
_TABLES: dict[str, Any] = {
    "title": "A double pendulum",
    "source": "made up",
    "duration": 0.4,
    "dt": 0.004,
    "every": 0.1,
    "gravity": {"magnitude": 9.81, "direction": [0.1, 0.2, -0.9]},
    "bodies": [
        {"name": "upper", "mass": 1.0, "com": [0.1, 0, 0.2], "inertia": [0.1, 0.12, 0.13]},
        {"name": "lower", "mass": 0.5, "com": [0.2, 0.1, 0], "inertia": [0.05, 0.06, 0.07]},
    ],
    "joints": [
        {"name": "a", "kind": "revolute", "parent": "world", "child": "upper", "position": [1.0, 2.0, 0.5], "v0": 2.0},
        {
            "name": "b",
            "kind": "revolute",
            "parent": "upper",
            "child": "lower",
            "axis": [1, 0, 0],
            "q0": 0.3,
            "v0": -1.0,
        },
    ],
}


def _evaluated(folder: Path, tables: dict[str, Any], name: str, relation: Relation) -> EvaluatedScene:
    write_scene(folder / "scene", tables)
    evaluated = evaluate_scene(folder / "scene", "truth", Runner(Store(folder / "cases"), jobs=1), 20, {name: relation})
    assert evaluated.truth is Status.DONE
    return evaluated


@pytest.mark.one_in(3)
@pytest.mark.drill
@pytest.mark.nightly_of("renamed", "reordered")
@pytest.mark.drill_of("other samples", "turned", "welded")
@pytest.mark.parametrize("name", _RELATIONS)
def test_a_sound_truth_keeps_each_relation(name: str, tmp_path: Path) -> None:
    """The truth of a double pendulum moves alike turned, renamed, reordered, reversed, halved and sampled otherwise."""
    assert _evaluated(tmp_path, _TABLES, name, _RELATIONS[name]).surprises == ()
    assert (tmp_path / "scene" / name.replace(" ", "_") / "scene.toml").is_file()


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize("name", ["turned", "reversed"])
def test_another_motion_is_a_breach(name: str, tmp_path: Path) -> None:
    """A changed scene with 1e-9 more gravity breaks its relation, by a number of error bars."""

    def change(tables: dict[str, Any], truth: Any) -> None:
        _RELATIONS[name].change(tables, truth)
        tables["gravity"]["magnitude"] *= 1 + 1e-9

    (surprise,) = _evaluated(tmp_path, _TABLES, name, Relation(change, _RELATIONS[name].back)).surprises
    assert (surprise.kind.formulation, surprise.kind.relation) == ("truth", name)
    assert "bars" in surprise.message
    assert surprise.size > 0


@pytest.mark.nightly
def test_a_refused_relative_is_a_breach(tmp_path: Path) -> None:
    """A changed scene that the reader refuses is told with its sentence."""
    relation = Relation(lambda tables, _: tables["bodies"][0].update(mass=-1.0), lambda *_: {})
    (surprise,) = _evaluated(tmp_path, _TABLES, "wrong", relation).surprises
    assert surprise.kind.quantity == "refused by the reader"
    assert "mass" in surprise.message


@pytest.mark.nightly
def test_losses_are_not_reversed(tmp_path: Path) -> None:
    """A scene with friction has no reversed one."""
    tables = deepcopy(_TABLES)
    tables["joints"][0]["friction"] = 0.1
    assert _evaluated(tmp_path, tables, "reversed", _RELATIONS["reversed"]).surprises == ()
    assert not (tmp_path / "scene" / "reversed").exists()


@pytest.mark.parametrize("relation", ["reordered", "welded"])
def test_bodies_inside_joints_are_held_in_the_order_of_the_scene(relation: str) -> None:
    """A joint that is read as several has bodies of its own, which follow those of the file by the names of joints."""
    tables = {"bodies": [{"name": "a"}, {"name": "b"}], "joints": [{"name": "j"}, {"name": "k"}]}
    bodies = ["b", "a", "half_of_a", "k.outer", "j.outer", "j.middle"]
    places = np.arange(6.0)[None, :, None] * np.ones((2, 6, 3))
    truth = xr.Dataset(
        dict.fromkeys(("p_WB", "v_WB"), (("time", "body", "xyz"), places)), coords={"body": ("body", bodies)}
    )
    assert _RELATIONS[relation].back(truth, tables)["p_WB"][0, :, 0].tolist() == [1.0, 0.0, 4.0, 5.0, 3.0]
