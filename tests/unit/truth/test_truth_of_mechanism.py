"""Formulas without a finite value at some time: found, named, and the truth kept before it."""

import numpy as np
import pytest

from proofroll.core.errors import Refused
from proofroll.elements.mechanism import Body, Force, Joint, Mechanism
from proofroll.elements.mechanism.scene.parts import Spring
from proofroll.elements.mechanism.scene.signal import Formula
from proofroll.elements.mechanism.scene.spring_law import SpringLaw
from proofroll.truth.truth_of_mechanism import first_pole, truth_of


def pushed(text: str) -> Mechanism:
    """A slide of 1 kg under a force that is a formula, without gravity."""
    slide = Joint("slide", "prismatic", "world", "b", axis=(1, 0, 0))
    force = Force("push", "b", "force", (Formula(text), 0.0, 0.0))
    return Mechanism((Body("b", 1.0),), (slide,), forces=(force,), gravity=(0, 0, 0))


@pytest.mark.parametrize(
    ("text", "time"),
    [
        ("1/(0.7 - t)", 0.7),
        ("1e-9/(0.7123 - t)^2", 0.7123),
        ("tan(t*pi)", 0.5),
        ("log(0.3 - t)", 0.3),
        ("sqrt(0.9 - t)", 0.9),
    ],
)
def test_a_pole_is_found_with_its_time(text: str, time: float) -> None:
    """A formula that becomes infinite or no number is found, however narrow, with field and time."""
    pole = first_pole(pushed(text), 1.0)
    assert pole is not None
    assert pole.field == "forces.push.value.0"
    assert pole.time == pytest.approx(time, rel=1e-6)
    assert np.isfinite(pole.value)


@pytest.mark.parametrize("text", ["1/(1.7 - t)", "exp(-1e4*(t - 0.5)^2)", "1/(1e-6 + (t - 0.31)^2)", "sin(900*t)", "t"])
def test_a_steep_formula_has_no_pole(text: str) -> None:
    """A peak that is high and narrow, but finite, is none."""
    assert first_pole(pushed(text), 1.0) is None


def test_the_truth_before_a_pole_is_kept() -> None:
    """Before the pole the truth is the closed form; from there on it ends, for a reason that names force and time."""
    times = np.linspace(0, 1, 11)
    truth = truth_of(pushed("1/(0.75 - t)"), times)
    known = times[:8]
    exact = (0.75 - known) * np.log((0.75 - known) / 0.75) + known
    assert truth.record.time == pytest.approx(known)
    assert np.abs(truth.record.q[:, 0] - exact).max() < 1e-13
    assert truth.end == pytest.approx(0.75)
    assert "forces.push.value.0 = 1/(0.75 - t) has no finite value at t = 0.75 s" in truth.ended


def test_nothing_before_a_pole_is_refused_by_name() -> None:
    """Where no time lies before the pole, the refusal names force, time and value."""
    with pytest.raises(Refused, match=r"forces\.push\.value\.0 .* no finite value at t = 1e-05 s"):
        truth_of(pushed("1/(1e-5 - t)"), np.linspace(0.1, 1, 10))


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.filterwarnings("ignore:invalid value")  # of routes beyond the end
@pytest.mark.parametrize(("law", "end"), [("3*sqrt(1.2 - L)", 1.2), ("log(L - 0.9)", 0.9), ("0.1*(L - 1)", 0.0)])
def test_an_end_names_the_spring_whose_formula_ends_there(law: str, end: float) -> None:
    """A truth that ends where a spring's formula has no value beyond a length says so; other springs end nothing."""
    way = 0.7 if end > 1 else -0.7
    slide = Joint("slide", "prismatic", "world", "b", axis=(1, 0, 0), v0=(way,))
    spring = Spring("bump", "world", "b", position_a=(-1, 0, 0), force=SpringLaw(law))
    found = truth_of(
        Mechanism((Body("b", 2.0),), (slide,), springs=(spring,), gravity=(0, 0, 0)), np.array([0.0, 0.1, 1.0])
    )
    assert found.ended == (f"springs.bump.force = {law} has no value beyond L = {end:g} m" if end else "")
