"""Held signals and policies: the harness sets them at instants, for every engine and both routes of the truth."""

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from proofroll import simulate
from proofroll.core.errors import InputError
from proofroll.core.multi_element import asking, build
from proofroll.core.parameters import Parameters
from proofroll.core.plugins import load_engine, resolve_settings
from proofroll.core.scene import Scene
from proofroll.core.time_grid import time_grid
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.dynamics.held_signals import begun
from proofroll.elements.mechanism.dynamics.matrices import matrices_of
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.control import Control
from proofroll.elements.mechanism.scene.drives import Actuator
from proofroll.elements.mechanism.scene.policy import Observation, PolicySource
from proofroll.elements.mechanism.scene.signal import Table, read_signal
from proofroll.running.recording import record
from proofroll.running.simulation import simulate_built

RATE = 50.0
STEPS, UNTIL = (1e-3, 5e-4), 0.06
TIMES = tuple(k / RATE for k in range(6))
HIPS, KNEES = (0.4, 0.9, -0.3, 0.8, 0.1, 0.5), (-0.5, -1.1, 0.2, -0.4, -0.9, 0.3)


def _legs(targets: Sequence[Any], limit: float | None = 1.5, **more: Any) -> Scene:
    """Body that floats, with a leg of two links: servos at hip and knee."""
    bodies = [
        Body("trunk", 2.0, (0.02, 0.0, 0.01), ((0.02, 0.0, 0.0), (0.0, 0.03, 0.0), (0.0, 0.0, 0.04))),
        Body("thigh", 0.5, (0.0, 0.0, -0.1), ((2e-3, 0.0, 0.0), (0.0, 2e-3, 0.0), (0.0, 0.0, 4e-4))),
        Body("shank", 0.3, (0.0, 0.01, -0.1), ((1e-3, 0.0, 0.0), (0.0, 1e-3, 0.0), (0.0, 0.0, 2e-4))),
    ]
    turned = (np.cos(0.2), 0.0, np.sin(0.2), 0.0)
    joints = [
        Joint("base", "free", "world", "trunk", q0=(0.0, 0.0, 1.0, *turned), v0=(0.1, 0.0, 0.2, 0.5, -0.3, 0.2)),
        Joint("hip", "revolute", "trunk", "thigh", position=(0.1, 0.0, 0.0), axis=(0, 1, 0), q0=(0.5,), v0=(0.2,)),
        Joint("knee", "revolute", "thigh", "shank", position=(0, 0, -0.2), axis=(0, 1, 0), q0=(-0.8,), v0=(-0.4,)),
    ]
    servos = [
        Actuator(f"{name}_servo", name, "position", target, kp=6.0, kd=0.1, limit=limit)
        for name, target in zip(("hip", "knee"), targets, strict=True)
    ]
    mechanism = Mechanism(tuple(bodies), tuple(joints), actuators=tuple(servos), **more)
    return Scene("leg", "A leg under a controller", (MechanismElement(mechanism),))


class Swing:
    """Policy with a memory, whose action needs every part of the observation."""

    def __init__(self, joints: Sequence[str]) -> None:
        self.joints, self.calls = tuple(joints), 0

    def reset(self) -> None:
        """See the protocol."""
        self.calls = 0

    def __call__(self, seen: Observation) -> list[float]:
        """See the protocol."""
        self.calls += 1
        tilt = seen.gravity_B[0] + 0.3 * seen.w_WB_B[1] + 0.2 * seen.v_WB_W[2] - 0.1 * seen.p_WB[2]
        hip = np.sin(9 * seen.time) - 0.4 * seen.q[0] + 0.05 * seen.v[1] + tilt + 0.2 * seen.last[1]
        return [hip, np.tanh(seen.q[1]) + seen.R_WB[0, 2] + 0.01 * self.calls]


def make_swing(joints: Sequence[str]) -> Swing:
    """Makes the policy of these tests."""
    return Swing(joints)


def _commanded(make: Callable[[Sequence[str]], Any] = make_swing, **more: Any) -> Scene:
    values = {"scale": 0.6, "pose": (0.2, -0.6), "policy": PolicySource("test:make", make=make), **more}
    return _legs([0.0, 0.0], None, control=Control(RATE, ("hip_servo", "knee_servo"), **values))


