"""Truth of joints and contacts that loops or motions alone move: their rate vanishes, and no friction can hold them."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from mechanism_scenes import mechanism_named

from proofroll.core.errors import Refused
from proofroll.core.scene import Scene
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.dynamics.named_forces import named_forces
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.drives import Coupling
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.elements.mechanism.scene.signal import Formula
from proofroll.running.simulation import simulate
from proofroll.truth.truth_of_mechanism import truth_of

G = 9.81


def piston(motion: str = "") -> Mechanism:
    """The slider-crank with dry friction of 2 N at its slider, whose crank may be driven."""
    mechanism: Mechanism = mechanism_named("slider_crank", angle=np.pi / 4, speed=10.0)
    shaft, pin, guide = mechanism.joints
    if motion:
        shaft = replace(shaft, motion=Formula(motion), q0=(), v0=())
    return replace(mechanism, joints=(shaft, pin, replace(guide, friction=2.0)))


def driven_pair(motion: str, speed: float = 0.0) -> Mechanism:
    """A slider that a motion moves, and one with dry friction of 3 N that a coupling moves by half as much."""
    bodies = (Body("a", 1.0, inertia=(0.1, 0.1, 0.1)), Body("b", 2.0, inertia=(0.1, 0.1, 0.1)))
    joints = (
        Joint("first", "prismatic", "world", "a", axis=(1, 0, 0), motion=Formula(motion)),
        Joint("second", "prismatic", "world", "b", axis=(0, 1, 0), friction=3.0, v0=(speed / 2,)),
    )
    coupling = Coupling("gear", "first", "second", ratio=0.5)
    return Mechanism(bodies, joints, couplings=(coupling,), gravity=(0.0, 0.0, 0.0))


@pytest.mark.nightly
def test_a_slider_passes_its_dead_centre() -> None:
    """Crank and slider go on behind the dead centre as their one equation says; friction reverses there."""
    found = truth_of(piston(), np.array([0.0, 0.4]))
    # scipy's DOP853 on the crank's own equation, piece by piece between dead centres
    assert found.record.q[-1, [0, 2]] == pytest.approx([5.301644428917, 0.463425942981], abs=1e-11)
    assert found.record.v[-1, 0] == pytest.approx(10.5063185365, abs=1e-9)
    assert [event.kind for event in found.events] == ["turn"]
    assert found.events[0].time == pytest.approx(0.2429780755, abs=1e-10)
    assert np.isinf(found.horizon)


@pytest.mark.nightly
def test_a_driven_crank_carries_its_slider_through_both_senses() -> None:
    """The drive's torque has both signs of friction in turn."""
    found = truth_of(piston("0.7853981633974483 + 10*t"), np.linspace(0.0, 0.4, 5))
    torque, friction = found.record.named.T
    right = [2.5081365477, -1.1504178945, -1.1739292064, 0.190679917, 1.101923792]
    assert torque == pytest.approx(right, abs=1e-9)
    assert friction.tolist() == [2.0, 2.0, 2.0, -2.0, -2.0]


@pytest.mark.drill
@pytest.mark.nightly
@pytest.mark.nightly_of("sine")
@pytest.mark.parametrize(
    ("motion", "speed", "acceleration", "turns"),
    [
        ("0.1*sin(6*t)", 0.6, lambda t: -3.6 * np.sin(6 * t), [np.pi / 12, np.pi / 4]),
        ("0.1*(t - sin(t))", 0.0, lambda t: 0.1 * np.sin(t), []),  # its acceleration vanishes at the start, too
    ],
    ids=["sine", "cycloid"],
)
def test_what_a_motion_moves_rubs_against_its_rate(
    motion: str, speed: float, acceleration: Callable[[Array], Array], turns: list[float]
) -> None:
    """Friction of a joint that a coupling moves has the sense of its rate, and turns where that vanishes."""
    mechanism, times = driven_pair(motion, speed), np.array([0.0, 0.2, 0.5, 0.9])
    found = truth_of(mechanism, times)
    senses = np.sign([1.0, *found.record.v[1:, 1]])
    names = [item.name for item in named_forces(mechanism)]
    assert found.record.named[:, names.index("friction.second")] == pytest.approx(-3.0 * senses, abs=1e-12)
    drive = 1.5 * acceleration(times) + 1.5 * senses
    assert found.record.named[:, names.index("drive.first")] == pytest.approx(drive, abs=1e-11)
    assert [event.time for event in found.events] == pytest.approx(turns, abs=1e-12)


@pytest.mark.nightly
def test_a_driven_foot_rubs_on_the_floor_in_both_senses() -> None:
    """A motion alone moves the foot along the floor, and friction of its weight acts against it."""
    bodies = (Body("cart", 1.0, inertia=(0.1, 0.1, 0.1)), Body("block", 2.0, inertia=(0.1, 0.1, 0.1)))
    joints = (
        Joint("rail", "prismatic", "world", "cart", axis=(1, 0, 0), motion=Formula("0.1*sin(6*t)")),
        Joint("lift", "prismatic", "cart", "block", axis=(0, 0, 1), q0=(0.05,)),
    )
    shapes = (Geometry("floor", "world", "plane"), Geometry("foot", "block", "sphere", radius=0.05))
    pairs = (Pair("touch", ("foot", "floor"), friction=0.4),)
    mechanism = Mechanism(bodies, joints, geometries=shapes, pairs=pairs, gravity=(0.0, 0.0, -G))
    times = np.array([0.0, 0.2, 0.5])
    found = truth_of(mechanism, times)
    drive = -10.8 * np.sin(6 * times) + 0.4 * 2 * G * np.array([1.0, 1.0, -1.0])
    assert found.record.named[:, 0] == pytest.approx(drive, abs=1e-11)
    assert [event.kind for event in found.events] == ["turn"]
    assert found.events[0].time == pytest.approx(np.pi / 12, abs=1e-12)


def test_what_stands_because_it_is_driven_has_no_determinate_friction() -> None:
    """A motion that stands holds the joint, so that its friction is any force within the bound: the reason says so."""
    with pytest.raises(Refused, match="hold what loops, couplings, motions or one another hold already"):
        truth_of(driven_pair("0.3 + 0*t"), np.array([0.0, 0.1]))


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize("motion", [pytest.param("0.7853981633974483 + 10*t", marks=pytest.mark.drill), ""])
def test_projection_passes_dead_centres(motion: str) -> None:
    """Its slider passes the dead centre with the truth's values."""
    scene = Scene("piston", "", (MechanismElement(piston(motion)),))
    friction = simulate(scene, "projection", until=0.3, every=0.3)["friction.guide"].to_numpy()
    assert friction.tolist() == [2.0, -2.0]
