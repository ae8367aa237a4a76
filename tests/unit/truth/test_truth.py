import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lone_routes import by_bodies, by_joints

from proofroll.core.errors import Refused
from proofroll.elements.mechanism import Body, Force, Joint, Loop, Mechanism, Spring
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.bushing import Bushing
from proofroll.elements.mechanism.scene.signal import Formula
from proofroll.elements.mechanism.scene.spring_law import SpringLaw
from proofroll.truth.bodies import maximal_taylor
from proofroll.truth.bodies.maximal_bodies import GeneralBody, Planar, made_bodies
from proofroll.truth.bodies.maximal_coordinates import BESIDE, MaximalCoordinates
from proofroll.truth.error_bars import NUDGE
from proofroll.truth.numerics import compiled_once
from proofroll.truth.plug_in import MechanismTruth
from proofroll.truth.smooth.smooth_truth import BRANCHING, CHAOS, _SmoothTruth, find_truth
from proofroll.truth.switched_truth import switched_truth
from proofroll.truth.switching import contact_taylor
from proofroll.truth.truth_of_mechanism import truth_of

MODELS = Path(__file__).parents[3] / "models"


@pytest.fixture(scope="module")
def andrews(scene):
    """Truth of Andrews' mechanism to the end of its 0.03 s."""
    pytest.importorskip("heyoka")
    return scene("andrews_squeezer"), find_truth(scene("andrews_squeezer"), np.array([0.0, 0.03]))


@pytest.mark.drill
@pytest.mark.arithmetic
def test_andrews_truth_has_the_agreed_digits(andrews):
    """Coordinates agreed by three independent programs to 3e-13 lie within twice that."""
    mechanism, truth = andrews
    expected = {
        "q1": 15.8107711951537,
        "q2": -15.75637105841184,
        "q3": 0.0408222401196458,
        "q4": -0.534730116342080,  # the literature's Phi, of the other sign than Omega
        "q5": 0.524409965879954,
        "q7": 1.04808074104194,
    }
    for joint, at in zip(mechanism.joints, mechanism.q_slices, strict=True):
        if joint.name in expected:
            assert truth.record.q[-1, at][0] == pytest.approx(expected[joint.name], abs=1e-12)


@pytest.mark.drill
def test_published_digits_are_good_to_a_nanoradian_only(andrews):
    """They differ from the truth by 1.1e-9 and 1.4e-9 rad, fifty times its error bar and more."""
    mechanism, truth = andrews
    content = tomllib.loads((MODELS / "andrews_squeezer" / "scene.toml").read_text())
    names = [joint.name for joint in mechanism.joints]
    found = {
        name: value - truth.record.q[-1, mechanism.q_slices[names.index(name[2:])]][0]
        for name, value in content["published"][0].items()
        if name.startswith("q.")
    }
    assert found == pytest.approx({"q.q1": 1.145e-9, "q.q2": -1.431e-9}, abs=5e-12)
    assert truth.bars["q"][-1] < 2e-11


@pytest.mark.drill
@pytest.mark.arithmetic
def test_error_bar_covers_a_closed_form_that_had_no_part_in_it(scene):
    """The nutation of a top by elliptic functions lies within the bar that two routes gave."""
    pytest.importorskip("heyoka")
    truth = find_truth(scene("heavy_top"), np.linspace(0, 0.5, 3))
    title, difference = truth.checked_by
    assert "nutation" in title
    of_the_form = 1e-12  # elliptic functions in doubles: the roots of the cubic lose three digits
    assert difference < truth.bars["q_WB"][-1] + of_the_form
    assert truth.bars["q_WB"][-1] < 1e-11


@pytest.mark.nightly
def test_chosen_rows_that_become_dependent_are_exchanged(scene):
    """A ring whose rows chosen at the start become dependent at a regular pose has a truth beyond, by two routes."""
    pytest.importorskip("heyoka")
    truth = find_truth(scene("bricard", axial_inertia=1 / 600), np.linspace(0, 10, 51))
    assert truth.horizon == np.inf
    assert truth.bars["points"][-1] < 1e-6
    # An integration of one coordinate, apart from this project, good to 5e-9 m.
    apart = [-0.96934034, -1.2212469, 0.75427801]
    assert truth.record.placed(scene("bricard")).points[10, -1] == pytest.approx(apart, abs=1e-8)


