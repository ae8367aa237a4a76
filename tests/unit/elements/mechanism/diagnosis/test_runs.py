"""What is told of a mechanism's run that is the truth, but for one thing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy.spatial.transform import Rotation

from proofroll.core.certificate import Line
from proofroll.core.diagnosis import Cause, Evidence, diagnose, hypotheses_of
from proofroll.core.diagnosis.scene_diagnosis import diagnose_scene
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.core.verdict import Judgement, Verdict
from proofroll.elements.mechanism.diagnosis.equations import Change, MechanismStates, placed_of
from proofroll.elements.mechanism.diagnosis.residuals import contradicts_first_steps
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.signal import Table
from proofroll.files.scene_file import load_scene

ROUGH_ARM = Path(__file__).parents[4] / "drill/proofroll_drill/mutants/rough_arm"


def _told(scene: Scene, run: object, true: object, settled: frozenset[str] = frozenset()) -> list[str]:
    return [cause.says for cause in _causes(scene, run, true, settled)]


def _causes(
    scene: Scene, run: object, true: object, settled: frozenset[str] = frozenset(), step: float | None = 2e-3
) -> Sequence[Cause]:
    (element,) = scene.elements
    evidence = Evidence(element, [], run, true, step, settled)  # type: ignore[arg-type]  # datasets
    return diagnose(evidence, hypotheses_of(element))


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize("drift", [0.0, 2e-5])
def test_damping_is_named_although_the_pivot_creeps(drift: float) -> None:
    """Damping of a pendulum is named where its frame, at the pivot, creeps by what a soft joint leaves, or not."""
    scene, times = load_scene("pendulum"), np.arange(0.0, 1.0, 0.02)
    (element,) = scene.elements
    (joint,) = element.mechanism.joints
    damped = replace(element, mechanism=replace(element.mechanism, joints=(replace(joint, damping=0.02),)))
    run = truth(replace(scene, elements=(damped,)), times).copy(deep=True)
    run["p_WB"][:, 0, 0] += drift * (1 - np.cos(5 * times))
    (cause,) = _causes(scene, run, truth(scene, times), step=1e-4)
    assert cause.says.startswith("the joint pivot has damping of 0.02")


@pytest.mark.nightly
def test_one_step_early_is_told_of_few_samples() -> None:
    """Eleven samples of a loop that ends a step early tell the step, and no limit of a speed."""
    scene, times = load_scene("four_bar"), np.arange(11) * 0.03
    early = truth(scene, times + 2e-3 * (times > 0)).assign_coords(time=times)
    (said,) = _told(scene, early, truth(scene, times))
    assert said.startswith("every sample is one step (0.002 s) early")


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize(("limit", "named"), [(0.0, True), (-0.5, False)])
def test_a_stop_is_accused_only_where_the_true_joint_turns_back_at_it(limit: float, named: bool) -> None:
    """A joint that turns back 5 cm too low has another stop, unless something else turns the true one back."""
    told = _told(_with_stop(limit), _fallen_on(-0.05), _fallen_on(0.0))
    assert any("turns back" in said for said in told) == named


@pytest.mark.one_in(3)
@pytest.mark.drill
@pytest.mark.parametrize(("e", "until"), [(0.0, 0.2), (0.5, 0.15), (1.0, 0.3)])
def test_a_stop_is_not_accused_where_a_step_reaches_beyond_it(e: float, until: float) -> None:
    """A mass that turns back, or stays, at the end of the millisecond in which it hits is told of no other stop.

    Its flights after the fall last whole milliseconds, so that it turns back at one place each time. An engine that
    chooses its steps tells none.
    """
    scene = load_scene("stop", height=0.04, restitution=e)
    true = truth(scene, np.arange(0.0, until, 0.01))
    run, (q, v), rows = true.copy(deep=True), (0.04, 0.0), []
    for number in range(1, 10 * true.sizes["time"]):
        rows += [(q, v)] if number % 10 == 1 else []
        fall = 0.0 if q < 0 and v == 0 else 9.81e-3
        q, v = q + 1e-3 * (v - fall / 2), v - fall
        v = -e * v if q < 0 and v < 0 else v
    for name, values in zip(("p_WB", "v_WB"), np.transpose(rows), strict=True):
        run[name][:, 0, 2] = values
    (element,) = scene.elements
    for step, told in ((None, False), (1e-3, False), (1e-4, True)):
        causes = diagnose(Evidence(element, [], run, true, step), hypotheses_of(element))
        assert any("not at its stop" in cause.says for cause in causes) == told


@pytest.mark.drill
def test_a_stop_at_zero_that_is_never_left_can_be_misplaced() -> None:
    """A joint that rests on its stop at 0 from the start, where nothing has a size, is told to rest below it."""
    scene = _resting_on(0.0)
    times = np.arange(0.0, 0.2, 0.02)
    (cause,) = _causes(scene, truth(_resting_on(-0.5), times), truth(scene, times))
    assert (cause.says, cause.unit) == ("the joint guide rests at -0.5, not at its stop at 0", "m")


def _resting_on(at: float) -> Scene:
    """A mass that rests on a stop at a height [m]."""
    scene = _with_stop(at)
    mechanism = scene.elements[0].mechanism  # type: ignore[attr-defined]  # it is one
    (joint,) = mechanism.joints
    return replace(scene, elements=(MechanismElement(replace(mechanism, joints=(replace(joint, q0=(at,)),))),))


def _with_stop(at: float, restitution: float = 0.5) -> Scene:
    """A mass that falls on a stop at a height [m]."""
    scene = load_scene("stop", restitution=restitution)
    (element,) = scene.elements
    assert isinstance(element, MechanismElement)
    joints = (replace(joint, limits=(at, 10.0)) for joint in element.mechanism.joints)
    return replace(scene, elements=(replace(element, mechanism=replace(element.mechanism, joints=tuple(joints))),))


@cache
def _fallen_on(at: float) -> xr.Dataset:
    """The truth of it, past the second impact."""
    return truth(_with_stop(at), np.arange(0.0, 1.0, 0.02))


def _tilted(angle: float) -> Scene:
    """A pendulum whose axis is turned by an angle [rad]."""
    scene = load_scene("pendulum")
    mechanism = scene.elements[0].mechanism  # type: ignore[attr-defined]  # it is one
    (joint,) = mechanism.joints
    axis = Rotation.from_rotvec([0.0, angle, angle]).apply(joint.axis)
    return replace(scene, elements=(MechanismElement(replace(mechanism, joints=(replace(joint, axis=tuple(axis)),))),))


@cache
def _numbers(what: str, change: float) -> tuple[Scene, xr.Dataset]:
    """A scene with one number changed by a part of itself, and the beginning of its truth."""
    if what == "stop":
        return _with_stop(-change), _fallen_on(-change)
    scene = _tilted(change) if what == "axis" else load_scene("gear_pair", ratio=-0.5 * (1 + change))
    return scene, truth(scene, np.arange(0, 0.3, 0.015))


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.drill_of("stop-stops-0.003-False")
@pytest.mark.parametrize(("change", "accuses"), [(3e-3, False), (3e-2, True)])
@pytest.mark.parametrize(("what", "name"), [("stop", "stops"), ("axis", "joint axis")])
def test_a_number_within_a_hundredth_of_the_scenes_accuses_nobody(
    what: str, name: str, change: float, accuses: bool
) -> None:
    """Places of stops and axes that a method's error moves as well are no causes."""
    assert _accuses(name, *_numbers(what, 0.0), _numbers(what, change)[1]) == accuses


