"""Contacts whose sliding and turning share one cone of friction: against the law itself, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import proofroll
from proofroll.core.dataset import BY_STEPS
from proofroll.core.errors import InputError, Refused
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.truth.truth_of_mechanism import truth_of

RADIUS, MASS, MOMENT, G = 0.05, 0.7, 0.0009, 9.81
LAW = Pair("contact", ("ball", "floor"), 0.3, spinning_friction=5e-3, rolling_resistance=1e-3, cone="shared")
THROWN = (0.8, 0.3, 0.0, 4.0, -20.0, 9.0)


def ball(pair: Pair, velocity: tuple[float, ...] = THROWN) -> Scene:
    """A ball that begins on a plane."""
    shapes = (Geometry("ball", "ball", "sphere", radius=RADIUS), Geometry("floor", "world", "plane"))
    joint = Joint("j", "free", "world", "ball", q0=(0, 0, RADIUS, 1, 0, 0, 0), v0=velocity)
    parts = Mechanism((Body("ball", MASS, inertia=(MOMENT,) * 3),), (joint,), geometries=shapes, pairs=(pair,))
    return Scene("ball", "", (MechanismElement(parts),))


def by_the_law(pair: Pair, until: float) -> NDArray[np.float64]:
    """Velocity and angular velocity of the thrown ball: its friction has most power within the cone."""
    n, arm = np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -RADIUS])
    mu, spinning, rolling = pair.friction, pair.spinning_friction, pair.rolling_resistance

    def rates(_: float, state: NDArray[np.float64]) -> NDArray[np.float64]:
        v, w = state[:3], state[3:]
        slip, spin = v + np.cross(w, arm), n * (n @ w)
        roll = w - spin
        size = np.linalg.norm(np.concatenate([mu * slip, spinning * spin, rolling * roll]))
        F = -MASS * G * mu**2 * slip / size
        M = -MASS * G * (spinning**2 * spin + rolling**2 * roll) / size
        return np.concatenate([F / MASS, (np.cross(arm, F) + M) / MOMENT])

    return np.asarray(solve_ivp(rates, (0.0, until), np.array(THROWN), rtol=1e-11, atol=1e-12).y[:, -1])


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize("rolling", [0.0, 1e-3])
@pytest.mark.parametrize(
    "engine",
    ["pinocchio[formulation=impulses,preset=matched]", "mujoco[formulation=geoms,preset=matched,cone_correction=true]"],
)
def test_a_ball_slips_and_turns_by_the_law_of_one_cone(engine: str, rolling: float) -> None:
    """Its velocities go to those of the law as the step halves, and are far from those of separate bounds."""
    pair, until = replace(LAW, rolling_resistance=rolling), 0.05
    expected, errors = by_the_law(pair, until), []
    for dt in (5e-4, 2.5e-4):
        run = proofroll.simulate(ball(pair), engine, dt=dt, until=until)
        found = np.concatenate([run["v_WB"].values[-1, 0], run["w_WB"].values[-1, 0]])
        errors.append(np.abs(found - expected).max())
    assert errors[1] < 0.6 * errors[0] < 2e-4
    separate = np.array([0.3 * MASS * G * RADIUS / MOMENT, 5e-3 * MASS * G / MOMENT]) * until
    assert abs(expected[5] - THROWN[5]) < 0.5 * separate[1]  # spin alone would lose all of its bound


@pytest.mark.drill
def test_a_box_that_spins_on_its_corners_brakes_by_both() -> None:
    """Four points carry their couple of sliding and their own moments, and stop it sooner than sliding alone."""
    spins = []
    half, inertia = (0.03, 0.02, 0.01), (1e-4, 2e-4, 3e-4)
    for spinning in (1e-5, 2e-2):
        shapes = (Geometry("box", "box", "box", size=tuple(2 * h for h in half)), Geometry("floor", "world", "plane"))
        joint = Joint("j", "free", "world", "box", q0=(0, 0, half[2], 1, 0, 0, 0), v0=(0, 0, 0, 0, 0, 10.0))
        pair = Pair("contact", ("box", "floor"), 0.3, spinning_friction=spinning, cone="shared")
        parts = Mechanism((Body("box", 0.5, inertia=inertia),), (joint,), geometries=shapes, pairs=(pair,))
        scene = Scene("box", "", (MechanismElement(parts),))
        run = proofroll.simulate(scene, "pinocchio[formulation=impulses,preset=matched]", dt=1e-3, until=0.01)
        spins.append(float(run["w_WB"].values[-1, 0, 2]))
    arm = float(np.hypot(*half[:2]))
    lost = 0.01 * 0.5 * G / inertia[2] * np.array([0.3 * arm, np.hypot(0.3 * arm, 2e-2)])
    assert 10.0 - np.array(spins) == pytest.approx(lost, rel=1e-3)


def test_a_reference_by_steps_stands_for_the_truth() -> None:
    """No route of the truth has such a cone, and none takes it for separate bounds."""
    (element,) = ball(LAW).elements
    assert element.requires & {*MechanismCapability} >= {MechanismCapability.SHARED_CONE}
    assert MechanismCapability.TURNING_FRICTION not in element.requires
    with pytest.raises(Refused, match="no route of the truth has one cone of sliding, spinning and rolling friction"):
        truth_of(element.mechanism, np.array([0.0, 0.1]))  # type: ignore[attr-defined]


@pytest.mark.drill
def test_the_reference_of_a_shared_cone_holds_the_law() -> None:
    """Its angular velocity is within the change of its last halving of the law's."""
    found: Any = truth(ball(LAW), np.array([0.0, 0.02]))
    assert found.attrs[BY_STEPS].startswith("pinocchio")
    assert np.abs(found["w_WB"].values[-1].ravel() - by_the_law(LAW, 0.02)[3:]).max() < 1e-3


@pytest.mark.parametrize(
    ("laws", "says"),
    [
        ({"friction": 0.0}, r"pairs\.contact\.friction = 0\.0: a shared cone needs one above 0"),
        ({"spinning_friction": 0.0}, r"pairs\.contact\.spinning_friction = 0\.0: a shared cone needs"),
        ({"friction": np.inf}, "a shared cone needs one above 0, and finite"),
        ({"static_friction": 0.4}, r"pairs\.contact\.static_friction = 0\.4: a shared cone has none"),
        ({"tangential_restitution": 0.5}, "tangential_restitution = 0.5: a shared cone has none"),
        ({"cone": "one"}, r"pairs\.contact\.cone = 'one'"),
    ],
)
def test_laws_that_a_shared_cone_has_not_are_refused(laws: dict[str, Any], says: str) -> None:
    """The line names the field, its value and what helps."""
    with pytest.raises(InputError, match=says):
        replace(LAW, **laws)


@pytest.mark.parametrize("settings", ["solver=pgs", "convex=true"])
def test_pinocchios_own_solvers_are_refused(settings: str) -> None:
    """Blocks solve such cones, and no result is called one of another solver."""
    with pytest.raises(Refused, match="no cone shared by sliding and turning"):
        proofroll.simulate(ball(LAW), f"pinocchio[formulation=impulses,{settings}]", until=0.001)


def test_without_friction_nothing_of_the_cone_is_left() -> None:
    """A pair whose friction is switched off, as hypotheses do, has no moments."""
    off = LAW.with_friction(0.0)
    assert (off.friction, off.spinning_friction, off.rolling_resistance, off.cone) == (0, 0, 0, "separate")
    assert LAW.with_friction(0.2).cone == "shared"
