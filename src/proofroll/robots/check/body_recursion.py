"""Second formulation: recursive Newton-Euler on spatial vectors in body axes, rotation first.

M comes column by column. Source: Featherstone, Rigid Body Dynamics Algorithms, 2008, chapters 5 and 6.
"""

import numpy as np

from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.rotations import from_rotation_vector, skews
from proofroll.robots.check.two_formulations import Dynamics, Frames, armature, turned_armature
from proofroll.robots.model import NO_BODY, Array, Robot, RobotBody, RobotJoint
from proofroll.robots.states import RobotStates


def body_recursion(robot: Robot, states: RobotStates) -> Dynamics:
    """Terms of the equation of motion by recursive Newton-Euler in body axes (formulation B)."""
    count, n = states.count, robot.dofs
    v = states.stacked(states.velocity, robot)[:, None]
    rest = np.zeros((count, 1, n))
    units = np.broadcast_to(np.eye(n), (count, n, n))
    M = newton_euler(robot, states, np.zeros((count, n, n)), units, np.zeros(3))
    g = newton_euler(robot, states, rest, rest, robot.gravity)[:, 0]
    h = newton_euler(robot, states, v, rest, robot.gravity)[:, 0]
    return Dynamics(M + np.diag(armature(robot)), g, h + turned_armature(robot, v[:, 0]))


def newton_euler(robot: Robot, states: RobotStates, v: Array, a: Array, gravity: Array) -> Array:
    """Joint torques [N m or N] for velocities and accelerations, each of shape (states, any, n); without armature."""
    start = np.zeros((*v.shape[:2], 6))
    falling = start.copy()
    falling[..., 3:] = -gravity
    velocity, acceleration, force = {NO_BODY: start}, {NO_BODY: falling}, {}
    X, S = {}, {}
    for joint in robot.joints:
        r, R = within(joint, states)
        E = R.transpose(0, 2, 1)
        X[joint.child] = np.block([[E, np.zeros_like(E)], [-E @ skews(r), E]])
        velocity[joint.child] = velocity[joint.parent] @ X[joint.child].transpose(0, 2, 1)
        acceleration[joint.child] = acceleration[joint.parent] @ X[joint.child].transpose(0, 2, 1)
        if joint.dofs:
            S[joint.child] = _subspace(joint, R)
            columns = robot.columns[joint.name]
            relative = v[..., columns] @ S[joint.child].transpose(0, 2, 1)
            velocity[joint.child] = V = velocity[joint.child] + relative
            acceleration[joint.child] += a[..., columns] @ S[joint.child].transpose(0, 2, 1)
            if joint.kind == JointKind.FREE:  # its velocity has world axes: the derivative of Rᵀ v
                acceleration[joint.child][..., 3:] -= np.cross(V[..., :3], V[..., 3:])
            else:
                acceleration[joint.child] += _cross_motion(V, relative)
        inertia = _spatial(robot.bodies[joint.child])
        V = velocity[joint.child]
        force[joint.child] = acceleration[joint.child] @ inertia + _cross_force(V, V @ inertia)
    torque = np.zeros((*v.shape[:2], robot.dofs))
    for joint in reversed(robot.joints):
        if joint.dofs:
            torque[..., robot.columns[joint.name]] = force[joint.child] @ S[joint.child]
        if joint.parent != NO_BODY:
            force[joint.parent] = force[joint.parent] + force[joint.child] @ X[joint.child]
    return torque


def within(joint: RobotJoint, states: RobotStates) -> tuple[Array, Array]:
    """Position and rotation of the child in its parent's frame, shapes (states, 3) and (states, 3, 3)."""
    count = states.count
    slid = np.zeros((count, 3))
    turned = np.broadcast_to(np.eye(3), (count, 3, 3))
    if joint.kind == JointKind.REVOLUTE:
        turned = from_rotation_vector(states.angle[joint.name][:, None] * joint.axis)
    elif joint.kind == JointKind.PRISMATIC:
        slid = states.angle[joint.name][:, None] * joint.axis
    elif joint.kind == JointKind.SPHERICAL:
        turned = states.rotation[joint.name]
    elif joint.kind == JointKind.FREE:
        return joint.position + states.position[joint.name], states.rotation[joint.name]
    R = joint.rotation @ turned
    return joint.position + slid @ joint.rotation.T - R @ joint.child_position, R


def poses(robot: Robot, states: RobotStates) -> Frames:
    """Position of the origin and rotation of every body in the world, shapes (states, 3) and (states, 3, 3)."""
    placed = {NO_BODY: (np.zeros((states.count, 3)), np.broadcast_to(np.eye(3), (states.count, 3, 3)))}
    for joint in robot.joints:
        p, R = placed[joint.parent]
        r, Q = within(joint, states)
        placed[joint.child] = (p + (R @ r[..., None])[..., 0], R @ Q)
    return placed


def _subspace(joint: RobotJoint, R: Array) -> Array:
    """Joint motion subspace at the child's origin, child axes, angular part first; shape (states, 6, velocities).

    A free joint's velocities are in world axes, linear first.
    """
    zero = np.zeros((3, 3))
    if joint.kind == JointKind.FREE:
        E = R.transpose(0, 2, 1)
        return np.block([[np.zeros_like(E), E], [E, np.zeros_like(E)]])
    if joint.kind == JointKind.PRISMATIC:
        subspace = np.concatenate([np.zeros(3), joint.axis])[:, None]
    else:
        turning = np.vstack([np.eye(3), zero + skews(joint.child_position)])
        subspace = turning if joint.kind == JointKind.SPHERICAL else turning @ joint.axis[:, None]
    return np.broadcast_to(subspace, (len(R), *subspace.shape))


def _spatial(body: RobotBody) -> Array:
    """Spatial inertia at the origin of the body's frame, shape (6, 6)."""
    C = skews(body.com)
    moment = body.mass * C
    return np.block([[body.inertia + moment @ C.T, moment], [moment.T, body.mass * np.eye(3)]])


def _cross_motion(v: Array, u: Array) -> Array:
    return np.concatenate(
        [np.cross(v[..., :3], u[..., :3]), np.cross(v[..., :3], u[..., 3:]) + np.cross(v[..., 3:], u[..., :3])], axis=-1
    )


def _cross_force(v: Array, f: Array) -> Array:
    return np.concatenate(
        [np.cross(v[..., :3], f[..., :3]) + np.cross(v[..., 3:], f[..., 3:]), np.cross(v[..., :3], f[..., 3:])], axis=-1
    )
