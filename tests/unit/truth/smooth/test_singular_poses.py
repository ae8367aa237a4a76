import re
from dataclasses import replace

import numpy as np
import pytest
from lone_routes import by_joints
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from proofroll.core.errors import Diverged, Refused
from proofroll.elements.mechanism import Body, Force, Joint, Loop, Mechanism
from proofroll.elements.mechanism.contact.tree_contacts import ContactDynamics
from proofroll.elements.mechanism.dynamics.analysis import RowSign, analyse
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.truth.numerics.hybrid import follow
from proofroll.truth.plug_in import MechanismTruth
from proofroll.truth.smooth.smooth_truth import BRANCHING, find_truth, singular_poses
from proofroll.truth.tree.contact_tree import ContactTree
from proofroll.truth.truth_of_mechanism import truth_of
from proofroll.truth.witnesses.closed_forms import closed_form


@pytest.mark.drill
def test_four_bar_passes_when_its_links_are_in_line(scene):
    """Found where the closed form turns the rods by a quarter and three quarters."""
    mechanism = scene("four_bar", windows=1)
    turned = closed_form(mechanism).motion
    expected = [
        brentq(lambda t, a=angle: turned(np.array([t]))[0][0, 0] + a, 0.0, 1.5) for angle in (np.pi / 2, 3 * np.pi / 2)
    ]
    assert singular_poses(mechanism, 1.5, 5e-3) == pytest.approx(expected, abs=1e-3)


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize("name", ["slider_crank", "bricard"])
def test_regular_motion_passes_none(scene, name):
    """Minima of the singular value away from zero are not taken for singular poses."""
    assert singular_poses(scene(name), 0.4, 5e-3) == []


@pytest.mark.parametrize("sizes", [[-0.2, -0.1, 0.1, 0.2], [0.2, 0.1, 0.1, 0.2]])
def test_the_sign_of_rows_changes_where_they_lose_rank(sizes):
    """A singular value that passes through zero is told from one that turns back before it, however it is turned."""
    turned = [Rotation.from_rotvec([0.1 * k, 0.2, 0.3 * k]).as_matrix() for k in range(4)]
    sign = RowSign(2)
    rows = [np.array([[2.0, 0, 0], [0, size, 0]]) @ R for size, R in zip(sizes, turned, strict=True)]
    assert [sign.changes(C) for C in rows] == [False, False, sizes[0] < 0, False]


def test_rows_that_begin_without_rank_are_as_small_as_can_be():
    """A motion that begins where the rows vanish is at a singular pose, until larger rows tell how large they are."""
    sign, found = RowSign(1), []
    for size in (0.0, 2.0, 1.0):
        sign.changes(np.array([[size, 0.0]]))
        found.append(sign.least)
    assert found == [0.0, 1.0, 0.5]


def parallelogram(damping):
    """Rods of 1 m, 2 m, 1 m on joints 2 m apart, that turn at 3 rad/s towards the pose in which all are in line."""
    rods = {name: Body(name, 1.0, (size / 2, 0, 0), (0.01, 0.1, 0.1)) for name, size in (("a", 1), ("b", 2), ("c", 1))}
    joints = (
        Joint("crank", "revolute", "world", "a", q0=(1.0,), v0=(-3.0,), damping=damping),
        Joint("pin", "revolute", "a", "b", (1, 0, 0), q0=(-1.0,), v0=(3.0,)),
        Joint("rocker", "revolute", "world", "c", (2, 0, 0), q0=(1.0,), v0=(-3.0,)),
    )
    loops = (Loop("loop", "revolute", "b", "c", (2, 0, 0), (1, 0, 0)),)
    return Mechanism(tuple(rods.values()), joints, loops, gravity=(0.0, -9.81, 0.0))


REPORTING_ERRORS = r"near t = 0.2\d*, 0.7\d* s the rows of the loops lose rank and the motion may branch"


