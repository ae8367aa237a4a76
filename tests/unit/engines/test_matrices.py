"""Matrices of the equations of motion: those of the tree, by closed form, and of the engines that have them."""

import json
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from proofroll.cli import app
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.dynamics.matrices import matrices_of, velocity_names
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import build


def test_a_double_pendulum_has_the_textbook_matrices() -> None:
    """Mass matrix, velocity terms and weights of two rods on relative angles are those of Lagrange's equations."""
    m, c, inertia, g, (a, b), (u, w) = 1.5, 0.5, 0.2, 9.81, (0.4, 0.9), (1.3, -0.7)
    rods = [Body(name, m, com=(c, 0, 0), inertia=((1, 0, 0), (0, 1, 0), (0, 0, inertia))) for name in ("one", "two")]
    joints = (
        Joint("a", "revolute", "world", "one", q0=(a,), v0=(u,)),
        Joint("b", "revolute", "one", "two", position=(1, 0, 0), q0=(b,), v0=(w,), armature=0.3),
    )
    M, h, weights = matrices_of(Mechanism(tuple(rods), joints, gravity=(0, -g, 0)))
    cos, sin, own = np.cos(b), np.sin(b), inertia + m * c * c
    exact = [[2 * own + m + 2 * m * c * cos, own + m * c * cos], [own + m * c * cos, own + 0.3]]
    np.testing.assert_allclose(M, exact, rtol=1e-14)
    np.testing.assert_allclose(h, [-m * c * sin * (2 * u * w + w * w), m * c * sin * u * u], rtol=1e-13)
    lower = m * g * c * np.cos(a + b)
    np.testing.assert_allclose(weights, [m * g * c * np.cos(a) + m * g * np.cos(a) + lower, lower], rtol=1e-14)


@pytest.mark.parametrize("scene", ["slung_load", "slider_crank", "leg_in_the_air"])
@pytest.mark.parametrize("engine", ["mujoco", "pinocchio"])
def test_engines_have_the_matrices_of_the_tree(scene: str, engine: str) -> None:
    """MuJoCo and Pinocchio give M, h and g of free bodies, ball joints and chains in the tree's velocities."""
    pytest.importorskip(engine)
    loaded: Any = load_scene(scene)
    built = build(loaded, engine).built()
    for name, part in matrices_of(loaded.elements[0].mechanism)._asdict().items():
        assert np.abs(getattr(built, name) - part).max() < 1e-13 * max(1.0, np.abs(part).max()), name


def test_the_matrices_are_those_of_the_equations() -> None:
    """M v' + h + g is what drives and dampers bring, for the accelerations that the equations give."""
    loaded: Any = load_scene("arm_pd")
    mechanism = loaded.elements[0].mechanism
    equations, (q, v) = JointCoordinates(mechanism), mechanism.start()
    M, h, g = matrices_of(mechanism)
    brought = M @ equations.solve(q, v).acceleration + h + g
    efforts = equations.efforts(0.0, q, v)
    np.testing.assert_allclose(
        brought, efforts - np.array([joint.damping for joint in mechanism.joints]) * v, rtol=1e-12
    )


@pytest.mark.drill
def test_a_command_prints_them() -> None:
    """Names of velocities, M, h and g of an engine and their differences from the truth's are one document."""
    answer = CliRunner().invoke(app, ["run", "double_pendulum", "--engine", "pinocchio", "--matrices", "--json"])
    assert answer.exit_code == 0, answer.output
    found = json.loads(answer.output)
    assert set(found) == {"velocities", "M", "h", "g", "differences"}
    loaded: Any = load_scene("double_pendulum")
    assert found["velocities"] == velocity_names(loaded.elements[0].mechanism)
    assert max(found["differences"].values()) < 1e-14
    said = CliRunner().invoke(app, ["run", "double_pendulum", "--engine", "truth", "--matrices"]).output
    assert "velocity" in said
    refused = CliRunner().invoke(app, ["run", "sphere_in_cylinder", "--engine", "truth", "--matrices"])
    assert refused.exit_code != 0
