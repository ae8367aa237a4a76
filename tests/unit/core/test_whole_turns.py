"""Turns of angles, which no orientation has: counted by samples that are near enough, or told not to be known."""

from __future__ import annotations

import numpy as np
import pytest

import proofroll
from proofroll.core.columns import PERIOD, UNCERTAIN
from proofroll.core.plugins import engine_names
from proofroll.core.time_grid import EVERY, time_grid
from proofroll.core.whole_turns import doubt, on_turns_of, samples_between
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import build, simulate_built
from proofroll.studies.judging.reference import Reference
from proofroll.studies.judging.run_values import observables_of
from proofroll.studies.versions.two_runs import numbers_apart

UNTIL = 2.0
# The ball turns by more than a whole turn in this time [s], and costs more.
ENDS = {"pendulum": UNTIL, "tilted_cylinder": 0.5}
# Four seconds of processor.
SLOW = ("gamma", "projection")


@pytest.fixture(scope="module")
def fine() -> dict[str, float]:
    """Where angles are at the end, from samples that are as near as they usually are."""
    ends = {name: proofroll.simulate(name, "truth", until=until) for name, until in ENDS.items()}
    return {"q.pivot": float(ends["pendulum"]["q.pivot"][-1]), "gamma": float(ends["tilted_cylinder"]["gamma"][-1])}


@pytest.mark.drill
@pytest.mark.one_in(4)
@pytest.mark.nightly_of("tilted_cylinder-gamma-projection")
@pytest.mark.drill_of("pendulum-q.pivot-truth")
@pytest.mark.parametrize(
    ("scene", "angle", "engine"),
    [
        pytest.param(scene, angle, engine, marks=[pytest.mark.drill] if (angle, engine) == SLOW else [])
        for scene, angle in (("pendulum", "q.pivot"), ("tilted_cylinder", "gamma"))
        for engine in ("truth", *engine_names())
        if engine != "reduced"
    ],
)
def test_two_samples_are_enough_for_an_engine(engine: str, scene: str, angle: str, fine: dict[str, float]) -> None:
    """Who asks for start and end alone is given the angle that others are given, by the truth and by every engine."""
    run = proofroll.simulate(scene, engine, until=ENDS[scene], every=5.0)
    assert run["time"].to_numpy().tolist() == [0.0, ENDS[scene]]
    assert float(run[angle][-1]) == pytest.approx(fine[angle], abs=0.05)  # MuJoCo's ball is late by 0.03
    assert UNCERTAIN not in run[angle].attrs


@pytest.mark.drill
@pytest.mark.nightly
def test_the_command_counts_them_too(fine: dict[str, float], proofroll: object) -> None:
    """So does a run in a worker, and the trajectory has the times that were asked for and no others."""
    import json

    code, out, err = proofroll("run", "pendulum", "--engine", "mujoco", "--every", "5", "--json")  # type: ignore[operator]
    assert code == 0, err
    assert json.loads(out)["final"]["q.pivot"] == pytest.approx(fine["q.pivot"], abs=1e-3)
    assert "uncertain" not in json.loads(out)
    code, out, _ = proofroll("run", "pendulum", "--engine", "mujoco[dt=0.5]", "--every", "1")  # type: ignore[operator]
    assert code == 0
    assert "turns show in samples that are 0.05 s apart or less, and these are 0.5 s apart: q.pivot" in " ".join(
        out.split()
    )


def test_whole_steps_between_samples() -> None:
    """Times for counting lie between samples, in whole steps, as near as an angle needs; none without one."""
    pendulum = load_scene("pendulum")
    longest = pendulum.elements[0].turn_interval  # type: ignore[attr-defined]  # a mechanism has it
    times = np.array([0.0, 0.7, 0.73, 2.0])
    for step in (None, 0.01, 0.005):
        between = samples_between(pendulum, times, step)
        everything = np.union1d(times, between)
        assert len(everything) == len(times) + len(between)
        assert np.diff(everything).max() <= longest * (1 + 1e-9)
        if step is not None:
            assert np.allclose(between / step, np.round(between / step), atol=1e-9)
    assert not len(samples_between(pendulum, times, 0.7))
    assert not len(samples_between(load_scene("inclined_plane"), times))
    assert not len(samples_between(load_scene("free_body"), times))


