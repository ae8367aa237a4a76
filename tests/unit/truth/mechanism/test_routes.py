"""Both routes of the truth against each other and against digits agreed by independent programs."""

from dataclasses import replace
from itertools import count

import mechanism_examples
import numpy as np
import pytest

from proofroll.core.errors import Refused
from proofroll.elements.mechanism import Body, Joint, Loop, Mechanism, Tree
from proofroll.elements.mechanism.analysis import analysed
from proofroll.elements.mechanism.assembly import check_start
from proofroll.elements.mechanism.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.placed import Placed
from proofroll.elements.mechanism.rotations import to_rpy
from proofroll.truth.mechanism.maximal_coordinates import MaximalCoordinates

# What independent programs (Pinocchio, heyoka, closed forms) agree on: end time, point, its place, tolerance.
# The tolerances are what those programs differ by among each other, twice; of the free body, which magnifies
# round-off, ten times.
AGREED = {
    "pendulum": (10.0, {}, (0.346437135939026, 0.938073190556607, 0.0), 3e-12),
    "double_pendulum": (1.0, {}, (-1.750528895256390, -0.961284660281620, 0.0), 2e-13),
    "free_body": (10.0, {}, (-0.709533805150226, -0.035489134140886, 0.703777166940625), 2e-11),
    "slider_crank": (1.0, {}, (0.406696428168407, 0.0, 0.0), 2e-13),
    "four_bar": (0.5, {"windows": 1}, (0.701512678910477, 0.712656973113886, 0.0), 2e-13),
    "oscillators": (1.0, {}, (0.135757161259753, 0.0, 0.0), 2e-15),
}


@pytest.mark.parametrize("name", AGREED)
def test_tracked_point_is_where_independent_programs_agree(scene, name):
    """Taylor series in maximal coordinates reach the agreed digits."""
    pytest.importorskip("heyoka")
    end, parameters, place, tolerance = AGREED[name]
    mechanism = scene(name, **parameters)
    record = MaximalCoordinates(mechanism).run_taylor(np.array([end]))
    assert placed(mechanism, record).points[0, 0] == pytest.approx(place, abs=tolerance)


def placed(mechanism, record):
    """Where everything is, by the poses that a route recorded."""
    return Placed(mechanism, record.time, record.p_WB, record.v_WB, record.w_WB, record.q_WB)


def apart(one, two, mask):
    """Largest differences of positions, attitudes and determinate reactions."""
    attitude = np.minimum(np.abs(one.q_WB - two.q_WB).max(axis=-1), np.abs(one.q_WB + two.q_WB).max(axis=-1))
    wrench = np.abs(one.wrench - two.wrench)[:, mask]
    return np.abs(one.p_WB - two.p_WB).max(), attitude.max(), wrench.max()


# A tree in space, each way to close loops, many bodies, and what is nearly singular; other scenes' routes are held
# against each other wherever their truth is found. Short, so that the slow route stays fast; the reactions scale with
# the forces of each scene.
SHORT = {
    "heavy_top": (0.2, 1e-10),
    "slider_crank": (0.2, 1e-10),
    "bricard": (0.3, 1e-9),
    "chain": (0.1, 1e-10),
    "gyroscope_cart": (0.1, 1e-10),
}


@pytest.mark.parametrize("name", SHORT)
def test_both_routes_agree(scene, name):
    """Motion within 1e-11 m and 1, and every determinate component of every reaction."""
    pytest.importorskip("heyoka")
    end, of_forces = SHORT[name]
    mechanism = scene(name)
    times = np.array([0.0, end / 2, end])
    one = JointCoordinates(mechanism).run(times)
    two = MaximalCoordinates(mechanism).run_taylor(times)
    place, attitude, wrench = apart(one, two, analysed(mechanism).determinate)
    assert place < 1e-11
    assert attitude < 1e-11
    assert wrench < of_forces
    energy = placed(mechanism, one).energy()
    assert np.abs(energy - placed(mechanism, two).energy()).max() < 1e-11 * max(1.0, np.abs(energy).max())


def test_maximal_coordinates_without_taylor_series(scene):
    """DOP853 with projection of the same rows gives the same motion, redundant rows included."""
    mechanism = scene("bricard")
    times = np.array([0.0, 0.05])
    one = JointCoordinates(mechanism).run(times)
    two = MaximalCoordinates(mechanism).run_dop853(times)
    assert max(apart(one, two, analysed(mechanism).determinate)[:2]) < 1e-12
    assert two.residual.max() < 1e-13


def test_routes_agree_on_every_kind_of_joint():
    """A tree with planar, universal, prismatic, spherical, free and fixed joints moves alike by both routes."""
    mechanism = replace(mechanism_examples.every_kind(), loops=())
    times = np.array([0.0, 0.02])
    one, two = JointCoordinates(mechanism).run(times), MaximalCoordinates(mechanism).run_dop853(times)
    place, attitude, wrench = apart(one, two, analysed(mechanism).determinate)
    assert max(place, attitude) < 1e-12
    assert wrench < 1e-10
    assert np.abs(one.v - two.v).max() < 1e-11