def _accuses(name: str, scene: Scene, true: xr.Dataset, run: xr.Dataset) -> bool:
    """True if the one proven cause of a hypothesis accuses the engine."""
    (element,) = scene.elements
    (held,) = (item for item in hypotheses_of(element) if item.id == name)
    (cause,) = (cause for cause in held.test(Evidence(element, [], run, true, 1e-4)) if cause.proven)
    return cause.accuses


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize(("soft", "accuses"), [(0.0, True), (1e-4, False)])
def test_a_ratio_that_is_exact_in_every_sample_is_no_error_of_a_method(soft: float, accuses: bool) -> None:
    """Rates with a ratio 0.3 % off accuse the engine; a part of it that changes, as of a soft coupling, does not."""
    scene, true = _numbers("ratio", 0.0)
    run = _numbers("ratio", 3e-3)[1].copy(deep=True)
    run["w_WB"][:, 1] *= 1 + soft * np.sin(np.arange(run.sizes["time"]))[:, None]
    assert _accuses("couplings", scene, true, run) == accuses


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(("at", "e", "named"), [(-0.05, 0.5, True), (-0.05, 0.45, False), (-0.01, 0.5, False)])
def test_one_rebound_tells_a_stop_by_its_place_and_its_restitution(at: float, e: float, named: bool) -> None:
    """One rebound tells a stop beyond what two steps reach, if place and rate after it are those of its law there."""
    before = slice(0, 41)  # until 0.8 s, before it falls again
    run = truth(_with_stop(at, e), _fallen_on(0.0)["time"].to_numpy()[before])
    told = _told(_with_stop(0.0), run, _fallen_on(0.0).isel(time=before))
    assert any(said.startswith(f"the joint guide turns back at {at:g},") for said in told) == named