SCENES = {
    "table": _legs([Table(TIMES, values, hold=True) for values in (HIPS, KNEES)], limit=None),
    "policy": _commanded(),
    "limited": _legs([Table(TIMES, values, hold=True) for values in (HIPS, KNEES)]),
}


@cache
def _truth(name: str) -> Any:
    return simulate(SCENES[name], until=UNTIL)


def _error(name: str, engine: str, dt: float | None = None, quantity: str = "p_WB") -> float:
    run = simulate(SCENES[name], engine, until=UNTIL, **({} if dt is None else {"dt": dt}))
    assert run.attrs["status"] == "done", run.attrs["message"]
    return float(np.abs(run[quantity].values - _truth(name)[quantity].values).max())


def test_a_held_table_belongs_to_its_own_time() -> None:
    """A held value holds from its time on; a table without `hold` is interpolated."""
    none = Parameters({}, {})
    table = {"times": [0.0, 0.1, 0.2], "values": [1.0, 3.0, 2.0]}
    held = read_signal("target", {**table, "hold": True}, none, "rad")
    assert [float(held.at(t)) for t in (-1.0, 0.0, 0.0999, 0.1, 0.15, 0.2, 9.0)] == [1, 1, 1, 3, 3, 2, 2]
    assert held.at(np.array([0.05, 0.1])).tolist() == [1, 3]
    assert float(read_signal("target", table, none, "rad").at(0.05)) == 2.0
    with pytest.raises(InputError, match=r"target\.hold = 'yes': give true"):
        read_signal("target", {**table, "hold": "yes"}, none, "rad")


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.drill_of("table-mujoco-3.5-1e-08")
@pytest.mark.parametrize(
    ("name", "engine", "order", "most"),
    [
        ("table", "mujoco", 3.5, 1e-8),
        ("policy", "pinocchio", 3.5, 1e-8),
        ("table", "projection[integrator=rk4]", 3.5, 1e-8),
        ("policy", "exudyn", 1.9, 3e-5),
    ],
)
def test_an_engine_keeps_its_order(name: str, engine: str, order: float, most: float) -> None:
    """Jumps of targets cost no engine its order: a target belongs to the steps that begin at its instant."""
    coarse, fine = (_error(name, engine, dt) for dt in STEPS)
    assert fine < most
    assert np.log2(coarse / fine) > order
    # a sample at an instant has the effort of the new target
    assert _error(name, engine, STEPS[1], "effort.hip_servo") < 2e4 * most


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.drill_of("limited")
@pytest.mark.parametrize("name", list(SCENES))
def test_the_truth_is_exact(name: str) -> None:
    """Both routes of the truth ask for targets from their own states, and agree with a third solver to 1e-10."""
    assert _truth(name)["p_WB"].attrs["error_bar"] < 1e-10
    assert _error(name, "projection") < 1e-10