@pytest.mark.parametrize("kind", ["revolute", "prismatic", "universal", "spherical", "planar", "fixed"])
def test_routes_agree_on_every_kind_of_loop(kind):
    """A loop of each kind between two branches in space, reactions included; the root is free, so nothing hides."""
    tree = mechanism_examples.every_kind()
    still = replace(tree, loops=(), joints=tuple(replace(j, v0=(0.0,) * j.nv) for j in tree.joints))
    motion = Tree(still).at(*still.start())
    (p_a, R_a), (p_b, R_b) = ((motion.p_WB[i], motion.R_WB[i]) for i in (4, 5))
    at, axis = np.array([0.3, 0.2, 0.1]), np.array([0.6, 0.0, 0.8])
    world_axis = R_a @ ([0.0, 1.0, 0.0] if kind == "universal" else axis)
    loop = Loop(
        "loop",
        kind,
        "b4",
        "b5",
        tuple(at),
        tuple(R_b.T @ (p_a + R_a @ at - p_b)),
        tuple(axis),
        tuple(R_b.T @ world_axis),
        to_rpy(R_a.T @ R_b),
    )
    mechanism = replace(still, loops=(loop,))
    check_start(mechanism)
    times = np.array([0.0, 0.005])
    one, two = JointCoordinates(mechanism).run(times), MaximalCoordinates(mechanism).run_dop853(times)
    place, attitude, wrench = apart(one, two, analysed(mechanism).determinate)
    assert max(place, attitude) < 1e-12
    assert wrench < 1e-10 * max(1.0, np.abs(one.wrench).max())
    assert max(one.residual.max(), two.residual.max()) < 1e-12


def test_springs_and_dampers_along_joints_act_alike():
    """Springs, dampers and drives along all kinds of coordinates that may have them, in both routes."""
    body = {"mass": 1.0, "com": (0.1, 0.2, -0.3), "inertia": (0.1, 0.2, 0.25)}
    laws = {"stiffness": 3.0, "rest": 0.1, "damping": 0.4}
    mechanism = Mechanism(
        bodies=(Body("a", **body), Body("b", **body), Body("c", **body)),
        joints=(
            Joint("u", "universal", "world", "a", axis=(1, 0, 1), q0=(0.3, 0.2), v0=(1, -2), **laws),
            Joint("s", "spherical", "a", "b", (0, 0, -0.5), v0=(1, 2, 3), damping=0.3),
            Joint("p", "prismatic", "b", "c", (0, 0, -0.5), (0.2, 0.3, 0), (1, 2, 0), v0=(1,), torque=0.7, **laws),
        ),
    )
    times = np.array([0.0, 0.1])
    one, two = JointCoordinates(mechanism).run(times), MaximalCoordinates(mechanism).run_dop853(times)
    assert max(apart(one, two, analysed(mechanism).determinate)) < 1e-10
    energy = placed(mechanism, one).energy()
    assert energy == pytest.approx(placed(mechanism, two).energy(), abs=1e-11)
    assert energy[1] < energy[0]


def test_energy_counts_the_springs_of_universal_joints():
    """What moves without a damper keeps its energy, that of both springs of a universal joint included."""
    body = Body("a", 1.0, (0.1, 0.2, -0.3), (0.1, 0.2, 0.25))
    spring = {"stiffness": 3.0, "rest": 0.1}
    joint = Joint("u", "universal", "world", "a", axis=(1, 0, 1), q0=(0.3, 0.2), v0=(1, -2), **spring)
    mechanism = Mechanism(bodies=(body,), joints=(joint,))
    energy = placed(mechanism, JointCoordinates(mechanism).run(np.linspace(0, 1, 11))).energy()
    assert np.ptp(energy) < 1e-12


def test_long_doubles_keep_more_digits(scene):
    """Energy drifts less in long doubles than in doubles, so they are computed in long doubles indeed."""
    pytest.importorskip("heyoka")
    route = MaximalCoordinates(scene("double_pendulum"))
    double, long = (route.taylor(flag).run(np.array([0.0, 2.0])) for flag in (False, True))
    assert long.dtype == np.longdouble
    assert 0 < np.abs(long.astype(float) - double).max() < 1e-12


def test_dry_friction_is_refused():
    """Neither route follows dry friction by one smooth integration."""
    mechanism = Mechanism(
        bodies=(Body("a", 1.0, (0, 0, -1), (1, 1, 1)),),
        joints=(Joint("j", "revolute", "world", "a", axis=(1, 0, 0), friction=0.1),),
    )
    with pytest.raises(Refused, match="dry friction in joint j"):
        JointCoordinates(mechanism).run(np.array([0.1]))
    with pytest.raises(Refused, match="dry friction in joint j"):
        MaximalCoordinates(mechanism).run_dop853(np.array([0.1]))


def test_steps_of_many_bodies_do_not_chase_round_off(scene, monkeypatch):
    """Twenty links take some thousand evaluations, though the tolerance lies below the noise of their accelerations."""
    evaluations = count(1)
    rate = JointCoordinates.rate
    monkeypatch.setattr(JointCoordinates, "rate", lambda *args: (next(evaluations), rate(*args))[1])
    JointCoordinates(scene("chain", links=20)).run(np.array([0.05]), 1e-15)
    assert next(evaluations) < 1500
