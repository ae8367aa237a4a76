"""Bodies at rest on several feet that begin to slip all at once, however the feet share their friction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar
from scipy.spatial.transform import Rotation

from proofroll.elements.mechanism import Body, Force, Joint, Mechanism
from proofroll.elements.mechanism.contact.tree_contacts import ContactDynamics
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.elements.mechanism.scene.signal import Formula
from proofroll.truth.numerics.hybrid import follow
from proofroll.truth.tree.contact_tree import ContactTree
from proofroll.truth.truth_of_mechanism import truth_of
from proofroll_drill.referee.random_contacts import random_contacts

_MU, _M, _G, _PULL = 0.3, 1.5, 9.81, 9.0
_SLIPS = _MU * _M * _G / _PULL


def _pulled_box(turn: Rotation, along: float) -> Mechanism:
    """A box on four feet, of another weight at one side, that a growing force pulls along an angle [rad]."""
    com = np.array([0.02, 0.01, 0.0])
    corners = [(x, y, -0.05) for x in (-0.15, 0.15) for y in (-0.1, 0.1)]
    feet = [Geometry(f"foot{k}", "box", "sphere", corner, radius=0.0) for k, corner in enumerate(corners)]
    normal = tuple(turn.apply([0, 0, 1.0]).tolist())
    shapes = (Geometry("floor", "world", "plane", normal=normal), *feet)
    pairs = tuple(Pair(f"touch{k}", (f"foot{k}", "floor"), friction=_MU) for k in range(4))
    place, q = turn.apply([0.3, -0.2, 0.05]), turn.as_quat(scalar_first=True)
    free = Joint("free", "free", "world", "box", q0=(*place.tolist(), *q.tolist()))
    box = Body("box", _M, tuple(com.tolist()), inertia=(0.02, 0.03, 0.04))
    pull = turn.apply([np.cos(along), np.sin(along), 0.0]) * _PULL
    value = tuple(Formula(f"{size:.17g}*t") if size else 0.0 for size in pull.tolist())
    force = Force("pull", "box", "force", value, position=tuple(com.tolist()))  # type: ignore[arg-type]
    gravity = tuple(turn.apply([0, 0, -_G]).tolist())
    return Mechanism((box,), (free,), gravity=gravity, geometries=shapes, pairs=pairs, forces=(force,))


def _way(time: float) -> float:
    """Way of the box at a time [m]: its acceleration grows as the pull beyond the friction."""
    return _PULL / _M * max(time - _SLIPS, 0.0) ** 3 / 6


_TURNS = [Rotation.identity(), Rotation.from_euler("xyz", [0.4, -1.1, 2.3])]


@pytest.mark.nightly_of("level")
@pytest.mark.nightly
@pytest.mark.parametrize(("turn", "along"), [(_TURNS[0], 2.0), (_TURNS[1], 0.0)], ids=["level", "turned"])
def test_a_pulled_box_slips_with_all_its_feet(turn: Rotation, along: float) -> None:
    """It slips where the pull reaches μ times its weight, and moves as a point, in any direction and any axes."""
    times = np.array([0.0, _SLIPS - 0.01, _SLIPS + 0.05, _SLIPS + 0.1])
    found = truth_of(_pulled_box(turn, along), times)
    assert found.ended == ""
    assert np.isinf(found.horizon)
    assert sorted((event.kind, event.name) for event in found.events) == [("slip", f"touch{k}") for k in range(4)]
    for event in found.events:
        assert event.time_low <= _SLIPS <= event.time_high
    ways: Array = turn.inv().apply(found.record.p_WB[:, 0] - found.record.p_WB[0, 0])
    expected = np.outer([_way(time) for time in times], [np.cos(along), np.sin(along), 0.0])
    np.testing.assert_allclose(ways, expected, rtol=0, atol=1e-12)
    assert max(float(bar[-1]) for bar in found.bars.values()) < 1e-9


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize("seed", [5, 6])
def test_a_box_that_drops_flat_on_a_steep_slope_slides_on_in_any_axes(seed: int) -> None:
    """All its corners land and set off together; how they share the blow changes nothing, nor do the world's axes."""
    turn, tilt, mu = Rotation.random(random_state=seed), 0.6, 0.4
    normal, gravity = (turn.apply(way) for way in ([0, 0, 1.0], [_G * np.sin(tilt), 0, -_G * np.cos(tilt)]))
    q, place = turn.as_quat(scalar_first=True), turn.apply([0, 0, 0.15])
    free = Joint("free", "free", "world", "box", q0=(*place.tolist(), *q.tolist()))
    shapes = (
        Geometry("floor", "world", "plane", normal=tuple(normal.tolist())),
        Geometry("shape", "box", "box", size=(0.4, 0.3, 0.2)),
    )
    box, pairs = Body("box", 2.0, inertia=(0.02, 0.03, 0.04)), (Pair("touch", ("shape", "floor"), friction=mu),)
    mechanism = Mechanism((box,), (free,), gravity=tuple(gravity.tolist()), geometries=shapes, pairs=pairs)
    found = truth_of(mechanism, np.array([0.0, 0.1, 0.2]))
    assert found.ended == ""
    falls = np.sqrt(2 * 0.05 / (_G * np.cos(tilt)))
    assert [event.kind for event in found.events] == ["impact"] * 4
    assert found.events[0].time == pytest.approx(falls, rel=1e-12)
    down, grip = _G * np.sin(tilt), mu * _G * np.cos(tilt)
    speed, left = down * falls - grip * falls, 0.2 - falls
    way = down * falls**2 / 2 + speed * left + (down - grip) * left**2 / 2
    moved = turn.inv().apply(found.record.p_WB[2, 0] - place)
    np.testing.assert_allclose(moved, [way, 0, -0.05], rtol=0, atol=1e-12)


