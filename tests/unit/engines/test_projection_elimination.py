"""Null space of the constraints of a mechanism, found by elimination along its tree and within it that of its loops."""

from dataclasses import replace

import mechanism_examples as examples
import mechanism_runs as runs
import numpy as np
import pytest
import scipy.linalg.lapack

from proofroll.core.errors import Refused
from proofroll.core.heyoka_library import available
from proofroll.core.plugins import load_engine
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.sampling import row_rank
from proofroll.elements.mechanism.scene.drives import Actuator
from proofroll.engines.projection.smooth.connections import Bodies
from proofroll.engines.projection.smooth.dependent import DependentCoordinates
from proofroll.engines.projection.smooth.recursion import Recursion

ROUND_OFF = 1e-12


def tree() -> Mechanism:
    """A joint of every kind, without loops, moving."""
    return replace(examples.every_kind(), loops=())


def basis(equations: DependentCoordinates, bodies: Bodies) -> np.ndarray:
    """D: velocities (v, ω along their own axes) of all bodies for unit velocities of the joints, (6 bodies, nv)."""
    space = equations.tree.space(bodies)
    twists = (equations.tree.moves[:-1, :, None] * space.S).reshape(len(equations.mass), -1, 4, 4)
    pose, inverse = bodies.pose[:-1, None], bodies.inverse[:-1, None]
    v, own = (twists @ pose)[..., :3, 3], (inverse @ twists @ pose)[..., :3, :3]
    w = np.stack([own[..., 2, 1], own[..., 0, 2], own[..., 1, 0]], axis=-1)
    return np.concatenate([v, w], axis=-1).transpose(0, 2, 1).reshape(6 * len(equations.mass), -1)


def test_elimination_along_the_tree_spans_the_null_space_of_the_rows_of_its_joints():
    """C D = 0 for joints of every kind, and D has as many independent columns as C leaves free."""
    equations = DependentCoordinates(tree())
    bodies = equations.bodies(equations.start)
    C, D = equations.constraint_rows(bodies), basis(equations, bodies)
    assert np.abs(C @ D).max() < ROUND_OFF
    assert np.linalg.matrix_rank(D) == D.shape[1] == D.shape[0] - row_rank(C)


def test_sums_over_the_bodies_behind_joints_are_the_projected_mass_matrix():
    """The matrix of the projected equations is DᵀMD of the bodies' own mass matrices."""
    equations = DependentCoordinates(tree())
    bodies = equations.bodies(equations.start)
    D = basis(equations, bodies)
    M = np.zeros((len(D), len(D)))
    for i, (mass, inertia) in enumerate(zip(equations.mass, equations.inertia, strict=True)):
        M[6 * i : 6 * i + 3, 6 * i : 6 * i + 3] = mass * np.eye(3)
        M[6 * i + 3 : 6 * i + 6, 6 * i + 3 : 6 * i + 6] = inertia
    H = equations.tree.space(bodies).H
    np.testing.assert_allclose(H, np.triu(D.T @ M @ D), atol=ROUND_OFF * np.abs(H).max())


@pytest.mark.parametrize(("name", "largest"), [("chain", 0), ("slider_crank", 5 * 3)])
def test_singular_values_are_those_of_loops_alone(name, largest, monkeypatch):
    """Of a tree nothing is decomposed by singular values; of loops the few rows on the velocities of the joints."""
    seen = []
    original = scipy.linalg.lapack.dgesdd

    def watched(matrix, **options):
        seen.append(np.asarray(matrix).size)
        return original(matrix, **options)

    equations = DependentCoordinates(runs.model(name))
    monkeypatch.setattr(scipy.linalg.lapack, "dgesdd", watched)
    equations.eliminated(equations.start + 1e-3 * equations.rates(equations.start))
    assert max(seen, default=0) == largest


def test_the_moment_of_a_body_that_spins_about_a_principal_axis_is_zero_to_the_last_digit():
    """A million radians per second of spin leave nothing in the angular acceleration of a free body."""
    body = Body("b", 1.0, inertia=(0.2, 0.2, 0.3))
    spin = (0.0,) * 5 + (1e6,)
    equations = DependentCoordinates(Mechanism((body,), (Joint("j", "free", "world", "b", v0=spin),)))
    assert not equations.solve(equations.start).angular.any()


def test_places_far_from_the_origin_of_the_world_cost_no_digits():
    """Accelerations a hundred kilometres away are those at home, to the digits that places have there."""
    away = tuple(replace(joint, position=(1e5, 0, 0)) if joint.parent == "world" else joint for joint in tree().joints)
    here, there = (DependentCoordinates(replace(tree(), joints=joints, springs=())) for joints in (tree().joints, away))
    expected, found = (each.solve(each.start) for each in (here, there))
    np.testing.assert_allclose(found.angular, expected.angular, atol=1e-7)
    np.testing.assert_allclose(found.linear, expected.linear, atol=1e-7)


