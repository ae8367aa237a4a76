from dataclasses import replace

import mechanism_examples as examples
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from proofroll.elements.mechanism import Tree
from proofroll.elements.mechanism.dynamics.placed import Placed

STEP = 1e-6  # of central differences: their error, STEP² and round-off over STEP, stays below 1e-8


@pytest.fixture(scope="module")
def tree():
    """Kinematics of a mechanism with every kind of joint."""
    return Tree(examples.every_kind())


def nearby(tree, q, v, acceleration, step):
    """Coordinates and velocities a short time later, accurate to second order."""
    middle = tree.normalised(q + step / 2 * tree.rate(q, v))
    return tree.normalised(q + step * tree.rate(middle, v + step / 2 * acceleration)), v + step * acceleration


def test_velocities_are_the_rates_of_positions(tree):
    """The velocity and angular velocity of each body are the central differences of its pose."""
    q, v = tree.mechanism.start()
    motion = tree.at(q, v)
    before, after = (tree.at(*nearby(tree, q, v, np.zeros_like(v), h)) for h in (-STEP, STEP))
    assert np.abs((after.p_WB - before.p_WB) / (2 * STEP) - motion.v_WB).max() < 1e-8
    for i in range(len(motion.w_WB)):
        turning = (after.R_WB[i] - before.R_WB[i]) / (2 * STEP) @ motion.R_WB[i].T
        w = np.array([turning[2, 1], turning[0, 2], turning[1, 0]])
        assert np.abs(w - motion.w_WB[i]).max() < 1e-8


def test_poses_tell_the_coordinates_of_every_kind_of_joint():
    """Coordinates and velocities come back from the poses of the bodies, of which no quaternion's sign is known."""
    tree = examples.every_kind()
    of_free, of_revolute, *others = tree.joints
    of_free = replace(of_free, position=(0.3, -0.2, 0.5), orientation=(0.4, 0.5, -0.6), child_position=(0.1, 0.2, 0.3))
    of_revolute = replace(of_revolute, q0=(7.5,))  # more than a turn
    mechanism = replace(tree, joints=(of_free, of_revolute, *others), loops=())
    q, v = mechanism.start()
    motion, count = Tree(mechanism).at(q, v), len(mechanism.bodies)
    signs = np.where(np.arange(count) % 2, 1.0, -1.0)[:, None]
    attitudes = signs * Rotation.from_matrix(motion.R_WB[:count]).as_quat(scalar_first=True)
    vectors = (vector[None, :count] for vector in (motion.p_WB, motion.v_WB, motion.w_WB))
    found = Placed(mechanism, np.zeros(1), *vectors, attitudes[None]).of_tree()
    assert found[0][0] == pytest.approx(q, abs=1e-13)
    assert found[1][0] == pytest.approx(v, abs=1e-13)


def test_accelerations_are_the_rates_of_velocities(tree):
    """J v̇ plus the bias is the central difference of the velocities of all bodies."""
    q, v = tree.mechanism.start()
    acceleration = np.linspace(-1, 1, len(v))
    motion = tree.at(q, v)
    twists = [
        np.concatenate([m.v_WB, m.w_WB], axis=1)
        for m in (tree.at(*nearby(tree, q, v, acceleration, h)) for h in (-STEP, STEP))
    ]
    expected = (twists[1] - twists[0]) / (2 * STEP)
    assert np.abs(motion.J @ acceleration + motion.bias - expected).max() < 1e-7


def test_rows_of_loops_are_derivatives_of_their_residuals(tree):
    """C v is the rate of Φ and C v̇ + bias its second derivative, for every kind of loop."""
    q, v = tree.mechanism.start()
    acceleration = np.linspace(1, -1, len(v))
    rows = tree.loop_rows(tree.at(q, v))
    before, after = (tree.loop_rows(tree.at(*nearby(tree, q, v, acceleration, h))) for h in (-STEP, STEP))
    speeds = [r.C @ (v + h * acceleration) for r, h in ((before, -STEP), (after, STEP))]
    assert np.abs((after.residual - before.residual) / (2 * STEP) - rows.C @ v).max() < 1e-8
    assert np.abs((speeds[1] - speeds[0]) / (2 * STEP) - rows.C @ acceleration - rows.bias).max() < 1e-7
    kinds = [tree.mechanism.loops[i].kind for i in rows.loop]
    every = ("revolute", "prismatic", "cylindrical", "universal", "spherical", "planar", "fixed")
    assert [kinds.count(k) for k in every] == [
        5,
        5,
        4,
        4,
        3,
        3,
        6,
    ]


def test_joint_frames_coincide_at_zero():
    """At q = 0 both frames of every joint have the same axes and the same origin."""
    mechanism = examples.every_kind()
    tree = Tree(mechanism)
    q = np.zeros(mechanism.nq)
    for joint, at in zip(mechanism.joints, mechanism.q_slices, strict=True):
        if joint.kind in {"free", "spherical"}:
            q[at.stop - 4] = 1.0
    motion = tree.at(q, np.zeros(mechanism.nv))
    for k, joint in enumerate(mechanism.joints):
        i = mechanism.body_index[joint.parent]
        R_child = motion.R_WB[mechanism.body_index[joint.child]] @ joint.child_frame
        assert np.abs(motion.R_parent[k] - R_child).max() < 1e-15
        assert motion.p_joint[k] == pytest.approx(motion.p_WB[i] + motion.R_WB[i] @ joint.position, abs=1e-14)