def grown(route, path, times):
    """Stands for a motion that a small change of the start leads anywhere."""
    return np.full(len(times), 1e12), route._bodies.within(path.stretches[0], times)[:, :-1]


def wound_up():
    """A pendulum that turns over against a weak spring, so that its energy counts whole turns."""
    body, arm = Body("bob", 1.0, inertia=(0.01, 0.01, 0.01)), (0.0, 0.0, 0.2)
    joint = Joint("pin", "revolute", "world", "bob", child_position=arm, axis=(0, 1, 0), v0=(50.0,), stiffness=0.5)
    return Mechanism((body,), (joint,), gravity=(0.0, 0.0, -9.81))


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize("turns_over", [False, True])
def test_a_route_that_loses_energy_shows_no_chaos(scene, monkeypatch, turns_over):
    """A truth ends where a route changes the energy, however fast small differences grow, and keeps what is before."""
    recorded, ends = MaximalCoordinates.recorded, []

    def braked(route, times, states, *others):
        ends.append(times[-1])
        record = recorded(route, times, states, *others)
        return replace(record, v_WB=record.v_WB * np.exp(-1e-3 * (times > max(ends) / 1.5))[:, None, None])

    pytest.importorskip("heyoka")
    monkeypatch.setattr(MaximalCoordinates, "recorded", braked)
    monkeypatch.setattr(_SmoothTruth, "_nearby", grown)
    found = find_truth(wound_up() if turns_over else scene("double_pendulum"), np.array([0.0, 0.1, 0.2]))
    assert "changes the energy by" in found.ended
    assert found.end == pytest.approx(0.2 / 1.5, rel=1e-6)
    assert found.record.time.tolist() == [0.0, 0.1]
    assert found.bars["p_WB"].shape == (2,)


def test_chaos_is_shown_by_both_routes(scene, monkeypatch):
    """A growth of small differences that one route alone has makes no question ill-posed."""
    pytest.importorskip("heyoka")
    monkeypatch.setattr(_SmoothTruth, "_nearby", grown)
    assert find_truth(scene("double_pendulum"), np.array([0.0, 0.1])).horizon == np.inf


@pytest.mark.drill
def test_chaos_has_a_horizon(scene):
    """Indistinguishable starts part near 9 s; from then on the error bar says so."""
    pytest.importorskip("heyoka")
    truth = find_truth(scene("double_pendulum"), np.array([0.0, 4.0, 10.0]))
    assert truth.horizon == 10.0
    assert truth.bars["points"][1] < 1e-7
    assert truth.bars["points"][-1] > CHAOS


def test_the_bar_has_what_round_off_grows_to(scene, monkeypatch):
    """Where a neighbouring motion leads farther away, routes that agree by chance have no smaller bar."""
    pytest.importorskip("heyoka")
    nearby = _SmoothTruth._nearby

    def farther(route, path, times):
        growth, states = nearby(route, path, times)
        states[:, 0] += 1e-2 * (times > 0) / route._units.length
        return growth, states

    monkeypatch.setattr(_SmoothTruth, "_nearby", farther)
    found = find_truth(scene("double_pendulum"), np.array([0.0, 0.2]))
    assert found.horizon == np.inf
    assert found.bars["p_WB"][-1] > 1e-2 * NUDGE / BESIDE


@pytest.mark.nightly
def test_growth_is_the_same_by_another_arithmetic(scene, monkeypatch):
    """Taylor series and DOP853 tell how motions part to one in ten thousand, so that no horizon flips between them."""
    pytest.importorskip("heyoka")
    times, growths, nearby = np.array([0.0, 0.5, 1.0]), [], _SmoothTruth._nearby

    def told(route, path, times):
        growths.append(nearby(route, path, times)[0])
        return nearby(route, path, times)

    monkeypatch.setattr(_SmoothTruth, "_nearby", told)
    for module in ((), (maximal_taylor, contact_taylor, compiled_once)):
        for part in module:
            monkeypatch.setattr(part, "heyoka", None)
        find_truth(scene("double_pendulum"), times)
    assert growths[1] == pytest.approx(growths[0], rel=1e-4)


