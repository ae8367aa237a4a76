"""A pair that never slips: engines with a cone take a large coefficient, projection takes none; others say why not."""

from __future__ import annotations

import math

import numpy as np
import pytest

import proofroll
from proofroll.core.errors import InputError, NotUnique, Refused
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.contact.coulomb import contact_forces
from proofroll.elements.mechanism.contact.start import check_contacts
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.truth.bodies.body_impacts import impulse_of_a_contact


def on_plane(
    *, speed: float = 0.2, slip: float = 0.0, com: float = 0.0, gap: float = 0.0, restitution: float = 0.0
) -> Mechanism:
    """A sphere on a sloping plane without bound on its friction, rolling across it but for a slip [m/s]."""
    inertia = 0.4 * 0.5 * 0.1**2
    shapes = (
        Geometry("s", "ball", "sphere", radius=0.1),
        Geometry("floor", "world", "plane", normal=(0.28, 0.0, 0.96)),
    )
    at = [0.28 * (0.1 + gap), 0.0, 0.96 * (0.1 + gap)]
    joint = Joint(
        "j", "free", "world", "ball", q0=(*at, 1, 0, 0, 0), v0=(0, speed + slip, 0, -9.6 * speed, 0, 2.8 * speed)
    )
    body = Body("ball", 0.5, com=(com, 0.0, 0.0), inertia=(inertia, inertia, inertia))
    pairs = (Pair("contact", ("s", "floor"), math.inf, restitution),)
    return Mechanism((body,), (joint,), geometries=shapes, pairs=pairs)


@pytest.mark.parametrize(
    ("engine", "largest"),
    [
        ("projection[formulation=dependent]", 1e-10),
        ("pinocchio[formulation=impulses,dt=1e-4]", 1e-3),
        ("mujoco[formulation=geoms,cone=elliptic,dt=1e-4,time_constant=2]", 1e-3),
        ("exudyn[formulation=spheres]", 1e-5),
    ],
)
def test_a_ball_that_never_slips_rolls_down_any_slope(engine: str, largest: float) -> None:
    """Its path is the truth's within the engine's own errors; its model passes the certificate."""
    scene = _scene(on_plane())
    found = proofroll.judge(proofroll.simulate(scene, engine, until=0.1, every=0.05), scene)
    assert found.agrees, str(found)
    (place,) = [item.judgement for item in found.compared if item.judgement.observable == "positions"]
    assert place.error < largest


@pytest.mark.parametrize(
    ("engine", "why"),
    [
        ("exudyn[formulation=discs]", "contact is not of a circle and a plane"),
        ("mujoco[formulation=geoms,cone=pyramidal]", "cone=pyramidal with friction above 1 makes a contact soft"),
    ],
)
def test_who_needs_a_number_says_so(engine: str, why: str) -> None:
    """Refused, with the reason."""
    with pytest.raises(Refused, match=why):
        proofroll.simulate(_scene(on_plane()), engine, until=0.01)


def test_a_pair_that_never_slips_starts_without_slip() -> None:
    """A start that slips is refused with its pair, its slip and what to do."""
    with pytest.raises(InputError, match=r"pairs\.contact\.friction = inf: they touch and slip at 1 m/s, which .* v0"):
        check_contacts(on_plane(slip=1.0))


def test_an_impact_stops_all_slip() -> None:
    """A ball leaves an impact without slip, with its normal speed times its restitution."""
    fall, n = 9.81 * 0.96, np.array([0.28, 0.0, 0.96])
    hit = math.sqrt(2 * 0.05 / fall)
    found = truth(_scene(on_plane(slip=1.0, gap=0.05, restitution=0.5)), [0.0, 0.15])
    v, w = (found[name].to_numpy()[-1].ravel() for name in ("v_WB", "w_WB"))
    slip = v - np.cross(w, 0.1 * n) - (0.15 - hit) * np.array([0.0, 0.0, -9.81])
    assert slip == pytest.approx(0.5 * fall * hit * n, abs=1e-12)


def test_friction_without_bound_that_would_tear_is_not_unique() -> None:
    """A contact that only a pull could hold has no force, in forces and in impulses."""
    G, c = np.array([[1.0, -0.9, 0.0], [-0.9, 1.0, 0.0], [0.0, 0.0, 1.0]]), np.array([-1.0, 2.0, 0.0])
    with pytest.raises(NotUnique, match="tip would not press but tear"):
        contact_forces(G, c, np.array([math.inf]), [None], ["tip"])
    assert impulse_of_a_contact(G, c, math.inf, 0.0) is None


def _scene(mechanism: Mechanism) -> Scene:
    return Scene("steep", "", (MechanismElement(mechanism),))