@pytest.mark.nightly
def test_dry_friction_of_one_of_two_joints_is_named() -> None:
    """A tenth too much friction of the elbow balances the equations, and no other number does."""
    scene, times = load_scene(str(ROUGH_ARM)), np.arange(0, 0.3, 0.01)
    mechanism = scene.elements[0].mechanism  # type: ignore[attr-defined]  # it has one
    upper, lower = mechanism.joints
    rough = replace(mechanism, joints=(upper, replace(lower, friction=1.1 * lower.friction)))
    run, true = truth(replace(scene, elements=(MechanismElement(rough),)), times), truth(scene, times)
    assert _told(scene, run, true) == ["the engine moves it with the dry friction of the joint elbow 1.1 times"]


@cache
def _swung(name: str) -> tuple[Scene, xr.Dataset]:
    """A scene and the beginning of its truth."""
    scene = load_scene(name)
    return scene, truth(scene, np.arange(0, 0.12, 0.006))


@pytest.mark.drill
def test_round_off_of_a_moment_that_is_zero_has_no_cause() -> None:
    """Moments of 1e-15 N m that an engine gives as zero are not left out."""
    scene, true = _swung("double_pendulum")
    true = true.copy()
    run = true.copy(deep=True)
    for name in (name for name in true.data_vars if str(name).startswith("torque.")):
        true[name] = true[name] * 0 + 1.6e-15
        run[name] = run[name] * 0
    assert _told(scene, run, true) == []


@pytest.mark.drill
def test_reactions_that_were_judged_right_are_not_accused() -> None:
    """A difference of forces within their tolerance is none, whatever would close it."""
    scene, true = _swung("pendulum")
    run = true.copy(deep=True)
    for name in (name for name in true.data_vars if str(name).startswith("force.")):
        run[name] = run[name] * 2
    assert any("counted twice" in said for said in _told(scene, run, true))
    assert _told(scene, run, true, frozenset({"forces"})) == []


@pytest.mark.parametrize("name", ["p_WB", "v_WB", "w_WB", "q_WB"])
def test_what_is_not_finite_is_no_cause(name: str) -> None:
    """A run with NaN from some time on is looked at without a failure of linear algebra, and accused of nothing."""
    scene, true = _swung("double_pendulum")
    run = true.copy(deep=True)
    run[name][10:] = np.nan
    assert _told(scene, run, true) == []


@pytest.mark.drill
def test_speeds_do_not_hide_that_places_are_off_otherwise() -> None:
    """A pendulum that a moment holds back has speeds as of a slow clock, and places as of none."""
    scene, true = _swung("pendulum")
    (element,) = scene.elements
    mechanism = element.mechanism  # type: ignore[attr-defined]  # it is one
    held = replace(mechanism, joints=tuple(replace(joint, torque=0.1) for joint in mechanism.joints))
    slower = truth(replace(scene, elements=(MechanismElement(held),)), true["time"].to_numpy())
    assert not [said for said in _told(scene, slower, true) if "time runs" in said]