def test_the_policy_is_asked_at_the_instants() -> None:
    """A policy is asked once at each instant, with the state of the run, and its target acts from there on."""
    asked: list[tuple[float, float]] = []

    def make(joints: Sequence[str]) -> Callable[[Observation], list[float]]:
        assert list(joints) == ["hip", "knee"]
        asked.clear()

        def policy(seen: Observation) -> list[float]:
            asked.append((seen.time, float(seen.q[0])))
            assert np.allclose(seen.R_WB @ seen.gravity_B, [0, 0, -1], atol=1e-12)
            return [0.1, -0.2]

        return policy

    run = simulate(_commanded(make), "mujoco", until=0.1, every=0.01)
    assert [time for time, _ in asked] == [k / RATE for k in range(6)]
    assert [q for _, q in asked] == pytest.approx(run["q.hip"].values[::2], abs=1e-12)


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(("held", "delay"), [("target", 0), ("target", 1), ("effort", 0), ("effort", 2)])
def test_a_controller_acts_as_written(held: str, delay: int) -> None:
    """Targets and held efforts, on time and delayed, move a hinge as its equation, integrated between instants."""
    inertia, kp, kd, pose, limit = 0.4, 30.0, 1.5, -0.3, 4.0

    def make(_: Sequence[str]) -> Callable[[Observation], list[float]]:
        return lambda seen: [np.sin(20 * seen.time) - 0.5 * seen.q[0] + 0.1 * seen.v[0]]

    source = PolicySource("test:make", make=make)
    body = Body("wheel", 1.0, inertia=((inertia, 0, 0), (0, inertia, 0), (0, 0, inertia)))
    hinge = Joint("hinge", "revolute", "world", "wheel", q0=(0.2,), v0=(1.0,))
    servo = Actuator("servo", "hinge", "position", 0.0, kp=kp, kd=kd, limit=limit)
    control = Control(RATE, ("servo",), source, 0.8, (pose,), delay, held)
    mechanism = Mechanism((body,), (hinge,), actuators=(servo,), control=control)
    scene = Scene("hinge", "", (MechanismElement(mechanism),))
    y, waiting = np.array([0.2, 1.0]), [pose] * delay

    def effort(target: float, q: float, v: float) -> float:
        return float(np.clip(kp * (target - q) - kd * v, -limit, limit))

    for k in range(10):
        waiting.append(pose + 0.8 * (np.sin(20 * k / RATE) - 0.5 * y[0] + 0.1 * y[1]))
        target, start = waiting.pop(0), tuple(y)
        fixed = effort(target, *start) if held == "effort" else None

        def rate(_: float, y: Any, target: float = target, fixed: float | None = fixed) -> list[float]:
            return [y[1], (effort(target, y[0], y[1]) if fixed is None else fixed) / inertia]

        y = solve_ivp(rate, (0, 1 / RATE), y, rtol=1e-12, atol=1e-13, max_step=1e-4).y[:, -1]
    for engine, allowed in (("truth", 1e-9), ("mujoco", 1e-6)):
        run = simulate(scene, engine, until=10 / RATE)
        assert float(run["q.hinge"].values[-1]) == pytest.approx(y[0], abs=allowed)


def test_an_engine_built_by_hand_has_the_controller() -> None:
    """An engine that a test builds by itself is under the scene's controller, too, and once only."""
    kind, scene = load_engine("mujoco"), SCENES["policy"]
    settings = resolve_settings(kind, {"dt": STEPS[0]}, scene.requires)
    whole = simulate(scene, "mujoco", until=UNTIL, dt=STEPS[0])
    for engine in (kind.build(scene, settings), build(kind, scene, settings)):
        run = simulate_built(engine, scene, until=UNTIL)
        assert np.abs(run["p_WB"].values - whole["p_WB"].sel(time=run["time"]).values).max() == 0


@pytest.mark.nightly
def test_the_truth_has_the_times_that_are_asked_for() -> None:
    """Samples at instants, which differ from the grid by round-off, keep the times of the grid to the last bit."""
    (element,) = SCENES["policy"].elements
    control = replace(element.mechanism.control, rate=1000.0)
    scene = Scene("fast", "", (MechanismElement(replace(element.mechanism, control=control)),))
    times = time_grid(0.021, 3e-3)
    assert times.tolist() != [k / 1000 for k in range(0, 22, 3)]
    assert simulate(scene, until=0.021, every=3e-3)["time"].values.tolist() == times.tolist()


def test_a_step_divides_the_time_between_instants() -> None:
    """A step that does not lead from instant to instant is refused in one line."""
    with pytest.raises(InputError, match=r"dt = 0\.008: a target changes at 0\.02 s, and no whole number of steps"):
        simulate(SCENES["table"], "mujoco", until=0.08, every=0.08, dt=8e-3)


@pytest.mark.parametrize(
    ("action", "says"),
    [
        (lambda _: [1.0], r"its action has shape \(1,\); it drives 2 joints"),
        (lambda _: 1 / 0, r"it failed \(at t = 0 s\): ZeroDivisionError: division by zero"),
        (lambda _: ["a", "b"], r"it failed \(at t = 0 s\): ValueError"),
    ],
)
def test_a_wrong_policy_is_one_line(action: Any, says: str) -> None:
    """A policy that fails, or answers with something else than an action, is named with what it did."""
    with pytest.raises(InputError, match=says):
        simulate(_commanded(lambda _: action), "mujoco", until=0.1)


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("no_such_module:make", "there is no module no_such_module"),
        ("math:no_such", "the module math has no callable 'no_such'"),
        ("plain", "give module:make"),
    ],
)
def test_a_policy_that_is_not_there(name: str, says: str) -> None:
    """The name of a policy that cannot be found is one line."""
    with pytest.raises(InputError, match=says):
        PolicySource(name)


