"""Derivatives of a contact's slide, and of the relative spin of its bodies, by the velocities of a tree."""

import numpy as np

from proofroll.elements.mechanism.contact.touching import Touching
from proofroll.elements.mechanism.dynamics.kinematics import BodyMotion
from proofroll.elements.mechanism.scene.rotations import Array, cross, skew


def turning_row(motion: BodyMotion, bodies: tuple[int, int]) -> tuple[Array, Array, Array]:
    """Angular velocity of a relative to b at a contact, its derivative by the velocities, its rate at v̇ = 0."""
    a, b = bodies
    parts = motion.w_WB, motion.J[:, 3:], motion.bias[:, 3:]
    turning, J, rate = (part[a] - part[b] for part in parts)
    return turning, J, rate


def slide_row(motion: BodyMotion, bodies: tuple[int, int], touch: Touching) -> tuple[Array, Array]:
    """Derivative of a contact's slide by the velocities, (3, nv), and rate of the slide at v̇ = 0, (3,); 0: absent."""
    J, bias = np.zeros((3, motion.J.shape[2])), np.zeros(3)
    if touch.absent:
        return J, bias
    for body, sign in zip(bodies, (1.0, -1.0), strict=True):
        arm, w = touch.place - motion.p_WB[body], motion.w_WB[body]
        J += sign * (motion.J[body, :3] - skew(arm) @ motion.J[body, 3:])
        turning = motion.bias[body, :3] + cross(motion.bias[body, 3:], arm)
        # the point of contact moves over the body, to places with other velocities
        bias += sign * (turning + cross(w, touch.place_rate - motion.v_WB[body]))
    return J, bias