@pytest.mark.nightly
def test_singular_poses_are_passed_by_the_closed_form(scene):
    """Where error control stalls, the closed form is the truth and equal steps of another route its witness."""
    truth = find_truth(scene("four_bar", windows=1), np.array([0.0, 1.0]))
    assert truth.routes[0].startswith("closed form")
    assert truth.bars["points"][-1] < 1e-8


@pytest.mark.nightly
def test_what_the_witness_of_a_closed_form_does_not_know_is_not_known(scene, monkeypatch):
    """A value that only one route has is no agreement."""
    recorded = JointCoordinates.recorded

    def lost(route, times, states):
        record = recorded(route, times, states)
        return replace(record, p_WB=np.where(times[:, None, None] > 0.0, np.nan, record.p_WB))

    monkeypatch.setattr(JointCoordinates, "recorded", lost)
    truth = find_truth(scene("four_bar", windows=1), np.array([0.0, 0.8]))
    assert np.isinf(truth.bars["p_WB"]).tolist() == [False, True]


@pytest.mark.nightly
def test_singular_poses_without_a_closed_form_end_a_truth(scene):
    """Values before the pose are kept; its time and the reason are said."""
    crank = {"crank": 0.3999999999999, "speed": 3.0}
    found = find_truth(scene("slider_crank", **crank), np.array([0.0, 0.2, 0.38, 0.5]))
    assert found.end == pytest.approx(0.382006, abs=1e-6)
    assert found.ended == BRANCHING
    assert found.record.time.tolist() == [0.0, 0.2, 0.38]
    shorter = find_truth(scene("slider_crank", **crank), np.array([0.0, 0.2]))
    assert found.record.q[1] == pytest.approx(shorter.record.q[1], abs=1e-13)


@pytest.mark.nightly
def test_a_collapsed_sarrus_linkage_ends_a_truth():
    """Two pairs of hinged plates guide a platform down until they lie flat, where all rows of its loops lose rank."""
    times = np.linspace(0.0, 1.0, 11)
    found = find_truth(sarrus(), times)
    assert "a singular pose of the loops" in found.ended
    assert 0.2 < found.end < 0.9
    assert found.record.time.tolist() == times[times < found.end].tolist()
    seldom = find_truth(sarrus(), np.linspace(0.0, 1.0, 4))
    assert seldom.end == pytest.approx(found.end, rel=1e-4), "wherever samples lie"


def sarrus():
    """Platform on two pairs of plates of 1 m, in the planes xz and yz, that fall from a height of 1 m."""
    plates = [Body(name, 1.0, (0.5, 0, 0), (0.01, 0.1, 0.1)) for name in ("a", "b", "c", "d")]
    bodies = (*plates, Body("top", 1.0, inertia=(0.1, 0.1, 0.1)))
    up = np.pi / 6
    joints = (
        Joint("a0", "revolute", "world", "a", axis=(0, -1, 0), q0=(up,)),
        Joint("a1", "revolute", "a", "b", (1, 0, 0), axis=(0, -1, 0), q0=(np.pi - 2 * up,)),
        Joint("a2", "revolute", "b", "top", (1, 0, 0), axis=(0, -1, 0), q0=(up - np.pi,)),
        Joint("c0", "revolute", "world", "c", orientation=(0, 0, np.pi / 2), axis=(0, -1, 0), q0=(up,)),
        Joint("c1", "revolute", "c", "d", (1, 0, 0), axis=(0, -1, 0), q0=(np.pi - 2 * up,)),
    )
    loop = Loop("loop", "revolute", "d", "top", (1, 0, 0), axis_a=(0, 1, 0), axis_b=(1, 0, 0))
    return Mechanism(bodies, joints, (loop,))


