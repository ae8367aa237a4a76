"""Parameters over ten decades: the truth and the projection solver answer, agree and scale, or say why not."""

from __future__ import annotations

import math
import warnings
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import example, given, settings
from hypothesis import strategies as st

from proofroll.core.errors import Diverged, Refused
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate

FRAME, EULER = "projection[formulation=rotating_frame]", "projection[formulation=euler]"
BODIES, LESS_TIGHT = "projection[formulation=dependent]", "projection[formulation=dependent,rtol=1e-11]"
G = 9.81


def decades(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers whose logarithm is uniform."""
    return st.floats(math.log10(low), math.log10(high)).map(lambda x: 10.0**x)


# Everything but size and mass without dimension, so that a draw is a motion and not a caricature of one.
CYLINDERS = st.fixed_dictionaries(
    {
        "slenderness": decades(1e-3, 0.99),  # a/b
        "froude": decades(1e-2, 1e5),  # V0²/(g c)
        "climb": st.sampled_from([0.0, 0.5, -1.0]),  # ż/V0
        "spin": st.sampled_from([0.0, 1.0, -0.3]),  # a ω1/V0
        "resistance": st.one_of(st.just(0.0), decades(1e-4, 3.0)),  # f/a
    }
)
SIZES, MASSES = decades(1e-7, 1e5), decades(1e-6, 1e6)


def cylinder(motion: dict[str, float], size: float, mass: float, mu: float = math.inf) -> tuple[Scene, float]:
    """The scene of a cylinder of this radius [m], and a time of about one oscillation of z, or of a fall [s]."""
    a = motion["slenderness"] * size
    c = size - a
    speed = math.sqrt(motion["froude"] * G * c)
    parameters = {
        "radius": a,
        "cylinder_radius": size,
        "mass": mass,
        "speed": speed,
        "axial_speed": motion["climb"] * speed,
        "radial_spin": motion["spin"] * speed / a,
        "rolling_resistance": motion["resistance"] * a,
    }
    period = 2 * math.pi * c / speed / math.sqrt(2 / 7)
    until = min(period, 20 * math.sqrt(c / G)) if mu < math.inf else period
    return load_scene("sphere_in_cylinder", **parameters, mu_static=mu), until


def size_of(dataset: xr.Dataset, name: str) -> float:
    """Largest value of a variable; of the forces together, since one of them may vanish."""
    names = ("N", "F2", "F3") if name in {"N", "F2", "F3"} else (name,)
    return max(float(np.max(np.abs(dataset[other].to_numpy()))) for other in names)


COMPARED = ("p_WB", "v_WB", "w_WB", "N", "F2", "F3")


def check_truth(scene: Scene, until: float) -> xr.Dataset:
    """The truth, without warnings, finite, pressed, and with an error bar of round-off."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = truth(scene, np.linspace(0, until, 9))
    for name in COMPARED:
        assert np.all(np.isfinite(found[name].to_numpy())), name
        assert found[name].attrs["error_bar"] < 1e-9 * size_of(found, name), name
    assert np.all(found["N"].to_numpy() >= 0)
    return found


def simulated(scene: Scene, engine: str, until: float) -> xr.Dataset:
    """A run of an engine, without warnings."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = simulate(scene, engine, until=until, every=until / 8)
    assert found.attrs["status"] == "done", found.attrs["message"]
    return found


def assert_agrees(found: xr.Dataset, true: xr.Dataset, names: tuple[str, ...] = COMPARED) -> None:
    """The engine's curves are the truth's, to its tolerance: 1e-9 of each quantity's size."""
    for name in names:
        difference = float(np.max(np.abs(found[name].to_numpy() - true[name].to_numpy())))
        assert difference < 1e-9 * size_of(true, name) + true[name].attrs["error_bar"], name


@pytest.mark.nightly
@settings(max_examples=12)
@given(motion=CYLINDERS, size=SIZES, mass=MASSES)
def test_rolling(motion: dict[str, float], size: float, mass: float) -> None:
    """Whatever the size, mass, speed and resistance: both routes agree, and so does the projection solver."""
    scene, until = cylinder(motion, size, mass)
    true = check_truth(scene, until)
    found = simulated(scene, FRAME, until)
    assert_agrees(found, true)
    if not motion["resistance"]:
        for dataset in (true, found):
            level = dataset["energy"].to_numpy()
            assert np.max(np.abs(level - level[0])) < 1e-10 * np.max(np.abs(level - mass * G * dataset["z"].to_numpy()))


@pytest.mark.nightly
@settings(max_examples=3)
@given(motion=CYLINDERS, size=SIZES)
def test_rolling_in_euler_angles(motion: dict[str, float], size: float) -> None:
    """The same in Euler angles, which follow every turn of the ball: for a ball that does not turn too often."""
    motion = motion | {"slenderness": max(motion["slenderness"], 0.1), "froude": max(motion["froude"], 1.0)}
    scene, until = cylinder(motion, size, 1.0)
    assert_agrees(simulated(scene, EULER, until), check_truth(scene, until))


@pytest.mark.nightly
@settings(max_examples=8)
@given(motion=CYLINDERS, size=SIZES, mu=st.one_of(st.just(0.0), decades(1e-3, 1e3)))
def test_bounded_friction(motion: dict[str, float], size: float, mu: float) -> None:
    """With bounded friction there is an answer, or one sentence why not; the path then is that of the solver too.

    Resistance stays below a tenth of the radius, and that above a tenth of the cylinder's: otherwise the ball slips to
    and fro, and turns, more often than a test has time for.
    """
    motion = motion | {"resistance": min(motion["resistance"], 0.1), "slenderness": max(motion["slenderness"], 0.1)}
    scene, until = cylinder(motion, size, 1.0, mu)
    try:
        true = check_truth(scene, until)
        found = simulated(scene, LESS_TIGHT, until)
    except (Diverged, Refused) as error:
        sentence = str(error)
    else:
        sentence = ""
    if sentence:
        assert "\n" not in sentence
        return
    for name in ("p_WB", "v_WB", "w_WB"):
        assert float(np.max(np.abs(found[name] - true[name]))) < 1e-6 * size_of(true, name), name


@pytest.mark.drill
@pytest.mark.parametrize("mu", [math.inf, pytest.param(0.3, marks=pytest.mark.nightly)])
@settings(max_examples=2)
@given(motion=CYLINDERS, power=st.sampled_from([-20, 20, 7, -1]), heavier=st.sampled_from([-20, 13, 0]))
def test_scale(mu: float, motion: dict[str, float], power: int, heavier: int) -> None:
    """A ball 4^n times as large and 2^k times as heavy does the same in 2^n times the time, to round-off.

    Powers of two change no digit, so that whatever differs is an absolute number somewhere in the code.
    """
    motion = motion | {"resistance": min(motion["resistance"], 0.05), "froude": max(motion["froude"], 1.0)}
    motion["slenderness"] = max(motion["slenderness"], 0.1)  # smaller balls turn more often, and do nothing else
    length, time = 4.0**power, 2.0**power
    small, until = cylinder(motion, 0.225, 0.5, mu)
    large, _ = cylinder(motion, 0.225 * length, 0.5 * 2.0**heavier, mu)
    force = 2.0**heavier
    factors: dict[str, Any] = {"p_WB": length, "v_WB": time, "w_WB": 1 / time, "N": force, "F2": force, "F3": force}
    for engine in ("truth", FRAME if mu == math.inf else BODIES):
        first = truth(small, np.linspace(0, until, 5)) if engine == "truth" else simulated(small, engine, until)
        second = (
            truth(large, np.linspace(0, until * time, 5))
            if engine == "truth"
            else simulated(large, engine, until * time)
        )
        for name, factor in factors.items():
            difference = np.max(np.abs(second[name].to_numpy() / factor - first[name].to_numpy()))
            assert difference < 1e-11 * size_of(first, name), (engine, name)


@pytest.mark.nightly
@settings(max_examples=5)
@given(
    tilt=st.sampled_from([0.0, 0.35, -0.35]),
    speed=decades(1e-3, 1e2),
    across=st.sampled_from([0.0, 0.4]),
    resistance=decades(1e-3, 3.0),
    radius=decades(1e-6, 1e3),
)
@example(tilt=0.35, speed=4.6e-3, across=0.4, resistance=1.0, radius=1.0)  # stops while it is looked at first
def test_stopping_on_a_plane(tilt: float, speed: float, across: float, resistance: float, radius: float) -> None:
    """A ball on a plane stops, rests or rolls back, and never gains energy, whatever stops it."""
    natural = math.sqrt(G * radius)
    scene = load_scene(
        "inclined_plane",
        tilt=tilt,
        radius=radius,
        speed=speed * natural,
        cross_speed=across * speed * natural,
        rolling_resistance=resistance * radius,
    )
    # Until the stronger one, resistance or slope, has stopped it or turned it round.
    until = 3 * (speed + 1) * math.sqrt(radius / G) / min(max(resistance, abs(tilt)), 1.0)
    true = check_truth(scene, until)
    assert_agrees(simulated(scene, BODIES, until), true, ("p_WB", "v_WB", "w_WB"))
    level = true["energy"].to_numpy()
    assert np.all(np.diff(level) <= 1e-12 * np.ptp(level))
