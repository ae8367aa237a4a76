"""The projections themselves, held against the explicit matrices of Blajer (2006) and against other surfaces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import proofroll
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.ball.cylinder import UprightCylinder
from proofroll.papers.blajer_2006.ball.rolling_equations import reduced_rates
from proofroll.papers.blajer_2006.projection.geometry import Uniform, matrix
from proofroll.papers.blajer_2006.projection.method import ProjectedBall
from proofroll.papers.blajer_2006.projection.orientation import EulerAngles, RotatingFrame

BODY = rolling_ball(proofroll.load_scene("sphere_in_cylinder", rolling_resistance=5e-4))
A, C, M, J = BODY.ball.radius, BODY.surface.radius, BODY.ball.mass, BODY.ball.inertia
SEEDS = pytest.mark.parametrize("seed", range(5))


def random_state(seed):
    """Any q = [γ z φ θ ψ], not near the singularity, and any q̇, which need not roll."""
    rng = np.random.default_rng(seed)
    q = np.array([*rng.uniform(-9, 9, 3), rng.uniform(0.4, 2.7), rng.uniform(-9, 9)])
    return np.concatenate([q, rng.uniform(-1, 1, 5) * [20, 1, 160, 160, 160]])


def euler_ball(body=BODY):
    """The equations in Euler angles."""
    return ProjectedBall(body, Uniform(body.surface), EulerAngles())


def close(found, expected):
    """Equal to the round-off of some thousand operations on the largest entry."""
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11 * max(1.0, np.max(np.abs(expected))))


def papers_rows(x):
    """C_nh of the paper: the slip cγ̇ + aω3 and ż - aω2 of the contact point, by the rates of γ, z, φ, θ, ψ."""
    gamma, _, _, theta, psi = x[:5]
    across = [-np.sin(theta) * np.cos(psi - gamma), np.sin(psi - gamma), 0]  # ω2 by φ̇, θ̇, ψ̇
    return np.array([[C, 0, A * np.cos(theta), 0, A], [0, 1, *(-A * w for w in across)]])


def papers_equations(x, response):
    """M̄ q̈ + d̄ - h̄ - C_nhᵀ F of the paper, with M̄ = diag(mc², m) ⊕ J [[1,0,cosθ],[0,1,0],[cosθ,0,1]]."""
    sin, cos, (gamma_rate, z_rate, phi, theta, psi) = np.sin(x[3]), np.cos(x[3]), x[5:]
    mass = np.zeros((5, 5))
    mass[:2, :2] = np.diag([M * C**2, M])
    mass[2:, 2:] = J * np.array([[1, 0, cos], [0, 1, 0], [cos, 0, 1]])
    bias = J * sin * np.array([0, 0, -theta * psi, phi * psi, -phi * theta])
    v2, v3 = C * gamma_rate, z_rate
    lever = M * C * gamma_rate**2 * BODY.contact.rolling_resistance / np.hypot(v2, v3)
    rows = papers_rows(x) / A
    turned = (rows[0, 2:], -rows[1, 2:])  # ω3 and ω2 by φ̇, θ̇, ψ̇
    force = np.array([0, -M * 9.81, *(lever * (v2 * turned[0] - v3 * turned[1]))])
    return mass @ response.acceleration + bias - force - papers_rows(x).T @ [response.F2, response.F3]


@SEEDS
def test_equations_are_the_papers(seed):
    """M̄ q̈ + d̄ = h̄ + C_nhᵀ F, and C_nh q̈ + Ċ_nh q̇ = 0, by differences of the paper's rows."""
    x, ball = random_state(seed), euler_ball()
    response = ball.response(ball.kinematics(x))
    close(papers_equations(x, response), np.zeros(5))
    h = 1e-6  # differences of slips of some 10 m/s lose 1e-16 * 10 / 1e-6 and neglect 160² h² of the rate
    moved = (np.concatenate([x[:5] + step * x[5:], x[5:]]) for step in (h, -h))
    ahead, behind = (papers_rows(y) @ y[5:] for y in moved)
    turned = (ahead - behind) / (2 * h)
    found = papers_rows(x) @ response.acceleration + turned
    np.testing.assert_allclose(found, 0.0, rtol=0, atol=1e-6 * np.max(np.abs(turned)))