@pytest.mark.drill
def test_a_joint_that_swings_to_its_very_limit_stays_within(scene):
    """A pendulum from rest at its limit comes back to it, by round-off above or below: that does not decide."""
    pytest.importorskip("heyoka")
    free = scene("pendulum", angle=0.5)
    for off in (-1e-12, 0.0, 1e-12):
        mechanism = replace(free, joints=(replace(free.joints[0], limits=(-0.5 + off, 0.5 + off)),))
        assert truth_of(mechanism, np.linspace(0, 1.0, 3)).end == np.inf


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize("size", [1.0, 2.0**-10])
def test_routes_on_different_branches_are_no_truth(scene, monkeypatch, size):
    """Should one route change its branch without a word, the difference is no error bar, however small the lengths."""
    pytest.importorskip("heyoka")
    recorded, ends = JointCoordinates.recorded, []

    def flipped(route, times, states):
        ends.append(times[-1])
        record = recorded(route, times, states)
        return replace(record, p_WB=record.p_WB + np.array([1e-2, 0, 0]) * (times > 0.6 * max(ends))[:, None, None])

    monkeypatch.setattr(JointCoordinates, "recorded", flipped)
    lengths = {"crank": 0.15 * size, "rod": 0.4 * size, "slider_edge": 0.1 * size, "gravity": 9.81 * size}
    found = find_truth(scene("slider_crank", **lengths), np.array([0.0, 0.05, 0.1]))
    assert found.record.time.tolist() == [0.0, 0.05]
    assert found.end == pytest.approx(0.06, rel=1e-6)
    assert found.ended == "the two routes part, as at a singular pose"


@pytest.mark.drill
def test_without_heyoka_the_second_route_is_dop853(scene, monkeypatch):
    """The truth is still known by two routes, and says which."""
    monkeypatch.setattr(maximal_taylor, "heyoka", None)
    truth = find_truth(scene("oscillators"), np.array([0.0, 0.1]))
    assert "maximal coordinates, DOP853" in truth.routes
    assert truth.bars["q"][-1] < 1e-11


@pytest.mark.drill
def test_indeterminate_reactions_are_not_given(scene):
    """Of planar loops closed by revolutes, only Fx, Fy, Mz carry numbers."""
    pytest.importorskip("heyoka")
    wrench = find_truth(scene("slider_crank"), np.array([0.0, 0.1])).record.wrench
    assert (np.isnan(wrench) == [False, False, True, True, True, False]).all()


@pytest.mark.nightly
def test_a_heavy_slider_drives_its_crank_through_the_dead_point(scene):
    """At a million times the crank's mass its speed peaks for a short moment, and no route takes that for a stall."""
    heavy = scene("slider_crank", slider_mass=4e5)
    times = np.array([0.0, 0.18])
    one, two = by_joints(heavy, times, 1e-6), by_bodies(MaximalCoordinates(heavy), times, 1e-6)
    assert np.abs(one.p_WB - two.p_WB).max() < 1e-4


INERTIA = ((0.02, 0.001, 0.0), (0.001, 0.03, 0.002), (0.0, 0.002, 0.025))


def agreed(mechanism):
    """The truth of a few hundredths of a second, whose routes agree on the motion and on every wrench."""
    found = find_truth(mechanism, np.array([0.0, 0.03]))
    assert found.differences["p_WB"] < 1e-13
    assert found.differences["wrench"] < 1e-11
    assert found.differences["energy"] < 1e-12
    return found