@pytest.mark.nightly
def test_a_parallelogram_in_closed_form_says_where_it_may_branch():
    """It goes on as the formula does, and the truth says from where on lengths decide; before that it says nothing."""
    element = MechanismElement(parallelogram(0.0))
    found = MechanismTruth.truth(element, np.array([0.0, 0.5, 1.0]), ())
    assert re.match(REPORTING_ERRORS, found.attrs["ill_posed"])
    assert "ill_posed" not in MechanismTruth.truth(element, np.array([0.0, 0.2]), ()).attrs


@pytest.mark.nightly
def test_a_parallelogram_without_a_closed_form_ends_there_with_the_same_words():
    """Damped, no formula tells the branch, and what is before is kept."""
    found = find_truth(parallelogram(0.1), np.array([0.0, 0.2, 0.5, 1.0]))
    assert found.ended == BRANCHING
    assert 0.2 < found.end < 0.3
    assert found.record.time.tolist() == [0.0, 0.2]


@pytest.mark.nightly
@pytest.mark.parametrize("faster", [pytest.param(2.0**10, marks=pytest.mark.nightly), 2.0**-10])
def test_a_mechanism_that_runs_faster_or_slower_ends_at_the_same_pose(faster):
    """Gravity, speeds and dampers that belong to another unit of time give the same end, to the last bit."""
    here, times = parallelogram(0.1), np.array([0.0, 0.2, 0.5])
    joints = (replace(joint, v0=(faster * joint.v0[0],), damping=faster * joint.damping) for joint in here.joints)
    there = replace(here, joints=tuple(joints), gravity=(0.0, -9.81 * faster**2, 0.0))
    truths = find_truth(here, times), find_truth(there, times / faster)
    assert truths[1].ended == truths[0].ended == BRANCHING
    assert faster * truths[1].end == truths[0].end


@pytest.mark.nightly
@pytest.mark.parametrize("faster", [2.0**10, pytest.param(2.0**-10, marks=pytest.mark.nightly)])
def test_the_witness_of_a_closed_form_is_as_good_in_another_unit_of_time(scene, faster):
    """Its steps are as long for what moves, so that the bars behind a singular pose are the same."""
    bars = [
        find_truth(scene("four_bar", windows=1, gravity=9.81 * k**2, speed=k), np.array([0.0, 0.8]) / k).bars["points"]
        for k in (1.0, faster)
    ]
    assert bars[1] == pytest.approx(bars[0], rel=1e-6)


def pushed_ball():
    """A ball that a force begins to slide on the floor, beside a parallelogram that comes to its singular pose."""
    free = Joint("free", "free", "world", "ball", q0=(0.0, 0.1, 5.0, 1.0, 0.0, 0.0, 0.0))
    linkage, ball = parallelogram(0.1), Body("ball", 1.0, inertia=(0.004,) * 3)
    shapes = (Geometry("shell", "ball", "sphere", radius=0.1), Geometry("floor", "world", "plane", normal=(0, 1, 0)))
    return replace(
        linkage,
        bodies=(*linkage.bodies, ball),
        joints=(*linkage.joints, free),
        geometries=shapes,
        pairs=(Pair("touch", ("shell", "floor"), 0.3),),
        forces=(Force("push", "ball", "force", (20.0, 0.0, 7.0)),),
    )


@pytest.mark.nightly
def test_a_slip_from_rest_that_ends_at_a_singular_pose_starts_at_rest():
    """The stretch is known from its start on, not from where the slip has a direction."""
    found = truth_of(pushed_ball(), np.array([0.0, 0.1, 0.3]))
    assert "a singular pose of the loops" in found.ended
    assert np.abs(found.record.v_WB[0, -1]).max() < 1e-15
    assert found.bars["v_WB"].max() < 1e-11


@pytest.mark.nightly_of("contact")
@pytest.mark.drill
@pytest.mark.parametrize("mechanism", [parallelogram(0.1), pushed_ball()], ids=["smooth", "contact"])
def test_a_truth_that_ends_before_all_times_is_refused_for_the_reason_of_its_end(mechanism):
    """Where none of the times is known, the time of the end and its cause are said."""
    with pytest.raises(Refused, match=r"ends at t = 0.2482\d* s, before the first time .* the loops"):
        truth_of(mechanism, np.array([0.5]))


