from __future__ import annotations

import dataclasses
import json
import math
import pydoc
import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest
from hostile import ENTRY_POINTS
from tiny import Tiny

import proofroll
from proofroll.core.engine import Sample
from proofroll.core.errors import Diverged, InputError, Missing, Refused
from proofroll.core.scene import Scene
from proofroll.engines.projection import Projection
from proofroll.files.data_folders import data_folder
from proofroll.papers.blajer_2006.ball.sampling import BallBuilt, BallSample


@pytest.fixture(autouse=True)
def hostile_engines(install_engines: Callable[[Mapping[str, str]], None]) -> None:
    """All engines of ``tests/plugins/hostile.py``."""
    install_engines(ENTRY_POINTS)


def test_three_lines() -> None:
    """A scene, an engine and a time give a trajectory with units and a status."""
    scene = proofroll.load_scene("sphere_in_cylinder", speed=5.0)
    dataset = proofroll.simulate(scene, "oracle", until=0.2, every=0.1)
    assert dataset.attrs["status"] == "done"
    assert dataset["gamma"].attrs["units"] == "rad"
    assert dataset["gamma"].to_numpy() == pytest.approx([0, 2.5, 5], abs=1e-12)


def test_a_step_that_does_not_divide_a_hundredth_of_a_second() -> None:
    """An engine whose usual step is 1/240 s runs as it is: without an interval, samples are where its steps end."""
    scene, step = proofroll.load_scene("sphere_in_cylinder"), 1 / 240
    dataset = proofroll.simulate(scene, "projection[preset=default]", until=0.1, dt=step)
    assert dataset["time"].to_numpy() == pytest.approx(2 * step * np.arange(13))
    with pytest.raises(InputError, match=r"is sampled at 0 s and 0\.01 s"):
        proofroll.simulate(scene, "projection[preset=default]", until=0.1, every=0.01, dt=step)


def test_the_truth_is_an_engine_too() -> None:
    """Without an engine the truth is given, with its error bars."""
    dataset = proofroll.simulate(proofroll.load_scene("sphere_in_cylinder"), until=0.2, every=0.1)
    assert dataset.attrs["status"] == "done"
    assert dataset["z"].attrs["error_bar"] > 0


def test_settings_in_brackets_and_by_name() -> None:
    """Settings may stand in brackets or be given by name; one that is given twice is refused."""
    scene = proofroll.load_scene("sphere_in_cylinder")
    found = proofroll.simulate(scene, "oracle[dt=1e-3]", until=0.1, formulation="only")
    assert json.loads(found.attrs["settings"]) == {"formulation": "only", "preset": "matched", "dt": 1e-3}
    with pytest.raises(InputError, match=r"oracle: dt = 0.01: 1e-3 is in the brackets; give it once"):
        proofroll.simulate(scene, "oracle[dt=1e-3]", dt=1e-2)


@pytest.mark.parametrize("engine", ["truth", "oracle"])
def test_a_trajectory_says_how_it_was_made(engine: str) -> None:
    """Engine, settings, parameters and versions are attributes, as in a file."""
    scene = proofroll.load_scene("sphere_in_cylinder", speed=5.0)
    found = proofroll.simulate(scene, engine, until=0.1, every=0.1)
    assert found.attrs["engine"] == engine
    assert json.loads(found.attrs["parameters"]) == dict(scene.parameters) | {"mu_static": math.inf}
    assert json.loads(found.attrs["versions"]).keys() == {engine, "proofroll", "python", "numpy", "scipy"}
    assert "dt" in json.loads(found.attrs["settings"]) or engine == "truth"


class Silent(Tiny):
    """Says nothing of itself, and falls with half of gravity more."""

    def __init__(self, scene: Scene, settings: Any) -> None:
        super().__init__(scene, settings)
        self.body = dataclasses.replace(self.body, gravity=self.fall * self.body.gravity)

    fall = 1.5

    def built(self) -> BallBuilt:
        """Not even the first acceleration."""
        return BallBuilt()

    def sample(self) -> BallSample:
        """Without the force."""
        return dataclasses.replace(super().sample(), force=None)


class SilentAndSound(Silent):
    """Says nothing of itself, and is right."""

    fall = 1.0


def test_silence_hides_nothing_here_either() -> None:
    """What an engine does not say is derived from its first steps, as in a command, and named in the trajectory."""
    scene = proofroll.load_scene("sphere_in_cylinder")
    with pytest.raises(Refused, match=r"acceleration of the first steps is .* instead of"):
        proofroll.simulate(scene, Silent, until=0.1, every=0.1)
    silent = proofroll.simulate(scene, SilentAndSound, until=0.1, every=0.1).attrs["not_reported"]
    assert silent.startswith("mass, centre of mass, inertia, gravity")


def test_help_shows_the_public_names() -> None:
    """``help(proofroll)`` shows every public name, also those that are loaded only when they are used."""
    text = pydoc.plaintext.document(proofroll)
    for name in proofroll.__all__:
        assert re.search(rf"^    (class )?{name}\(", text, re.MULTILINE), name