@SEEDS
def test_normal_force_is_the_papers(seed):
    """The orthogonal projection gives N = m c γ̇², whether or not the ball rolls."""
    x = random_state(seed)
    close(euler_ball().response(euler_ball().kinematics(x)).N, M * C * x[5] ** 2)


@SEEDS
def test_slip_is_the_papers(seed):
    """The slip is cγ̇ + aω3 and ż - aω2 with the paper's ω2 and ω3 in Euler angles."""
    x = random_state(seed)
    ball = euler_ball()
    close(ball.slip(ball.kinematics(x)), papers_rows(x) @ x[5:])


@SEEDS
def test_resistance_is_the_papers(seed):
    """M_C = (-N f ż/V, N f cγ̇/V) along e2 and e3."""
    x = random_state(seed)
    v2, v3, f = C * x[5], x[6], 5e-4
    found = euler_ball().resistance(euler_ball().kinematics(x), 7.0)
    close(found, 7.0 * f / np.hypot(v2, v3) * np.array([-v3, v2]))


@SEEDS
def test_explicit_constraint_satisfies_the_implicit_one(seed):
    """C_h D = 0, with C_h from the signed distance and D from the parametrisation."""
    x = random_state(seed)
    kin = euler_ball().kinematics(x)
    normal = BODY.surface.normal(BODY.surface.position(x[:2]))
    assert normal @ matrix(kin.frame) @ kin.v[:3] == pytest.approx(0, abs=1e-13)


@SEEDS
def test_elimination_is_the_mass_orthogonal_projection(seed):
    """What elimination removes is M̄-orthogonal to every admissible velocity, and nothing is left to remove."""
    x, ball = random_state(seed), euler_ball()
    result = ball.eliminated(x)
    cos, rows = np.cos(x[3]), papers_rows(x)
    mass = np.diag([M * C**2, M, J, J, J])
    mass[2, 4] = mass[4, 2] = J * cos
    admissible = np.linalg.svd(rows)[2][2:]
    close(admissible @ mass @ (result - x)[5:], np.zeros(3))
    close(ball.slip(ball.kinematics(result)), np.zeros(2))
    np.testing.assert_array_equal(result[:5], x[:5])


def test_without_resistance_no_moment_is_modelled(monkeypatch):
    """With f = 0 the model does not contain the moment of rolling resistance at all."""
    monkeypatch.delattr(ProjectedBall, "resistance")
    x = random_state(0)
    free = euler_ball(rolling_ball(proofroll.load_scene("sphere_in_cylinder")))
    assert np.all(np.isfinite(free.rates(x)))
    assert np.all(np.isfinite(free.response(free.kinematics(x)).acceleration))
    with pytest.raises(AttributeError):
        euler_ball().rates(x)
    with pytest.raises(AttributeError):
        euler_ball().response(euler_ball().kinematics(x))


@SEEDS
@pytest.mark.parametrize("orientation", [EulerAngles, RotatingFrame])
@pytest.mark.parametrize("surface", [UprightCylinder("wall", 0.2), UprightCylinder("wall", 0.2, 0.3)])
def test_any_axis_any_orientation(surface, orientation, seed):
    """Wherever the axis points both formulations give what the reduced equations give."""
    rng = np.random.default_rng(seed)
    u, udot, spin = rng.uniform(-2, 2, 2), rng.uniform(-5, 5, 2), rng.uniform(-50, 50)
    body = replace(BODY, surface=surface)
    rates, v, force = reduced_rates(body, np.array([*u, *udot, spin]))
    frame = surface.frame(u)
    w = spin * frame[:, 0] - np.cross(frame[:, 0], v) / A
    describe = orientation()
    angles, r = describe.start(frame, frame.T @ w)
    ball = ProjectedBall(body, Uniform(surface), describe)
    kin = ball.kinematics(np.array([*u, *angles, *udot, *r]))
    response = ball.response(kin)
    np.testing.assert_allclose(response.acceleration[:2], rates[2:4], rtol=1e-11, atol=1e-10)
    np.testing.assert_allclose(frame @ ball.contact_force(response), force, rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("u", [(0.0, 0.0), (40.0, -3.0)])
@pytest.mark.parametrize("surface", [UprightCylinder("wall", 0.2), UprightCylinder("wall", 0.2, 0.3)])
def test_the_frame_is_that_of_the_surface(surface, u):
    """The frame at a place is the one at the start, turned about the axis."""
    close(matrix(Uniform(surface).at(u)), surface.frame(u))
