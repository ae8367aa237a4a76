"""Causes that misplace the inertia of links joined by fixed joints."""

import dataclasses

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.robots.hypotheses import RobotEvidence, hypothesis
from proofroll.robots.model import NO_BODY, Array, Robot, RobotBody


def _moments(inertia: Array) -> Array:
    """Principal moments, each at the index of the coordinate axis nearest to its own axis, shape (3,)."""
    from scipy.optimize import linear_sum_assignment  # a tenth of a second, which few checks need

    values, axes = np.linalg.eigh(inertia)
    _, order = linear_sum_assignment(-np.abs(axes))
    return np.asarray(values[order])


@hypothesis({"pybullet": "3.2.7 with URDF_MERGE_FIXED_LINKS"}, "load without URDF_MERGE_FIXED_LINKS")
def merged_at_link_origins(evidence: RobotEvidence) -> Robot:
    """Links at fixed joints are merged by their origins: inertial origins and rotations are dropped.

    Their principal moments are taken about the axes of the whole.
    """
    robot = evidence.robot
    bodies: list[RobotBody] = []
    for home in robot.columns:
        members = [(name, p, R) for name, (carrier, p, R) in robot.welded.items() if carrier == home]
        if len(members) == 1:
            continue
        for name, _, R in members:
            body = robot.bodies[name]
            written = np.array(robot.sources.get(name, {}).get("written", body.inertia))
            inertia = R.T @ np.diag(_moments(written)) @ R  # in the link's frame: diagonal in the axes of the composite
            bodies.append(dataclasses.replace(body, com=np.zeros(3), inertia=inertia))
    return robot.with_bodies(bodies)


# Off-diagonal element at which MuJoCo's Jacobi rotations end; moments that differ by less count as equal.
_SMALL = 1e-12


def _principal(inertia: Array) -> tuple[Array, Array]:
    """Principal moments, descending, shape (3,), and axes as columns, shape (3, 3), chosen as MuJoCo does."""
    axes = np.eye(3)
    for _ in range(500):
        turned = axes.T @ inertia @ axes
        off = {2: (0, 1), 1: (0, 2), 0: (1, 2)}
        about = max(off, key=lambda axis: (abs(turned[off[axis]]), -axis))
        i, j = off[about]
        if abs(turned[i, j]) < _SMALL:
            break
        tau = (turned[j, j] - turned[i, i]) / (2 * turned[i, j])
        tangent = (1 if tau >= 0 else -1) / (abs(tau) + np.hypot(1, tau))
        angle = np.arctan(tangent) * (1 if about == 1 else -1)
        axes = axes @ Rotation.from_rotvec(angle * np.eye(3)[about]).as_matrix()
    moments = np.diag(axes.T @ inertia @ axes).copy()
    for column in (0, 1, 0):
        if moments[column] + _SMALL < moments[column + 1]:
            moments[[column, column + 1]] = moments[[column + 1, column]]
            axes = axes @ Rotation.from_rotvec(np.pi / 2 * np.eye(3)[(column + 2) % 3]).as_matrix()
    return moments, axes


def _misplaced(evidence: RobotEvidence, *, turned: bool) -> Robot:
    """Robot with misplaced inertials of merged links, see :func:`merged_inertial_misplaced`.

    Principal axes are Q R if ``turned``, else Q.
    """
    robot, bodies = evidence.robot, []
    for joint in robot.joints:
        home, p, R = robot.welded[joint.child]
        body = robot.bodies[joint.child]
        if joint.dofs or home == NO_BODY or not body.mass:
            continue
        source = robot.sources.get(joint.child, {})
        moments, Q = _principal(np.array(source.get("written", body.inertia)))
        # c + Q p and axes Q R are in the frame of the moving link; here they are transformed to the merged link's own
        axes, com = R.T @ (Q @ R if turned else Q), R.T @ (body.com + Q @ p - p)
        bodies.append(dataclasses.replace(body, com=com, inertia=axes @ np.diag(moments) @ axes.T))
    return robot.with_bodies(bodies)


@hypothesis(
    {"mujoco": "3.8.1 to 3.10.0"}, 'update MuJoCo, or put <mujoco><compiler fusestatic="false"/></mujoco> into the file'
)
def merged_inertial_misplaced(evidence: RobotEvidence) -> Robot:
    """The inertial of a merged link is placed in the wrong order (default fusestatic for URDF).

    The pose (p, R) of the link in its parent and the pose (c, Q) of its principal frame in the link are multiplied as
    (c, Q) (p, R): the centre of mass comes to lie at c + Q p instead of p + R c. The principal frame is MuJoCo's:
    Jacobi rotations from the axes of the link, then moments in descending order; its rpy is ignored, as in these
    versions.
    """
    return _misplaced(evidence, turned=True)


@hypothesis({"mujoco": "3.3.3"}, 'update MuJoCo, or put <mujoco><compiler fusestatic="false"/></mujoco> into the file')
def merged_inertial_misplaced_unturned(evidence: RobotEvidence) -> Robot:
    """The inertial of a merged link is placed in the wrong order and not turned (default fusestatic for URDF)."""
    return _misplaced(evidence, turned=False)