@pytest.mark.drill
def test_bodies_without_inertia_are_carried_by_others(monkeypatch):
    """Massless bodies and point masses on fixed joints: both routes agree on the motion and on every wrench.

    By the second route's equations in numbers, as symbols take ten times as long; the next test has those.
    """
    monkeypatch.setattr(maximal_taylor, "heyoka", None)
    bodies = (
        Body("ground", 0.0),
        Body("arm", 1.0, (0.1, 0.02, 0), INERTIA),
        Body("flange", 0.0, (0.3, 0, 0)),
        Body("dot", 0.3, (0.1, 0.2, 0)),
        Body("hand", 0.7, (0, 0.1, 0.05), INERTIA),
        Body("tool", 0.0),
    )
    joints = (
        Joint("base", "fixed", "world", "ground", (0, 0.1, 0.2), (0.1, 0.2, 0.3)),
        Joint("shoulder", "revolute", "ground", "arm", axis=(1, 2, 0), q0=(0.4,), v0=(1.0,), armature=0.1),
        Joint("weld", "fixed", "arm", "flange", (0.2, 0.1, 0.3), (0.4, -0.2, 0.3), child_position=(0.05, 0, 0.1)),
        Joint("pin", "fixed", "flange", "dot", (0.1, 0.1, 0), (0, 0.5, 0)),
        Joint("slide", "prismatic", "dot", "hand", (0.3, 0, 0.1), axis=(0, 1, 1), q0=(-0.2,), v0=(2.0,), armature=0.4),
        Joint("grip", "fixed", "hand", "tool", (0, 0, 0.2), (1, 0, 0)),
    )
    found = agreed(Mechanism(bodies, joints))
    still = found.record.wrench[:, 5]
    assert np.abs(still).max() < 1e-12  # nothing pulls at a tool without mass


IN_SPACE = (
    Joint("shaft", "revolute", "world", "hub", axis=(1, 2, 0), q0=(0.4,), v0=(1.0,)),
    Joint("gimbal", "revolute", "hub", "ring", (0.3, 0, 0), axis=(0, 1, 0.2), q0=(0.3,), damping=0.1),
    Joint("slide", "prismatic", "ring", "hand", axis=(0, 0, 1), q0=(0.1,), v0=(0.5,)),
    Joint("thread", "revolute", "hub", "point", (-0.1, 0, 0), axis=(1, 0, 0), v0=(2.0,)),
    Joint("axle", "revolute", "point", "wheel", (0, 0.3, 0), axis=(0, 0, 1), armature=0.02, v0=(3.0,)),
)
IN_PLANE = (
    Joint("shaft", "revolute", "world", "hub", axis=(0, 0, 1), q0=(0.4,), v0=(1.0,)),
    Joint("slide", "prismatic", "hub", "ring", axis=(1, 0, 0), q0=(0.1,), v0=(0.5,)),
    Joint("wrist", "revolute", "ring", "hand", (0.3, 0, 0), axis=(0, 0, 1), q0=(0.3,), damping=0.1),
    Joint("thread", "revolute", "hub", "point", (0, -0.1, 0), axis=(0, 0, 1), v0=(2.0,)),
    Joint("axle", "revolute", "point", "wheel", (0.3, 0, 0), axis=(0, 0, 1), armature=0.02, v0=(3.0,)),
)


@pytest.mark.one_in(2)
@pytest.mark.nightly
@pytest.mark.parametrize(
    ("joints", "hand", "point", "gravity", "body", "compiled"),
    [
        pytest.param(
            IN_SPACE, (0, 0.1, 0.05), (0, 0.3, 0.1), (0, 0, -9.81), GeneralBody, True, marks=pytest.mark.drill
        ),
        (IN_PLANE, (0.1, 0.05, 0), (0.3, 0, 0), (0.0, -9.81, 0.0), Planar, False),
    ],
)
def test_moving_bodies_without_inertia_are_moved_by_what_they_carry(
    joints, hand, point, gravity, body, compiled, monkeypatch
):
    """Massless bodies and points between joints, with six coordinates each or three: both routes agree on everything.

    In a plane by the second route's equations in numbers, too.
    """
    if not compiled:
        monkeypatch.setattr(maximal_taylor, "heyoka", None)
    bodies = [Body(name, 0.0) for name in ("hub", "ring", "wheel")]
    bodies += [Body("hand", 0.7, hand, INERTIA), Body("point", 0.5, point)]
    mechanism = Mechanism(tuple(bodies), joints, gravity=gravity)
    assert {type(each) for each in made_bodies(mechanism, allow_planar=True)} == {body}
    agreed(mechanism)


