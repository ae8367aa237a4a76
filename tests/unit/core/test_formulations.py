"""Formulations that another package adds to an engine, found by an entry point of the engine's name."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from proofroll.core import entry_points
from proofroll.core.engine_abilities import Level, Term
from proofroll.core.errors import InputError, Refused
from proofroll.core.formulations import Formulation, added_by, extended
from proofroll.core.plugins import load_engine, resolve_settings
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.engines.projection import Projection
from proofroll.engines.projection.adapter import ELIMINATION
from proofroll.engines.projection.settings import ProjectionSettings
from proofroll.files.scene_file import load_scene


@dataclass(frozen=True)
class SlowSettings(ProjectionSettings):
    """Those of the engine and one of its own."""

    patience: int = 3


def _build(scene: Scene, settings: SlowSettings) -> Any:
    return scene.name, settings.patience


SLOW = Formulation(
    presets={"matched": SlowSettings("slow")},
    provides=frozenset({MechanismCapability.REVOLUTE}),
    level=Level.REDUCED,
    build=_build,
    lacking={MechanismCapability.CONTACT: "it is too slow for that"},
    terms=(ELIMINATION, Term("patience", ("slow",), {"patience": 3}, {"patience": 0}, "shows its settings")),
)


@pytest.fixture
def planted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The projection method with a formulation of a package that is installed beside it."""
    module = ModuleType("planted_formulations")
    module.__dict__.update(FORMULATIONS={"slow": SLOW}, WRONG=[SLOW])
    monkeypatch.setitem(sys.modules, module.__name__, module)
    info = tmp_path / "planted-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: planted\nVersion: 1.0\n")
    points = "projection = planted_formulations:FORMULATIONS\nmujoco = no_such_module:FORMULATIONS\n"
    (info / "entry_points.txt").write_text(f"[proofroll.formulations]\n{points}")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(entry_points, "broken", {})  # commands of other tests would print what is planted here
    return load_engine("projection")


def test_a_package_adds_a_formulation_to_an_engine(planted: Any) -> None:
    """It is built, with settings of its own, and described like those of the engine, before which it stands."""
    assert list(planted.presets) == ["slow", "euler", "rotating_frame", "dependent"]
    assert planted.levels["slow"] == Level.REDUCED
    assert [term.formulations for term in planted.terms] == [("slow",), tuple(planted.presets)]
    scene = load_scene("pendulum")
    settings = resolve_settings(planted, {"patience": "5"}, scene.requires)
    assert (settings.formulation, planted.build(scene, settings)) == ("slow", (scene.name, 5))
    assert added_by(planted, "slow") is SLOW
    assert added_by(planted, "dependent") is None


def test_what_it_lacks_is_refused_with_its_reason(planted: Any) -> None:
    """A scene that it does not provide is never given to it, and the sentence has its reason and who can."""
    scene = load_scene("sphere_in_cylinder")
    with pytest.raises(Refused, match=r"it is too slow for that.*choose formulation=.*dependent"):
        planted.build(scene, planted.presets["slow"]["matched"])


def test_its_settings_are_no_other_formulations(planted: Any) -> None:
    """A setting of its own is refused by the others, by name."""
    with pytest.raises(InputError, match=r"patience.*dependent does not use it; leave it out"):
        resolve_settings(planted, {"formulation": "dependent", "patience": 1})


def test_the_engine_without_packages_is_as_it_was(planted: Any) -> None:
    """The class of the adapter holds its own formulations alone, and runs of these are those of the adapter."""
    assert list(Projection.presets) == list(Projection.provides) == ["dependent"]
    assert issubclass(planted, Projection)
    assert planted is extended(Projection)
    scene = load_scene("pendulum")
    samples = []
    for engine in (planted, Projection):
        run = engine.build(scene, Projection.presets["dependent"]["matched"])
        run.advance(0.1)
        samples.append(run.sample().p_WB)
    np.testing.assert_array_equal(*samples)


@pytest.mark.usefixtures("planted")
def test_a_package_that_cannot_be_loaded_adds_nothing() -> None:
    """The engine stands with what others add, and a warning names the package."""
    pytest.importorskip("mujoco")
    with pytest.warns(RuntimeWarning, match="planted announces no_such_module:FORMULATIONS as mujoco"):
        assert list(load_engine("mujoco").presets) == ["chart", "joints", "geoms"]
