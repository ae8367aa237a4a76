"""Cables: distances that go slack; what a file may say, closed forms of taut and slack motion, engines."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from one_body_scenes import one_body, refusal
from scipy.integrate import solve_ivp

from proofroll.core.events import events_of
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.composed import Cable
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate
from proofroll.truth.plug_in import MechanismTruth

CABLE = '[[loops]]\nname = "k"\nkind = "distance"\nbody_a = "world"\nbody_b = "b"\n'
FALL = '[[forces]]\nname = "w"\nbody = "b"\nkind = "force"\nvalue = [0, 0, -9.81]\n'
G, SPEED = 9.81, 6.0
SWING = f"q0 = [0, 0, -1, 1, 0, 0, 0]\nv0 = [{SPEED}, 0, 0, 0, 0, 0]\n{FALL}{CABLE}at_most = 1\n"


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ("at_most = 0", "loops.k.at_most"),
        ("at_most = -1", "loops.k.at_most"),
        ("at_most = 1\nlength = 1", "loops.0.length"),
        ("at_most = 1\nrestitution = 2", "loops.k.restitution"),
        ("at_most = 1\nposition_a = [0, 0, 2]", "loops.k.at_most = 1.0: its ends are farther apart"),
        ("restitution = 0.5", "loops.0.restitution"),
    ],
)
def test_a_wrong_cable_gets_one_line(tmp_path: Path, lines: str, words: str) -> None:
    """A wrong cable is refused by one line that names the field of the file."""
    assert words in refusal(tmp_path, "free", CABLE + lines)


def slack_and_taut() -> tuple[float, float, float]:
    """Times at which the pendulum of :data:`SWING` goes slack and taut [s]; energy when it swings again [J/kg]."""

    def slack(_: float, y: Any) -> float:
        return float(y[1] ** 2 + G * np.cos(y[0]))

    slack.terminal = True  # type: ignore[attr-defined]  # as solve_ivp asks
    swing = solve_ivp(lambda _, y: (y[1], -G * np.sin(y[0])), (0, 2), (0.0, SPEED), "DOP853", events=slack,
                      rtol=1e-13, atol=1e-14)  # fmt: skip
    angle, rate = swing.y[:, -1]
    assert np.cos(angle) == pytest.approx((2 * G - SPEED**2) / (3 * G), abs=1e-11)
    p, v = np.array([np.sin(angle), -np.cos(angle)]), rate * np.array([np.cos(angle), np.sin(angle)])
    fall = np.array([0.0, -G])
    roots = np.roots([fall @ fall / 4, v @ fall, v @ v + p @ fall, 2 * p @ v, p @ p - 1])
    flight = max(float(root.real) for root in roots if abs(root.imag) < 1e-9)
    end, speed = p + v * flight + fall * flight**2 / 2, v + fall * flight
    along = float(speed @ [-end[1], end[0]])
    return float(swing.t[-1]), float(swing.t[-1]) + flight, along**2 / 2 + G * float(end[1])


@pytest.mark.drill
def test_a_pendulum_on_a_cable_goes_slack(tmp_path: Path) -> None:
    """It leaves the circle where the tension ends, flies on a parabola, and loses its speed along the cable."""
    element = MechanismElement(one_body(tmp_path, "free", SWING))
    content: Any = MechanismTruth.truth(element, np.linspace(0, 1.4, 15), ())
    slack, taut, energy = slack_and_taut()
    events = [(event.kind, event.time) for event in events_of(content)]
    assert [kind for kind, _ in events] == ["lift_off", "impact"]
    assert [time for _, time in events] == pytest.approx([slack, taut], abs=1e-10)
    place, velocity = (content[name].to_numpy()[-1, 0] for name in ("p_WB", "v_WB"))
    assert velocity @ velocity / 2 + G * place[2] == pytest.approx(energy, abs=1e-9)
    assert content["p_WB"].attrs["error_bar"] < 1e-12
    assert content["force.k.z"].to_numpy()[0] == pytest.approx(SPEED**2 + G, abs=1e-11)


@pytest.mark.nightly
def test_a_mass_is_caught_and_thrown_back(tmp_path: Path) -> None:
    """A mass that falls into a cable comes back with its restitution, and hangs by its weight in the end."""
    fall, restitution = 0.5, 0.4
    more = f"{FALL}{CABLE}at_most = {fall}\nrestitution = {restitution}\n"
    content: Any = MechanismTruth.truth(MechanismElement(one_body(tmp_path, "free", more)), np.linspace(0, 1, 11), ())
    drop = np.sqrt(2 * fall / G)
    impacts = [event.time for event in events_of(content) if event.kind == "impact"]
    assert impacts[:2] == pytest.approx([drop, drop * (1 + 2 * restitution)], abs=1e-11)
    rest = drop * (1 + restitution) / (1 - restitution)
    assert rest < 1
    assert next(event.time for event in events_of(content) if event.kind == "settle") == pytest.approx(rest, abs=1e-6)
    assert content["force.k.z"].to_numpy()[-1] == pytest.approx(G, abs=1e-11)
    assert content["p_WB"].to_numpy()[-1, 0, 2] == pytest.approx(-fall, abs=1e-12)


@pytest.mark.drill
def test_a_cable_between_bodies_keeps_momentum() -> None:
    """Two bodies that part go on together where a cable between them goes taut, along its line."""
    bodies = tuple(
        Body(name, mass, inertia=((1, 0, 0), (0, 1, 0), (0, 0, 1))) for name, mass in (("a", 1.0), ("b", 3.0))
    )
    joints = (
        Joint("ja", "free", "world", "a", v0=(-1.0, 0, 0, 0.3, 0.2, 0.1)),
        Joint("jb", "free", "world", "b", q0=(0.5, 0, 0, 1, 0, 0, 0), v0=(1.0, 0.0, 0, 0, 0, 0.4)),
    )
    parts: Any = Cable("k", "a", "b", 1.0, restitution=0.5).parts()
    mechanism = Mechanism(bodies, joints, gravity=(0, 0, 0), geometries=parts["geometries"], pairs=parts["pairs"])
    content: Any = MechanismTruth.truth(MechanismElement(mechanism), np.linspace(0, 0.5, 6), ())
    (event,) = [event for event in events_of(content) if event.kind == "impact"]
    assert event.time == pytest.approx(0.25, abs=1e-12)  # 0.5 m at 2 m/s
    speeds = content["v_WB"].to_numpy()[-1, :, 0]
    assert speeds == pytest.approx([0.5 + 0.75, 0.5 - 0.25], abs=1e-12)  # they part at -1 m/s, of 2 m/s before


@pytest.mark.one_in(3)
@pytest.mark.drill
@pytest.mark.parametrize(
    ("engine", "slack_after", "reason"),
    [
        ("pinocchio", 1e-4, ""),
        ("projection", 1e-4, ""),
        ("mujoco", 0.2, ""),  # m; its softness returns up to a quarter of the 5 m/s of the jerk, for 0.14 s
        ("exudyn", 0.0, "ends of cables"),
    ],
)
def test_engines_follow_a_cable_or_refuse_it(tmp_path: Path, engine: str, slack_after: float, reason: str) -> None:
    """Pinocchio, MuJoCo and the projection solver follow a cable that goes slack and taut; others say why not."""
    one_body(tmp_path, "free", SWING)
    scene = load_scene(str(tmp_path))
    if reason:
        with pytest.raises(Exception, match=reason):
            simulate(scene, engine, until=0.1)
        return
    slack, taut, _ = slack_and_taut()
    run = simulate(scene, engine, until=1.4, every=0.01)
    gap = run["gap.k"].to_numpy()
    flies = (run["time"].to_numpy() > slack + 0.05) & (run["time"].to_numpy() < taut - 0.01)
    assert gap[flies].min() > 1e-4
    assert np.abs(gap[run["time"].to_numpy() > taut + 0.01]).max() < slack_after