SOLID = {"mass": 1.0, "com": (0.1, 0.2, 0.3), "inertia": INERTIA}
TURNED = [
    ((0.4, -0.3, 0.2), (0.0, 0.8, 0.6)),
    ((0.0, 0.0, 0.2), (0.0, 0.8, 0.6)),
]


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize(("orientation", "axis"), TURNED)
def test_a_hinge_whose_child_is_turned_has_a_truth(orientation, axis, monkeypatch):
    """A damped rod that is turned against the world at q = 0 moves in a plane: both routes agree on its motion."""
    monkeypatch.setattr(maximal_taylor, "heyoka", None)
    hinge = Joint("hinge", "revolute", "world", "rod", (0.1, 0.2, 0.3), orientation, axis, q0=(0.7,), v0=(1.0,))
    mechanism = Mechanism((Body("rod", **SOLID),), (replace(hinge, child_position=(0.05, 0.1, 0.0), damping=0.1),))
    assert [type(body) for body in made_bodies(mechanism, allow_planar=True)] == [Planar]
    agreed(mechanism)


@pytest.mark.drill
def test_a_body_whose_plane_is_turned_is_held_by_no_row():
    """Rows that hold a planar body in its plane are round-off, however its frames are turned, and count as none."""
    random = np.random.default_rng(0)
    for _ in range(50):
        orientation, axis, across = random.normal(size=(3, 3))
        joint = Joint("j", "planar", "world", "rod", (0.1, 0.2, 0.3), tuple(orientation), tuple(axis),
                      second_axis=tuple(np.cross(axis, across)), q0=(0.3, -0.4, 0.7), v0=(1.0, 0.0, 2.0))  # fmt: skip
        lean = MaximalCoordinates(Mechanism((Body("rod", **SOLID),), (joint,))).lean
        assert [type(body) for body in lean.equations.bodies] == [Planar]
        assert lean.rank == 0


def test_routes_that_start_apart_are_an_error_of_ours(scene, monkeypatch):
    """A route that places a body wrongly at t = 0 is said to be wrong, and no singular pose is named."""
    monkeypatch.setattr(maximal_taylor, "heyoka", None)
    start = MaximalCoordinates.at_start

    def shifted(route):
        return replace(start(route), p_WB=start(route).p_WB + np.array([0.01, 0.0, 0.0]))

    monkeypatch.setattr(MaximalCoordinates, "at_start", shifted)
    with pytest.raises(Refused, match=r"0.005 m .* apart at t = 0 s.*an error of proofroll's truth.*report") as refused:
        find_truth(scene("slider_crank"), np.array([0.0, 0.1]))
    assert "singular" not in str(refused.value)


@pytest.mark.nightly
def test_energy_of_a_wound_spring_needs_no_more_samples_than_asked_for(monkeypatch):
    """A spring on the fast axis of a universal joint holds its energy at four samples over ten turns."""
    monkeypatch.setattr(maximal_taylor, "heyoka", None)
    laws = {"stiffness": 3.0, "rest": 0.1}
    body = Body("rotor", 1.0, (0.1, 0.2, -0.3), (0.1, 0.2, 0.25))
    joint = Joint("u", "universal", "world", "rotor", axis=(0, 0, 1), q0=(0.3, 0.2), v0=(60.0, -2.0), **laws)
    element = MechanismElement(Mechanism((body,), (joint,)))
    energy = MechanismTruth.truth(element, np.linspace(0, 1, 4), ())["energy"]
    assert np.ptp(energy.to_numpy()) < energy.attrs["error_bar"] < 1e-9


@pytest.mark.drill
def test_the_bar_of_drift_covers_its_round_off(scene):
    """Joints are never open in truth; what is seen of that, and round-off of places and cosines, is the bar."""
    mechanism = scene("oscillators")
    found = find_truth(mechanism, np.array([0.0, 0.5, 1.0]))
    placed = found.record.placed(mechanism)
    turned = replace(placed, q_WB=placed.q_WB * (1 + 4 * np.finfo(float).eps), p_WB=placed.p_WB + np.spacing(1.0))
    assert (np.abs(turned.drift() - placed.drift()) < found.bars["drift"]).all()
    assert found.bars["drift"][-1] < 1e-13