def test_a_start_in_another_pose_does_not_accuse_gravity() -> None:
    """Where the certificate shows another pose at time 0, the accelerations that follow from it prove nothing."""
    (element,) = load_scene("pendulum").elements
    start, motion = element.start, element.first_motion  # type: ignore[attr-defined]  # a mechanism

    def line(quantity: str, expected: np.ndarray, found: np.ndarray) -> dict[str, object]:
        told = Line(quantity, "1", tuple(np.ravel(expected)), tuple(np.ravel(found)), 2.0, 1e-9)
        return told.as_dict()

    mirrored = start.q_WB[0] * [-1, 1, 1, 1]
    lines = [
        line("orientation", start.q_WB[0], mirrored),
        line("acceleration", motion.acceleration, -motion.acceleration),
        line("angular acceleration", motion.angular_acceleration, -motion.angular_acceleration),
    ]
    assert not [cause for cause in diagnose(Evidence(element, lines), hypotheses_of(element)) if "gravity" in cause.id]


@pytest.mark.drill
def test_another_motion_is_no_misreported_velocity() -> None:
    """From rest a constant torque that is 6 % too small makes every spin 0.94 times the true one, and every angle."""
    scene, times = load_scene("pendulum"), np.arange(15) * 0.01
    mechanism = scene.elements[0].mechanism  # type: ignore[attr-defined]  # it has one
    (joint,) = mechanism.joints

    def driven(torque: float) -> Scene:
        still = replace(joint, torque=torque, q0=(0.0,), v0=(0.0,))
        return replace(scene, elements=(MechanismElement(replace(mechanism, joints=(still,), gravity=(0, 0, 0))),))

    true, run = (truth(driven(torque), times) for torque in (1.0, 0.939))
    assert not [said for said in _told(driven(1.0), run, true) if said.startswith(("w_WB", "v_WB"))]
    backwards = true.assign(w_WB=-true["w_WB"])
    assert any(said.startswith("w_WB has the wrong sign") for said in _told(driven(1.0), backwards, true))


def _pushed(torque: object, gravity: bool = False, name: str = "pendulum", **start: object) -> Scene:
    """A pendulum with a drive at its first joint."""
    scene = load_scene(name)
    mechanism = scene.elements[0].mechanism  # type: ignore[attr-defined]  # it is one
    first, *others = mechanism.joints
    down = mechanism.gravity if gravity else (0, 0, 0)
    joints = replace(first, torque=torque, **start), *(replace(joint, **start) for joint in others)
    driven = replace(mechanism, joints=joints, gravity=down)
    return replace(scene, elements=(MechanismElement(driven),))


def _pulse(length: float, torque: float = 3.0) -> Table:
    return Table((0.0, length, length + 1e-3), (torque, torque, 0.0))


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("run", "gravity"),
    [
        pytest.param(_pulse(0.02, 2.8), True, id="less"),
        pytest.param(_pulse(0.024), False, id="long, weightless"),
        pytest.param(0.0, True, id="none"),
        pytest.param(_pulse(0.018), True, id="short", marks=pytest.mark.drill),
        pytest.param(_pulse(0.024), True, id="long", marks=pytest.mark.drill),
        pytest.param(_pulse(0.02, 2.8), False, id="less, weightless", marks=pytest.mark.drill),
        pytest.param(_pulse(0.018), False, id="short, weightless", marks=pytest.mark.drill),
        pytest.param(0.0, False, id="none, weightless", marks=pytest.mark.drill),
    ],
)
def test_another_push_is_no_wrong_report(run: Table | float, gravity: bool) -> None:
    """Another torque for a short time moves the bodies otherwise: no clock, delay, factor or limit is told for it."""
    times = np.linspace(0, 0.3, 31)
    scene = _pushed(_pulse(0.02), gravity)
    assert _told(scene, truth(_pushed(run, gravity), times), truth(scene, times)) == []


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.drill_of("double_pendulum")
@pytest.mark.parametrize("name", ["pendulum", "double_pendulum"])
def test_a_flipped_axis_is_no_inverse_rotation(name: str) -> None:
    """Rods that turn the other way have another motion: nothing is inverted, reversed or mirrored."""
    times = np.linspace(0, 0.3, 31)
    one, other = (_pushed(torque, name=name, q0=(0.0,)) for torque in (3.0, -3.0))
    said = _told(one, truth(other, times), truth(one, times))
    assert said
    assert not [text for text in said if "_WB" in text]