@pytest.mark.parametrize("kind", ["free", "fixed"])
def test_a_tree_may_lock_nothing_or_everything(kind):
    """A body that is free falls, one that is fixed stays, and both say their rows."""
    body = Body("b", 2.0, inertia=(0.2, 0.2, 0.3))
    mechanism = Mechanism((body,), (Joint("j", kind, "world", "b"),))
    run = runs.build("dependent", mechanism)
    run.advance(0.1)
    held = kind == "fixed"
    assert run.built().mobility == (0 if held else 6)
    np.testing.assert_allclose(run.sample().p_WB[0, 2], 0.0 if held else -0.5 * 9.81 * 0.01, atol=ROUND_OFF)
    np.testing.assert_allclose(run.sample().joint_force[0, 2], 2.0 * 9.81 if held else 0.0, atol=1e-11)


def sprung_tree() -> Mechanism:
    """A joint of every kind with dampers and drives, and a spring between two points."""
    laws = {"revolute": {"damping": 0.3, "torque": 0.7}, "prismatic": {"stiffness": 3.0, "rest": 0.2, "torque": 0.5}}
    laws["spherical"] = laws["universal"] = {"damping": 0.4}
    joints = tuple(replace(joint, **laws.get(joint.kind, {})) for joint in tree().joints)
    return replace(tree(), joints=joints)


@pytest.mark.parametrize("violated", [0.0, 1e-3])
def test_elimination_joint_by_joint_is_that_by_sums(violated):
    """Both give the same rates and take away the same violations, in a state that obeys the joints or does not."""
    mechanism = sprung_tree()
    by_sums, one_by_one = DependentCoordinates(mechanism), DependentCoordinates(mechanism, Recursion)
    x = by_sums.start + violated * np.random.default_rng(1).normal(size=len(by_sums.start))
    for name in ("rates", "eliminated"):
        expected, found = (getattr(each, name)(x) for each in (by_sums, one_by_one))
        np.testing.assert_allclose(found, expected, atol=1e-11 * np.abs(expected).max())


@pytest.mark.nightly
@pytest.mark.skipif(not available(), reason="heyoka is not installed")
@pytest.mark.parametrize(
    "mechanism",
    [
        pytest.param(replace(sprung_tree(), bushings=()), id="every kind", marks=pytest.mark.drill),
        pytest.param(runs.model("heavy_top"), id="top"),
    ],
)
def test_compiled_equations_end_where_others_do(mechanism):
    """A run in machine code gives the motion and the reactions of one in numpy."""
    kind = load_engine("projection")
    ends = []
    for preset in ("matched", "tuned"):
        run = kind.build(mechanism, kind.presets["dependent"][preset])
        run.advance(0.02)
        ends.append(run.sample())
    for name in ("p_WB", "v_WB", "joint_force", "joint_torque"):
        expected = getattr(ends[0], name)
        np.testing.assert_allclose(getattr(ends[1], name), expected, atol=1e-9 * (1 + np.abs(expected).max()))


@pytest.mark.parametrize(("name", "reason"), [("four_bar", "loops are not compiled"), ("pendulum", "turned")])
def test_compiled_equations_refuse_what_they_do_not_hold(name, reason):
    """Loops, and springs that count turns, are refused with the reason."""
    mechanism = runs.model(name)
    if name == "pendulum":
        mechanism = replace(mechanism, joints=(replace(mechanism.joints[0], stiffness=1.0),))
    kind = load_engine("projection")
    with pytest.raises(Refused, match=reason):
        kind.build(mechanism, kind.presets["dependent"]["tuned"])


@pytest.mark.parametrize(
    ("law", "effort"),
    [
        ({"kind": "torque", "target": 3.0, "gear": 2.0}, lambda _q, _v: 6.0),
        ({"kind": "velocity", "target": 3.0, "kd": 2.0, "gear": 2.0}, lambda _q, v: 2 * 2 * (3 - 2 * v)),
        ({"kind": "position", "target": 3.0, "kp": 5.0, "kd": 2.0, "gear": 2.0}, lambda q, v: 10 * (3 - 2 * q) - 8 * v),
    ],
)
def test_an_actuator_moves_its_joint(law, effort):
    """The effort is that of its law at the present coordinate and velocity, and accelerates the mass."""
    body = Body("b", 2.0, inertia=(0.2, 0.2, 0.3))
    joint = Joint("j", "prismatic", "world", "b", q0=(0.1,), v0=(0.4,))
    actuator = Actuator("m", "j", **law)
    run = runs.build("dependent", Mechanism((body,), (joint,), gravity=(0.0, 0.0, 0.0), actuators=(actuator,)))
    for _ in range(2):
        sample = run.sample()
        expected = effort(sample.p_WB[0, 2], sample.v_WB[0, 2])
        np.testing.assert_allclose(sample.effort, [expected], rtol=1e-12)
        np.testing.assert_allclose(sample.joint_force[0, 2], expected, rtol=1e-12)
        run.advance(0.1)