def test_the_bar_of_energy_knows_the_round_off_of_what_cancels():
    """Heights of many metres that take away what motion has leave the digits of both parts, and the bar covers them."""
    slide = Joint("slide", "prismatic", "world", "b", axis=(0, 0, 1), q0=(-8.0,), v0=(np.sqrt(160.0),))
    mechanism = Mechanism((Body("b", 3.0, (0.1, 0.2, 0.3), np.eye(3)),), (slide,), gravity=(0.0, 0.0, -10.0))
    found = find_truth(mechanism, np.array([0.0, 0.1]))
    assert abs(found.record.placed(mechanism).energy()[0] - 9.0) < 1e-12
    assert 240 * np.finfo(float).eps < found.bars["energy"][0] < 1e-11


@pytest.mark.drill
@pytest.mark.arithmetic
def test_routes_of_a_spinning_body_agree(scene):
    """Ten seconds about the intermediate axis: attitudes and points within what turning over makes of round-off.

    A body that passes the axis at 1e-3 of its speed leaves it with a thousand times the error; it does so three times,
    and only what it brings to the second grows again. The series in doubles part from those in long doubles by 6e-12,
    which is round-off alone; route 1 is as good, 2e-12 to 1.5e-11 by the kernel of its linear algebra.
    """
    pytest.importorskip("heyoka")
    found = find_truth(scene("free_body"), np.linspace(0, 10, 11))
    assert max(found.differences["q_WB"], found.differences["points"]) < 2e-10


@pytest.mark.one_in(2)
@pytest.mark.nightly_of("False-switching", "True-smooth")
@pytest.mark.drill
@pytest.mark.parametrize("route", [find_truth, switched_truth], ids=["smooth", "switching"])
@pytest.mark.parametrize("compiled", [True, False])
def test_a_failure_of_the_rates_ends_the_truth_at_its_time(monkeypatch, route, compiled):
    """A bushing turned at 10 rad/s has a truth to 3 rad, to a part in a million of the time, wherever samples lie."""
    for module in () if compiled else (maximal_taylor, contact_taylor):
        monkeypatch.setattr(module, "heyoka", None)
    body, axle = Body("b", 1.0, inertia=(1, 1, 1)), Joint("axle", "revolute", "world", "b", v0=(10.0,))
    mount = Bushing("mount", "world", "b", stiffness=(0, 0, 0, 0, 0, 1e-9))
    for times in ([0.0, 0.1, 0.2, 0.4], [0.0, 0.2999, 0.3001]):
        found = route(Mechanism((body,), (axle,), bushings=(mount,)), np.array(times))
        assert found.end == pytest.approx(0.3, rel=1e-6)
        assert found.record.time.tolist() == times[:-1]
        assert found.ended.startswith("the bushing mount turns by more than 3 rad")


@pytest.mark.nightly
@pytest.mark.nightly_of("50.0-0.00655755831")
@pytest.mark.parametrize(
    ("until", "place"),
    [(5.0, -0.027406676253), pytest.param(50.0, 0.00655755831, marks=pytest.mark.drill)],
)
def test_a_long_run_of_a_tree_is_compiled_in_both_routes(until, place):
    """A mass on a cubic spring under a sweep is where scipy's LSODA and DOP853 have it, after any number of swings."""
    pytest.importorskip("heyoka")
    spring = Spring("s", "world", "m", (-10, 0, 0), force=SpringLaw("400*(L - 10) + 4000*(L - 10)^3 + 4*dL"))
    load = Force("load", "m", "force", (Formula("80*sin(t^2/2)"), 0.0, 0.0))
    slide = Joint("x", "prismatic", "world", "m", axis=(1, 0, 0))
    body = Body("m", 1.6, inertia=(1, 1, 1))
    found = find_truth(Mechanism((body,), (slide,), springs=(spring,), forces=(load,)), np.array([0.0, until]))
    assert found.record.q[-1, 0] == pytest.approx(place, abs=2e-11)
    assert found.routes[1] == "joint coordinates, collocation"