@pytest.mark.drill
def test_places_and_velocities_may_both_be_of_the_centres_of_mass() -> None:
    """What turns rightly and is elsewhere is reported wrongly, though places and velocities go together."""
    scene, true = _swung("double_pendulum")
    run = true.copy(deep=True)
    placed = placed_of(scene.elements[0].mechanism, true)  # type: ignore[attr-defined]  # it has one
    arm = np.einsum("tnij,nj->tni", placed.R_WB[:, :-1], [body.com for body in placed.mechanism.bodies])
    run["p_WB"] += arm
    run["v_WB"] += np.cross(placed.w_WB, arm)
    said = _told(scene, run, true)
    assert sum("of the centres of mass" in text for text in said) == 2


def _top(true: xr.Dataset, step: float, armature: float = 0.0, damping: float = 0.0) -> xr.Dataset:
    """The heavy top by Runge-Kutta 4 whose stages turn the attitude by mean spins: of order 2 for the spinning top."""
    (element,) = load_scene("heavy_top").elements
    mechanism = element.mechanism  # type: ignore[attr-defined]  # it has one
    (body,) = mechanism.bodies
    c, weight = np.array(body.com), body.mass * np.array(mechanism.gravity)
    own = body.inertia + body.mass * (c @ c * np.eye(3) - np.outer(c, c))

    def rate(R: Rotation, w: np.ndarray) -> np.ndarray:
        moment = np.cross(c, R.inv().apply(weight)) - np.cross(w, own @ w) - damping * w
        return np.linalg.solve(own + armature * np.eye(3), moment)

    R = Rotation.from_quat(true["q_WB"].to_numpy()[0, 0], scalar_first=True)
    w = R.inv().apply(np.array(true["w_WB"])[0, 0].copy())
    states = [(R, w)]
    for steps in np.rint(np.diff(true["time"]) / step).astype(int):
        for _ in range(steps):
            spins, rates = [w], [rate(R, w)]
            for part in (0.5, 0.5, 1.0):
                turned, spin = R * Rotation.from_rotvec(part * step * spins[-1]), w + part * step * rates[-1]
                spins, rates = [*spins, spin], [*rates, rate(turned, spin)]
            means = np.array([1, 2, 2, 1]) / 6
            R, w = R * Rotation.from_rotvec(step * (means @ spins)), w + step * (means @ rates)
        states.append((R, w))
    found = {
        "q_WB": [[R.as_quat(scalar_first=True)] for R, _ in states],
        "w_WB": [[R.apply(w)] for R, w in states],
    }
    return true.assign({name: true[name].copy(data=np.array(values)) for name, values in found.items()})


@cache
def _true_top() -> tuple[Scene, xr.Dataset]:
    scene = load_scene("heavy_top")
    return scene, truth(scene, np.arange(21) * 5e-3)


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("law", "said"),
    [
        ({}, []),
        ({"armature": 3e-4}, ["the joint tip has an armature (rotor inertia)"]),
        ({"damping": 3e-3}, ["the joint tip has damping"]),
    ],
    ids=["none", "armature", "damping"],
)
def test_a_small_armature_is_an_error_of_steps(law: dict[str, float], said: list[str]) -> None:
    """A third of a hundredth of the inertia, as steps of order 2 show it, is no armature; three hundredths are one."""
    scene, true = _true_top()
    told = _told(scene, _top(true, 1e-3, **law), true)
    assert [text.partition(" of ")[0] for text in told] == said