@pytest.mark.drill
def test_a_run_tells_what_its_policy_set() -> None:
    """The targets of a run follow from its states at the instants; without a sample at one they are not known."""
    (element,) = SCENES["policy"].elements
    known = element.along(_truth("policy"))
    assert known.mechanism.control is None
    again = simulate(Scene("known", "", (known,)), until=UNTIL)
    assert np.abs(again["p_WB"].values - _truth("policy")["p_WB"].values).max() < 1e-10
    assert element.along(simulate(SCENES["policy"], "mujoco", until=UNTIL, every=0.015)) is None
    assert element.along(None).first_motion.acceleration == pytest.approx(element.first_motion.acceleration)


@pytest.mark.nightly
def test_causes_under_a_policy_are_those_of_the_engine() -> None:
    """A wrong gain under a policy is named as without one, and an honest engine is not accused."""
    from proofroll.core.diagnosis.scene_diagnosis import diagnose_scene

    scene, times = SCENES["policy"], {"until": 0.1, "every": 1e-3}
    truth = simulate(scene, **times)
    (element,) = scene.elements
    weak = tuple(replace(item, kd=item.kd * 1.5) for item in element.mechanism.actuators)
    other = replace(scene, elements=(MechanismElement(replace(element.mechanism, actuators=weak)),))
    honest, faulty = (simulate(each, "mujoco", **times) for each in (scene, other))
    assert diagnose_scene(scene, [], honest, truth, 1e-3) == []
    causes = diagnose_scene(scene, [], faulty, truth, 1e-3)
    assert [item.cause.says for item in causes] == ["it moves as if kd is 1.5 of the right one"]


def test_a_slow_policy_does_not_slow_the_engine() -> None:
    """The time of an engine is without that of its policy."""
    calls: list[float] = []

    def make(_: Sequence[str]) -> Callable[[Observation], list[float]]:
        def policy(seen: Observation) -> list[float]:
            calls.append(seen.time)
            end = time.perf_counter() + 0.02
            while time.perf_counter() < end:
                pass
            return [0.0, 0.0]

        return policy

    kind = load_engine("mujoco")
    scene = _commanded(make)
    engine = build(kind, scene, resolve_settings(kind, {}, scene.requires))
    recording = record(engine, scene, time_grid(UNTIL, 0.01))
    assert {0.02, 0.04, 0.06} <= set(calls)
    assert asking(engine)[0] > 0.075  # of four calls
    assert recording.wall_seconds < 0.5 * asking(engine)[0]


@pytest.mark.parametrize("engine", ["mujoco", "pinocchio", "projection", "exudyn"])
def test_a_start_at_the_target_is_no_wrong_model(engine: str) -> None:
    """Where efforts at the start are of round-off, the certificate does not compare their digits."""
    scene = _commanded(delay=1, held="effort", pose=(0.3, -0.7))
    (element,) = scene.elements
    still = [replace(joint, v0=(0.0,) * joint.nv) for joint in element.mechanism.joints]
    still[1:] = [replace(joint, q0=(at,)) for joint, at in zip(still[1:], (0.3, -0.7), strict=True)]
    scene = replace(scene, elements=(MechanismElement(replace(element.mechanism, joints=tuple(still))),))
    assert 0 < np.abs(scene.elements[0].first_named).max() < 1e-14  # type: ignore[attr-defined]
    assert simulate(scene, engine, until=0.02).attrs["status"] == "done"


def test_matrices_of_an_engines_mechanism_are_those_of_the_scene() -> None:
    """A mechanism whose held targets an engine sets has its own matrices at the start, as the scene's has."""
    mechanism = _legs([Table(TIMES, HIPS, hold=True), Table(TIMES, KNEES, hold=True)]).elements[0].mechanism
    expected, found = (matrices_of(each).mass_matrix for each in (mechanism, begun(mechanism)))
    np.testing.assert_array_equal(found, expected)
