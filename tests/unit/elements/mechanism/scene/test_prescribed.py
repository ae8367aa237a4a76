"""Prescribed motions of joints: exact derivatives, what a file may say, and what a start follows from."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from proofroll.core.errors import InputError
from proofroll.elements.mechanism import Body, Joint, Loop, Mechanism
from proofroll.elements.mechanism.dynamics.analysis import analyse
from proofroll.elements.mechanism.reading.assembly import check_start
from proofroll.elements.mechanism.scene.prescribed import moved
from proofroll.elements.mechanism.scene.signal import FUNCTIONS, Formula, Table, delayed
from proofroll.files.scene_file import load_scene
from proofroll.truth.natural_units import Units

FORMULAS = (
    "0.1*sin(3*t)^2/(1+t) + exp(-t)*tanh(t)",
    "atan(t)*cos(t) - sqrt(2+t) + log(1+t)^2",
    "asin(t/5) + tan(t/3) - 2^1.5*t^3 + 2^t + (1+t)^t",
    "3 - t/(2 - t)",
)


@pytest.mark.parametrize("text", FORMULAS)
def test_derivatives_of_formulas_are_those_of_heyoka(text: str) -> None:
    """Value, rate and acceleration of a formula are those that another code differentiates, to round-off."""
    heyoka: Any = pytest.importorskip("heyoka")
    formula, t = Formula(text), heyoka.make_vars("t")
    symbols: Any = formula.at(t, {name: getattr(heyoka, name) for name in FUNCTIONS if hasattr(heyoka, name)})
    rate = heyoka.diff(symbols, t)
    exact = heyoka.cfunc([symbols, rate, heyoka.diff(rate, t)], [t])([0.7])
    np.testing.assert_allclose(moved(formula, 0.7), exact, rtol=1e-13)


def test_a_table_is_a_smooth_motion_from_rest_to_rest() -> None:
    """A table passes its points, and place, rate and acceleration are continuous, zero rates outside."""
    table = Table((0.1, 0.4, 0.8), (0.0, 0.1, -0.05))
    times = np.array([-1.0, 0.1, 0.4, 0.8, 2.0])
    place, rate, acceleration = moved(table, times)
    assert place == pytest.approx([0, 0, 0.1, -0.05, -0.05], abs=1e-15)
    assert rate[[0, 1, 3, 4]] == pytest.approx(0, abs=1e-12)
    assert acceleration[[0, 1, 3, 4]] == pytest.approx(0, abs=1e-12)
    near = moved(table, np.array([0.1 + 1e-6, 0.8 - 1e-6]))
    assert np.abs(near.acceleration).max() < 1e-2


def test_two_points_are_joined_with_least_jerk() -> None:
    """Two points of a table are joined by the quintic 10 s³ − 15 s⁴ + 6 s⁵."""
    s = np.linspace(0, 1, 7)
    place = moved(Table((0.0, 2.0), (0.0, 3.0)), 2 * s).place
    np.testing.assert_allclose(place, 3 * (10 * s**3 - 15 * s**4 + 6 * s**5), atol=1e-13)


def test_a_motion_in_other_units_keeps_its_derivatives() -> None:
    """Units of length and time scale place, rate and acceleration of a formula and of a table alike."""
    units = Units(length=0.5, mass=2.0, time=0.25)
    for signal in (Formula("0.2*sin(3*t)"), Table((0.0, 1.0), (0.0, 0.3))):
        (body,), (joint,) = (Body("b", 1.0),), (Joint("j", "prismatic", "world", "b", motion=signal),)
        (own,) = units.mechanism(Mechanism((body,), (joint,))).joints
        assert own.motion is not None
        sizes = 0.5 * 0.25 ** -np.arange(3.0)
        np.testing.assert_allclose(np.array(moved(own.motion, 1.6)) * sizes, moved(signal, 0.4), rtol=1e-14)


def test_a_late_motion_is_the_same_earlier() -> None:
    """A delay shifts place, rate and acceleration by its time."""
    for signal in (Formula("sin(3*t)"), Table((0.0, 1.0), (0.0, 0.3))):
        np.testing.assert_allclose(moved(delayed(signal, 0.1), 0.5), moved(signal, 0.4), rtol=1e-13)


SCENE = """
title = "a slide"
source = "test"
[gravity]
magnitude = 0
[[bodies]]
name = "b"
mass = 1
inertia = [1, 1, 1]
[[joints]]
name = "j"
parent = "world"
child = "b"
"""


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ('kind = "spherical"\nmotion = 1', "a spherical joint has none; it is for revolute, prismatic"),
        ('kind = "prismatic"\nmotion = "= x*t"', "joints.0.motion"),
        ('kind = "prismatic"\nmotion = "= sqrt(t)"', "begins smoothly"),
        ('kind = "prismatic"\nmotion = {times = [0, 1], values = [0, 1], hold = true}', "joints.j.motion.hold"),
        ('kind = "prismatic"\nmotion = {times = [0], values = [1]}', "give at least two times"),
        ('kind = "prismatic"\nmotion = "= sin(t)"\nq0 = 0.5', "the motion begins with 0"),
        ('kind = "prismatic"\nmotion = "= sin(t)"\nv0 = 0', "the motion begins with 1"),
        ('kind = "prismatic"\nmotion = "= sin(t)"\nfriction = 1', "joints.j.friction"),
        ('kind = "prismatic"\nmotion = "= sin(t)"\nlimits = [-2, 2]', "joints.j.limits"),
        ('kind = "prismatic"\nmotion = "= sin(t)"\ndependent = true', "joints.j.dependent"),
    ],
)
def test_a_wrong_motion_gets_one_line(tmp_path: Path, lines: str, words: str) -> None:
    """A motion that cannot be, or contradicts other data, is refused by one line that names its field."""
    folder = tmp_path / "slide"
    folder.mkdir()
    folder.joinpath("scene.toml").write_text(SCENE + lines)
    with pytest.raises(InputError) as error:
        load_scene(str(folder))
    assert words in str(error.value)
    assert "\n" not in str(error.value)


def test_the_start_follows_from_the_motion() -> None:
    """Coordinate and rate of a driven joint at the start are those of its motion, and it leaves no freedom."""
    joint = Joint("j", "revolute", "world", "b", motion=Formula("0.3 + 2*t"))
    assert (joint.q0, joint.v0) == ((0.3,), (2.0,))
    assert analyse(Mechanism((Body("b", 1.0),), (joint,))).mobility == 0


def test_a_second_motion_that_follows_is_refused() -> None:
    """Two driven joints of a mechanism with one freedom are one too many, and the message names the second."""
    scene: Any = load_scene("driven_four_bar")
    mechanism = scene.elements[0].mechanism
    joints = tuple(
        replace(joint, motion=Formula(f"{joint.q0[0]!r} + {joint.v0[0]!r}*t"), q0=(), v0=())
        if joint.name == "rocker pin"
        else joint
        for joint in mechanism.joints
    )
    with pytest.raises(InputError, match=r"joints\.rocker pin\.motion.*remove one motion"):
        check_start(replace(mechanism, joints=joints))


def test_loops_are_kinds_without_motion() -> None:
    """A loop has no coordinate, and so no motion."""
    assert not hasattr(Loop("l", "revolute", "a", "b"), "motion")
    assert math.isclose(moved(0.5, 3.0).place, 0.5)