@pytest.mark.drill
def test_what_vanishes_with_the_step_is_no_cause() -> None:
    """Coarse steps that move as with an armature of 7 % have no cause where the limit of small steps is the truth."""
    scene, true = _true_top()
    run = _top(true, 5e-3)
    judged = Judgement("positions", "m", 1e-2, 0.0, 1e-6, 1.0, Verdict.DIFFERS)
    (cause,) = diagnose_scene(scene, [], run, true, 5e-3, [replace(judged, limit_error=1e-2)])
    assert "armature" in cause.sentence
    assert not diagnose_scene(scene, [], run, true, 5e-3, [replace(judged, limit_error=1e-4)])


@pytest.mark.drill
def test_a_run_that_stands_still_has_no_other_gravity() -> None:
    """Three numbers fitted to the one state of a buffer that every sample returns prove nothing."""
    scene, true = _true_top()
    still = true.isel(time=[-1] * true.sizes["time"]).assign_coords(time=true["time"])
    assert not [said for said in _told(scene, still, true) if "gravity" in said]


def test_the_first_steps_of_a_symmetric_top_tell_gravity() -> None:
    """Round-off about the axis of symmetry, where nothing has a moment, hides no cause."""
    (element,) = load_scene("heavy_top").elements
    turning = element.first_motion.angular_acceleration  # type: ignore[attr-defined]  # a mechanism
    mechanism = element.mechanism  # type: ignore[attr-defined]  # a mechanism
    lighter = MechanismElement(replace(mechanism, gravity=tuple(x / 2 for x in mechanism.gravity)))
    found = lighter.first_motion.angular_acceleration + np.array([0, 1e-7, 1e-8])
    names = "acceleration of the first steps", "angular acceleration of the first steps"
    zero = (0.0, 0.0, 0.0)
    lines = [
        Line(names[0], "m/s^2", zero, zero, 0.0, 1e-6).as_dict(),
        Line(names[1], "rad/s^2", tuple(np.ravel(turning)), tuple(np.ravel(found)), 2e-3, 1e-6).as_dict(),
    ]
    said = [cause.says for cause in diagnose(Evidence(element, lines), hypotheses_of(element))]
    assert said == ["the engine moves it with gravity halved"]


@pytest.mark.parametrize(("factor", "contradicted"), [(1.0, False), (0.9, False), (1e-3, True), (1e3, True)])
def test_first_steps_contradict_masses_of_another_order(factor: float, contradicted: bool) -> None:
    """However coarse the first steps are, masses a thousandth of the scene's are no cause of accelerations like its."""
    (element,) = load_scene("stiff_damper").elements
    mechanism, start = element.mechanism, element.first_motion  # type: ignore[attr-defined]  # a mechanism
    accelerations = np.concatenate([np.atleast_2d(start.acceleration), np.atleast_2d(start.angular_acceleration)], -1)
    first = MechanismStates(mechanism, element.start, accelerations[None], np.zeros(1, dtype=int))  # type: ignore[attr-defined]
    masses = factor * np.array([body.mass for body in mechanism.bodies])
    assert contradicts_first_steps(first, 5.0, Change(mechanism, mass=masses)) is contradicted


@pytest.mark.one_in(2)
@pytest.mark.nightly_of("1.0-1.05-False")
@pytest.mark.drill
@pytest.mark.parametrize(
    ("damping", "moved_with", "named"),
    [(0.0, 0.05, False), pytest.param(1.0, 1.05, False, marks=pytest.mark.drill), (0.0, 0.5, True)],
)
def test_damping_of_a_first_order_scheme_accuses_no_scene(damping: float, moved_with: float, named: bool) -> None:
    """Implicit Euler adds half of stiffness times step to a damping, 0.05 N s/m here; only more than that is named."""
    others = {"torsional_damping": 0.0}
    scene, times = load_scene("oscillators", damping=damping, **others), np.arange(0.0, 0.5, 0.02)
    run = truth(load_scene("oscillators", damping=moved_with, **others), times)
    assert any("damping" in said for said in _told(scene, run, truth(scene, times))) == named