def _pushed_tripod(friction: tuple[float, float, float], twist: float = 0.0) -> Mechanism:
    """A body on three feet that a growing force pushes along the floor under its middle, and a growing moment turns."""
    feet = [(0.1, 0.0, -0.05), (-0.05, 0.0866025403784, -0.05), (-0.05, -0.0866025403784, -0.05)]
    shapes = [Geometry(f"foot{k}", "body", "sphere", place, radius=0.0) for k, place in enumerate(feet)]
    pairs = tuple(Pair(f"touch{k}", (f"foot{k}", "floor"), friction=mu) for k, mu in enumerate(friction))
    free = Joint("free", "free", "world", "body", q0=(0.0, 0.0, 0.05, 1.0, 0.0, 0.0, 0.0))
    push = Force("push", "body", "force", (Formula("10*t"), 0.0, 0.0), position=(0.0, 0.0, -0.05))
    turn = Force("turn", "body", "moment", (0.0, 0.0, Formula(f"{twist}*t")))
    return Mechanism(
        (Body("body", 1.0, inertia=(0.01, 0.01, 0.02)),), (free,), gravity=(0.0, 0.0, -10.0),
        geometries=(Geometry("floor", "world", "plane"), *shapes), pairs=pairs, forces=(push, turn),
    )  # fmt: skip


@pytest.mark.nightly
def test_feet_hold_as_long_as_any_distribution_of_friction_does() -> None:
    """Nothing slips before the limit load of rigid motions, 3.0330571 N, though the shortest distribution fails at 3.

    The limit is that of the least work of sliding, by a simplex search over rigid motions.
    """
    found = truth_of(_pushed_tripod((0.3, 0.31, 0.3)), np.array([0.0, 0.29, 0.303, 0.32]))
    assert found.end == pytest.approx(0.3033057104, abs=1e-9)
    assert not found.events or found.events[0].time == pytest.approx(0.3033057104, abs=1e-9)


def _pin_on_a_disc(twist: float) -> Mechanism:
    """A pin that an arm presses on a disc whose axis is not its normal, at rest under a moment that grows [N m/s]."""
    mechanism = random_contacts(259)[1]
    hinge, shoulder = mechanism.joints
    joints = replace(hinge, v0=(0.0,), torque=Formula(f"{twist}*t")), replace(shoulder, v0=(0.0,))
    return replace(mechanism, joints=joints, actuators=())


def _grip_of_the_pin(mechanism: Mechanism, moment: float) -> float:
    """Largest margin of friction [N] of any force on the pin that both joints balance under a moment on the disc."""
    hinge, shoulder = (np.array(joint.axis) / np.linalg.norm(joint.axis) for joint in mechanism.joints)
    arm, at = mechanism.bodies[1], np.array(mechanism.joints[1].position)
    pin = at + np.array(mechanism.geometries[0].position)
    rows = np.array([np.cross(shoulder, pin - at), np.cross(hinge, pin)])
    weight = shoulder @ np.cross(arm.com, arm.mass * np.array(mechanism.gravity))
    force = np.linalg.lstsq(rows, [-weight, moment], rcond=None)[0]
    across = np.cross(*rows) / np.linalg.norm(np.cross(*rows))

    def excess(share: float) -> float:
        whole = force + share * across
        return float(np.hypot(whole[0], whole[1]) - mechanism.pairs[0].friction * whole[2])

    return -float(minimize_scalar(excess, bounds=(-100, 100), method="bounded", options={"xatol": 1e-12}).fun)


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize("twist", [2.0, -2.0])
def test_one_contact_that_shares_its_load_with_joints_holds_while_any_distribution_does(twist: float) -> None:
    """A pin on a wobbling disc holds until no force that both joints balance has its friction within the bound."""
    mechanism = _pin_on_a_disc(twist)
    limit = brentq(lambda time: _grip_of_the_pin(mechanism, twist * time), 0.0, 1.0, xtol=1e-14)
    path = follow(ContactTree(ContactDynamics(mechanism), 1e-9, 1.0), 1.0)
    assert path.stretches[0].end == pytest.approx(limit, abs=1e-9)
    assert "c begins to slip from rest" in path.ended


@pytest.mark.nightly
def test_forces_of_a_shared_load_are_held_to_the_law_in_a_distribution_that_its_contacts_can_bear() -> None:
    """A pin that comes to rest on a wobbling disc breaks no law: some friction within its bound balances the joints."""
    mechanism, until = random_contacts(259)[1:]
    found = truth_of(mechanism, np.linspace(0.0, until, 3))
    assert found.ended == ""
    assert [event.time for event in found.events] == pytest.approx([0.020580191355707818], abs=1e-13)
    assert np.isnan(found.pressed[-1]).any()


@pytest.mark.parametrize("press", [1e-16, 1e-15])
def test_a_ball_that_unbounded_friction_may_hold_by_round_off_has_no_one_motion(press: float) -> None:
    """Along an upright shaft a ball falls freely or rolls, by the sign of round-off that presses it: it is told so."""
    shapes = Geometry("ball", "ball", "sphere", radius=0.2), Geometry("shaft", "world", "shaft", radius=0.6)
    free = Joint("free", "free", "world", "ball", q0=(0.8, 0, 0, 1, 0, 0, 0))
    body, pair = Body("ball", 1.0, inertia=(1.0, 1.0, 1.0)), Pair("touch", ("ball", "shaft"), np.inf)
    mechanism = Mechanism((body,), (free,), geometries=shapes, pairs=(pair,), gravity=(press, 1e-17, -10.0))
    assert truth_of(mechanism, np.array([0.0, 0.1])).horizon == 0.0