@pytest.mark.drill
def test_a_loop_that_holds_nothing_has_no_rank_in_a_turned_frame():
    """Rows of a planar loop between bodies that move in one plane are round-off there, and no singular pose is near."""
    turned = (0.381, 1.0, -1.03)
    joints = (
        Joint("crank", "revolute", "world", "a", orientation=turned, q0=(-0.573,), v0=(6.24,)),
        Joint("pin", "revolute", "a", "b", (0.349, 0, 0), q0=(0.766,), v0=(0.0,)),
        Joint("slide", "prismatic", "world", "c", axis=(1, 0, 0), orientation=turned, q0=(1.26,), v0=(0.0,)),
    )
    bodies = tuple(Body(name, 1.0, (0.2, 0, 0), (0.01, 0.01, 0.01)) for name in "abc")
    mechanism = Mechanism(bodies, joints, (Loop("plane", "planar", "b", "c", (0.986, 0, 0)),), gravity=(0, 0, -9.81))
    assert analyse(mechanism).rank == 0
    assert np.isinf(find_truth(mechanism, np.array([0.0, 0.05])).end)


def test_a_step_over_a_singular_pose_is_no_truth():
    """An error control so coarse that it passes the pose without a stall is stopped there."""
    with pytest.raises(Diverged, match=r"at t = 0\.\d+ s: a step passes a singular pose"):
        by_joints(parallelogram(0.1), np.array([0.0, 0.5]), 1e-5)


def test_a_tree_has_none(scene):
    """Without loops there is nothing to lose rank."""
    assert singular_poses(scene("chain"), 1.0, 5e-3) == []


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.arithmetic
@pytest.mark.parametrize(
    "part",
    [
        1e-13,
        3e-10,
        *(pytest.param(part, marks=pytest.mark.drill) for part in (1.001e-12, 1e-11, 1e-10, 1e-10 * (1 + 1e-9))),
    ],
)
def test_a_motion_ends_at_what_lengths_cannot_tell_from_a_singular_pose(scene, part):
    """A crank shorter than its rod by less than 1e-9 may reach it: no error control decides whether that is passed."""
    with pytest.raises(
        Diverged, match=r"at t = 0\.382\d* s: a step passes a singular pose of the loops, or one as near"
    ):
        by_joints(scene("slider_crank", crank=0.4 * (1 - part), speed=3.0), np.array([0.0, 0.5]), 1e-10)


@pytest.mark.nightly
def test_a_motion_beside_a_singular_pose_goes_on(scene):
    """A length that a file tells from the singular one leads past it."""
    by_joints(scene("slider_crank", crank=0.4 * (1 - 1e-7), speed=3.0), np.array([0.0, 0.5]), 1e-10)


@pytest.mark.nightly
def test_a_stop_elsewhere_ends_no_other_way_at_a_singular_pose(scene):
    """A mechanism with a stop that it does not reach is followed by other steps, to the same pose."""
    mechanism = scene("slider_crank", crank=0.4 * (1 - 1e-10), speed=3.0)
    crank = replace(mechanism.joints[0], limits=(-9.0, 9.0), friction=1e-3)
    dynamics = ContactDynamics(replace(mechanism, joints=(crank, *mechanism.joints[1:])))
    path = follow(ContactTree(dynamics, 1e-9, 1.0), 0.5, close=1e-9)
    assert "a step passes a singular pose of the loops" in path.ended
    assert path.stretches[-1].end == pytest.approx(0.382, abs=1e-3)


@pytest.mark.arithmetic
@pytest.mark.parametrize(("away", "singular"), [(0.0, True), (1e-12, True), (1e-7, True), (1e-5, True), (1e-3, False)])
def test_a_start_that_lengths_cannot_tell_from_a_singular_pose_is_one(scene, away, singular):
    """Crank and rod in line but for less than the root of 1e-9 rad: a length that differs by 1e-9 starts there."""
    mechanism = scene("slider_crank", crank=0.4 * (1 - 1e-13), angle=np.pi / 2 - away - 1e-12)
    assert analyse(mechanism).singular_start == singular