def test_a_run_that_diverges_is_given_as_far_as_it_went() -> None:
    """A diverged run says so in its attributes and keeps what was right."""
    dataset = proofroll.simulate(proofroll.load_scene("sphere_in_cylinder"), "not_a_number", until=0.3, every=0.05)
    assert dataset.attrs["status"] == "diverged"
    assert "not finite" in dataset.attrs["message"]
    assert dataset.sizes["time"] == 2


@pytest.mark.parametrize(
    ("engine", "error", "words"),
    [
        ("unheard_of", InputError, "no such engine"),
        ("absent", Missing, "not installed here"),
        ("refuses", Refused, "no wheel, no ball"),
    ],
)
def test_engines_that_cannot_run(engine: str, error: type[Exception], words: str) -> None:
    """An unknown, a missing and a refusing engine are told apart."""
    with pytest.raises(error, match=words):
        proofroll.simulate(proofroll.load_scene("sphere_in_cylinder"), engine)


def test_a_setting_for_the_truth() -> None:
    """The truth has no settings, and says so rather than ignore them."""
    with pytest.raises(InputError, match="truth"):
        proofroll.simulate(proofroll.load_scene("inclined_plane"), "truth", until=0.1, dt=1e-3)


def test_public_names() -> None:
    """The public names are those that are announced, and no others are made up."""
    errors = {"Diverged", "InputError", "Missing", "ProofrollError", "Refused"}
    assert set(proofroll.__all__) == errors | {"compare", "judge", "load_scene", "simulate"}
    assert all(issubclass(getattr(proofroll, name), proofroll.ProofrollError) for name in errors)
    assert all(callable(getattr(proofroll, name)) for name in proofroll.__all__)
    with pytest.raises(AttributeError, match="no attribute 'simulat'"):
        _ = proofroll.simulat  # type: ignore[attr-defined]  # that is the point


def test_data_folders() -> None:
    """Models and comparisons are found from wherever proofroll is used."""
    assert (data_folder("models") / "sphere_in_cylinder" / "scene.toml").is_file()
    with pytest.raises(proofroll.core.errors.ProofrollError, match="reinstall"):
        data_folder("no_such_kind")


def test_a_scene_may_be_named() -> None:
    """The name of a scene gives what the scene itself gives."""
    one, two = (
        proofroll.simulate(scene, until=0.1, every=0.1) for scene in ("pendulum", proofroll.load_scene("pendulum"))
    )
    assert np.array_equal(one["p_WB"], two["p_WB"])


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"p_WB": np.zeros(2)}, r"p_WB with shape \(2,\) instead of \(3,\) at 0 s"),
        ({"force": np.zeros((2, 3))}, r"force with shape \(2, 3\) instead of \(3,\)"),
        ({"v_WB": [[1.0, 2.0], [3.0]]}, "v_WB, which is no array of real numbers at 0 s"),
        ({"v_WB": np.zeros(3, complex)}, "v_WB, which is no array of real numbers at 0 s"),
        ({"v_WB": np.zeros(3, object)}, "v_WB, which is no array of real numbers at 0 s"),
        ({"v_WB": ["0", "0", "0"]}, "v_WB, which is no array of real numbers at 0 s"),
    ],
)
def test_a_sample_of_a_wrong_shape(wrong: dict[str, Any], words: str) -> None:
    """Whoever writes an engine reads which array has which shape, before its numbers are held against the scene's."""

    class Misshapen(Tiny):
        def sample(self) -> BallSample:
            return dataclasses.replace(super().sample(), **wrong)

    with pytest.raises(Diverged, match=words):
        proofroll.simulate("sphere_in_cylinder", Misshapen, until=0.05)


@pytest.mark.parametrize(
    ("method", "given", "words"),
    [
        ("sample", None, r"sample\(\) gave NoneType instead of a MechanismSample"),
        ("sample", Sample(*np.zeros((3, 3))), r"sample\(\) gave Sample instead of a MechanismSample"),
        ("sample", {"p_WB": np.zeros(3)}, r"sample\(\) gave dict instead of a MechanismSample"),
        ("built", None, r"built\(\) gave NoneType, which has no "),
        ("built", {"mass": 1.0}, r"built\(\) gave dict, which has no "),
    ],
)
def test_what_is_no_sample_and_nothing_built(method: str, given: Any, words: str) -> None:
    """Whoever forgets a return, or gives a dictionary, reads which method gave what."""
    engine = type("Forgetful", (Tiny,), {method: lambda _: given})
    with pytest.raises(Diverged, match=words):
        proofroll.simulate("sphere_in_cylinder", engine, until=0.05)


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize("given", [7, [("bounce", 0.1)]])
def test_what_is_no_event(given: Any) -> None:
    """Whoever tells events in another form reads which one is asked for."""

    class Forgetful(Projection):
        @classmethod
        def build(cls, scene: Scene, settings: Any) -> Any:
            run: Any = super().build(scene, settings)
            run.events = lambda: given
            return run

    with pytest.raises(Diverged, match=r"events\(\) gave something else than a sequence of Event"):
        proofroll.simulate("sled", Forgetful, until=0.05)