@pytest.mark.parametrize("scene", ["pendulum", "double_pendulum", "sphere_in_cylinder", "tilted_cylinder", "chain"])
def test_a_usual_run_has_no_more_samples(scene: str) -> None:
    """Where nobody says how often a run is sampled it costs what it did."""
    assert not len(samples_between(load_scene(scene), time_grid(UNTIL, EVERY), 1e-3))


def test_a_small_mechanism_has_no_more_than_a_run_can_bear() -> None:
    """A pendulum as fast as one of a millimetre needs more than usual, and has at most a thousand in a short run."""
    small = load_scene("pendulum", gravity=9.81e3)
    between = samples_between(small, time_grid(UNTIL, EVERY))
    assert 200 < len(between) <= 1_000


@pytest.mark.drill
def test_a_built_engine_is_not_blamed(fine: dict[str, float]) -> None:
    """An engine whose steps nobody knows is sampled as asked: its angle is held against the truth up to whole turns."""
    scene = load_scene("pendulum")
    run = simulate_built(build(scene, "projection"), scene, until=UNTIL, every=5.0)
    assert abs(float(run["q.pivot"][-1]) - fine["q.pivot"]) > 1  # a turn off
    assert run["q.pivot"].attrs[PERIOD] == pytest.approx(2 * np.pi)
    found = proofroll.judge(run, scene, {"q.pivot": "1e-6 rad"})
    assert found.agrees
    assert list(found.unjudged) == ["turns of q.pivot"]
    reference = Reference.of(scene, proofroll.simulate(scene, until=UNTIL, every=5.0))
    off = run.assign({"q.pivot": run["q.pivot"] + 0.1})
    assert observables_of(reference, off)["q.pivot"][-1] == pytest.approx(fine["q.pivot"] + 0.1, abs=1e-6)


@pytest.mark.drill
def test_turns_that_nobody_knows_are_no_difference() -> None:
    """Of two runs whose samples do not tell turns an angle is apart by less than a turn; what is sure is not turned."""
    scene = load_scene("pendulum")
    run = simulate_built(build(scene, "projection"), scene, until=UNTIL, every=1.0)
    other = run.assign({"q.pivot": (run["q.pivot"] + 2 * np.pi + 1e-3).assign_attrs(run["q.pivot"].attrs)})
    mine, theirs = (found["q.pivot"].to_numpy() for found in (run, other))
    turned = on_turns_of(mine, theirs, "q.pivot", (run, other))
    assert turned == pytest.approx(mine + 1e-3, abs=1e-9)
    assert numbers_apart(scene, run, other, {})[0].difference == pytest.approx(1e-3)
    near = simulate_built(build(scene, "projection"), scene, until=0.1, every=0.05)
    assert on_turns_of(near["q.pivot"].to_numpy(), near["q.pivot"].to_numpy() + 7, "q.pivot", (near, near))[0] > 9  # type: ignore[index]
    wound = run.assign({"energy_error": run["energy_error"].assign_attrs({UNCERTAIN: "a spring"})})
    assert on_turns_of(mine, mine, "energy_error", (wound, wound)) is None


def test_times_that_are_rounded_leave_nothing_open() -> None:
    """Samples as far apart as turns may be counted are not too far where the last digit of a time is up."""
    time = time_grid(UNTIL, 2 * EVERY)
    assert np.diff(time).max() > 2 * EVERY
    assert not doubt(time, 3 * time, np.full(len(time), 3.0), 2 * np.pi, EVERY)
    assert doubt(time, 3 * time, np.full(len(time), 3.0), 2 * np.pi, 0.99 * EVERY)


def test_a_rate_that_does_not_fit_is_told() -> None:
    """Near samples of an angle that jumps by a third of a turn against its rate leave its turns open."""
    time = np.linspace(0, 1, 11)
    assert not doubt(time, 3 * time, np.full(11, 3.0), 2 * np.pi, 0.2)
    jumping = 3 * time + 2.1 * (time > 0.5)
    assert doubt(time, jumping, np.full(11, 3.0), 2 * np.pi, 0.2)[UNCERTAIN].startswith("turns are not sure from 0.5 s")
    assert doubt(time, 3 * time, np.full(11, 3.0), 2 * np.pi, 0.04)[UNCERTAIN].startswith("turns show in samples")
