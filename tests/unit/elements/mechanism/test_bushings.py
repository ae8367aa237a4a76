"""Bushings: what a file may say, their energy and momentum, closed forms, an independent solver, and their limit."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from one_body_scenes import refusal
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from proofroll.core.errors import Diverged
from proofroll.elements.mechanism import Body, Joint, Mechanism, Tree
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.dynamics.point_loads import point_loads
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.bushing import Bushing
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.truth.bodies.maximal_equations import FUNCTIONS
from proofroll.truth.plug_in import MechanismTruth
from proofroll.truth.switching.bushing_scalars import bushing_load

ROUND = ((0.1, 0, 0), (0, 0.2, 0), (0, 0, 0.25))
TIMES = np.linspace(0.0, 1.0, 6)
MOUNT = '[[bushings]]\nname = "mount"\nbody_a = "world"\nbody_b = "b"\n'


def moved(mechanism: Mechanism) -> tuple[Placed, float]:
    """Motion of the truth, and its error bar of places [m]."""
    content: Any = MechanismTruth.truth(MechanismElement(mechanism), TIMES, ())
    parts = (content[name].to_numpy() for name in ("p_WB", "v_WB", "w_WB", "q_WB"))
    return Placed(mechanism, TIMES, *parts), float(content["p_WB"].attrs["error_bar"])


def mounted(bushing: Bushing, **start: Any) -> Mechanism:
    """A free body of 2 kg with its centre of mass at its origin, on a bushing, without gravity."""
    joint = Joint("j", "free", "world", "b", **start)
    return Mechanism((Body("b", 2.0, inertia=ROUND),), (joint,), gravity=(0, 0, 0), bushings=(bushing,))


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ("stiffness = [1, 2, 3]", "bushings.0.stiffness"),
        ("stiffness = [1, 2, 3, 4, 5, -6]", "must be at least 0"),
        ('body_b = "c"', "there is no such body"),
        ('body_b = "world"', "these are the same"),
        ("stifness = [1, 2, 3, 4, 5, 6]", "bushings.0.stifness"),
        ('stiffness = ["3 N/m", 0, 0, 0, 0, "2 N/m"]', "bushings.0.stiffness"),
    ],
)
def test_a_wrong_bushing_gets_one_line(tmp_path: Path, lines: str, words: str) -> None:
    """A wrong bushing is refused by one line that names its field."""
    mount = MOUNT.replace('body_b = "b"\n', "") if lines.startswith("body_b") else MOUNT
    assert words in refusal(tmp_path, "free", mount + lines)


@pytest.mark.drill
def test_a_bushing_about_a_principal_axis_is_a_torsion_spring() -> None:
    """About one axis the moment is k times the angle, up to 2 rad: with a damper the oscillator of the textbook."""
    k, c, inertia, angle = 3.0, 0.1, ROUND[2][2], 2.0
    bushing = Bushing("m", "world", "b", stiffness=(0, 0, 0, 0, 0, k), damping=(0, 0, 0, 0, 0, c))
    q0 = (0, 0, 0, np.cos(angle / 2), 0, 0, np.sin(angle / 2))
    placed, bar = moved(mounted(bushing, q0=q0))
    decay = c / (2 * inertia)
    rate = np.sqrt(k / inertia - decay**2)
    exact = angle * np.exp(-decay * TIMES) * (np.cos(rate * TIMES) + decay / rate * np.sin(rate * TIMES))
    found = Rotation.from_matrix(placed.R_WB[:, 0]).as_rotvec()
    assert bar < 1e-12
    assert np.max(np.abs(found[:, 2] - exact)) < 1e-12


@pytest.mark.drill
def test_two_bodies_on_a_bushing_keep_energy_and_momentum() -> None:
    """An undamped bushing between free bodies keeps energy, momentum and moment of momentum in both routes."""
    bodies = (Body("a", 2.0, (0.1, 0, 0.05), ROUND), Body("b", 1.5, (0, 0.1, 0), ROUND))
    joints = (
        Joint("ja", "free", "world", "a", v0=(0.1, 0.2, -0.3, 1, 0.5, -0.4)),
        Joint("jb", "free", "world", "b", q0=(0.5, 0.2, 0.1, 0.9, 0.1, 0.2, 0.3), v0=(0, 0, 0.5, 0.3, 0.2, 0.1)),
    )
    bushing = Bushing(
        "m", "a", "b", (0.2, 0.1, 0), (-0.2, 0.1, 0.1), (0.1, 0.2, 0.3), (0.3, -0.2, 0.1), (30, 50, 80, 3, 5, 8)
    )
    placed, bar = moved(Mechanism(bodies, joints, gravity=(0, 0, 0), bushings=(bushing,)))
    assert bar < 1e-12
    for part in (placed.energy(), *placed.momentum()):
        assert np.max(np.abs(part - part[0])) < 1e-12


@pytest.mark.nightly
def test_an_independent_solver_agrees() -> None:
    """Newton's and Euler's equations with differences of the energy of the rotation vector give the same motion."""
    k, c = np.array([20.0, 30, 40, 2, 3, 5]), np.array([1.0, 2, 3, 0.1, 0.2, 0.3])
    frame = Rotation.from_euler("xyz", (0.4, -0.3, 0.8))
    angles = tuple(float(x) for x in frame.as_euler("xyz"))
    bushing = Bushing(
        "m", "world", "b", orientation_a=angles, orientation_b=angles, stiffness=tuple(k), damping=tuple(c)
    )
    w0 = np.array([0.5, -0.2, 0.4])
    mechanism = mounted(bushing, q0=(0.1, -0.2, 0.05, 0.8, 0.3, -0.2, 0.4), v0=(0, 0, 0, *w0))
    step, inertia = 1e-4, np.diag(ROUND)

    def energy(turn: Array, R: Rotation) -> float:
        theta = (frame.inv() * Rotation.from_rotvec(turn) * R * frame).as_rotvec()
        return float(0.5 * np.sum(k[3:] * theta**2))

    def rate(_: float, y: Array) -> Array:
        p, v, w, R = y[:3], y[3:6], y[6:9], Rotation.from_quat(y[9:], scalar_first=True)
        force = -frame.apply(k[:3] * frame.inv().apply(p) + c[:3] * frame.inv().apply(v))
        ways = step * np.eye(3)
        slope = np.array(
            [
                (8 * (energy(way, R) - energy(-way, R)) - energy(2 * way, R) + energy(-2 * way, R)) / (12 * step)
                for way in ways
            ]
        )
        moment = -slope - frame.apply(c[3:] * frame.inv().apply(R.apply(w)))
        acceleration = (R.inv().apply(moment) - np.cross(w, inertia * w)) / inertia
        turning = 0.5 * np.array([-y[10:] @ w, *(y[9] * w + np.cross(y[10:], w))])
        return np.concatenate([v, force / 2.0, acceleration, turning])

    q0 = np.array(mechanism.joints[0].q0)
    start = np.concatenate([q0[:3], np.zeros(3), w0, q0[3:]])
    solved = solve_ivp(rate, (0, 1), start, t_eval=TIMES, rtol=1e-9, atol=1e-10)
    placed, _ = moved(mechanism)
    assert np.max(np.abs(placed.p_WB[:, 0] - solved.y[:3].T)) < 1e-7
    turned = Rotation.from_quat(solved.y[9:].T, scalar_first=True).as_matrix()
    assert np.max(np.abs(placed.R_WB[:, 0] - turned)) < 1e-7


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-3, 0.029, 0.031, 1.0, 2.9])
def test_both_routes_have_the_same_moment(angle: float) -> None:
    """The moment by functions of angles and that by roots and series agree, from no rotation to the largest."""
    R = Rotation.from_rotvec(angle * np.array([2.0, -1, 2]) / 3).as_matrix()
    bushing = Bushing("m", "world", "b", orientation_a=(0.1, 0.2, 0.3), orientation_b=(0.1, 0.2, 0.3),
                      stiffness=(0, 0, 0, 1, 2, 7))  # fmt: skip
    none = np.zeros(3)
    _, expected = bushing.load(np.eye(3), R, none, none, none, none)
    _, found = bushing_load(bushing, np.eye(3).tolist(), R.tolist(), ([0.0] * 3,) * 4, FUNCTIONS)
    assert np.max(np.abs(expected - np.array(found))) < 1e-12


def test_half_a_turn_has_no_rotation_vector() -> None:
    """A bushing that turns by more than 3 rad is refused where it does, with what to do."""
    bushing = Bushing("m", "world", "b", stiffness=(0, 0, 0, 1, 1, 1))
    mechanism = mounted(bushing, q0=(0, 0, 0, np.cos(1.55), 0, 0, np.sin(1.55)))
    motion = Tree(mechanism).at(*mechanism.start())
    with pytest.raises(Diverged, match=r"m turns by more than 3 rad.*give a joint the spring"):
        list(point_loads(mechanism, motion, 0.0))
