"""Motions known in closed form, recognised by the structure of a mechanism, not by its name.

Sources: E. T. Whittaker, Analytical Dynamics, 4th ed., sections 44 (pendulum) and 72 (top); L. D. Landau, E. M.
Lifshitz, Mechanics, 3rd ed., section 37 (free body).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm
from scipy.special import ellipj, ellipk, ellipkinc

from proofroll.elements.mechanism import WORLD, Joint, Mechanism
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.dynamics.record import Record
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.rotations import Array, from_rpy
from proofroll.elements.mechanism.scene.signal import varies

_SAME = 1e-12  # relative difference up to which quantities are equal within round-off


@dataclass(frozen=True)
class ClosedForm:
    """A motion, or a part of it, in closed form.

    Attributes:
        title: name of the motion.
        motion: times, s -> coordinates (times, nq) and velocities (times, nv) of the tree; None: only a part is known.
        part: times, s -> the known quantities.
        same: these quantities from a recorded motion.
    """

    title: str
    motion: Callable[[Array], tuple[Array, Array]] | None
    part: Callable[[Array], Array]
    same: Callable[[Record], Array]


def closed_form(mechanism: Mechanism) -> ClosedForm | None:
    """Closed form of a mechanism's motion, or None if none is known here."""
    switched = any(joint.friction or joint.armature or joint.limits for joint in mechanism.joints)
    driven = mechanism.actuators or mechanism.couplings or any(map(varies, mechanism.signals))
    plain = not (switched or mechanism.springs or mechanism.bushings or mechanism.forces or driven)
    if not plain:
        return None
    for recognised in (_oscillators, _swinging, _free_body, _heavy_top):
        form = recognised(mechanism)
        if form is not None:
            return form
    return None


def swing(angle: float, speed: float, w2: float, times: Array) -> tuple[Array, Array] | None:
    """Angle [rad] and angular velocity [rad/s] of φ̈ = −w2 sin φ; None at rest or on the separatrix.

    Args:
        angle: φ at time 0, rad.
        speed: φ̇ at time 0, rad/s.
        w2: square of the frequency of small swings, 1/s².
        times: s.
    """
    w = np.sqrt(w2)
    m = speed**2 / (4 * w2) + np.sin(angle / 2) ** 2  # k²
    if abs(m - 1) < _SAME or m == 0:
        return None
    if m < 1:
        turns = 2 * np.pi * np.round(angle / (2 * np.pi))
        phase = np.arctan2(np.sin((angle - turns) / 2), speed / (2 * w))
        sn, cn, _, _ = ellipj(w * times + ellipkinc(phase, m), m)
        return turns + 2 * np.arcsin(np.sqrt(m) * sn), 2 * w * np.sqrt(m) * cn
    rate = np.sign(speed) * w * np.sqrt(m)
    _, _, dn, amplitude = ellipj(rate * times + ellipkinc(angle / 2, 1 / m), 1 / m)
    return 2 * amplitude, 2 * rate * dn


def _swinging(mechanism: Mechanism) -> ClosedForm | None:  # noqa: PLR0911 -- each is a way not to be a pendulum
    """Pendulum: all joints turn by ± the same angle or not at all, with constant inertia, under gravity."""
    laws = ("stiffness", "damping", "torque")
    if any(joint.kind != JointKind.REVOLUTE or any(getattr(joint, law) for law in laws) for joint in mechanism.joints):
        return None
    equations = JointCoordinates(mechanism)
    if mechanism.nv - equations.rank != 1:
        return None
    q0, v0 = mechanism.start()
    direction = v0 if v0.any() else np.linalg.svd(equations.tree.loop_rows(equations.tree.at(q0, v0)).C)[2][-1]
    if not v0.any() and not mechanism.loops:
        direction = np.ones(1)
    direction = direction / direction[np.argmax(np.abs(direction))]
    if not all(min(abs(entry - whole) for whole in (-1, 0, 1)) < _SAME for entry in direction):
        return None
    direction = np.round(direction)
    speed = float(v0 @ direction / (direction @ direction))
    # Over a whole turn: are the loops closed along q0 + s·direction, and is the inertia constant?
    turn = np.linspace(0, 2 * np.pi, 17)[:-1]
    inertia, force = [], []
    for s in turn:
        J, M, loads = equations.inertial(equations.tree.at(q0 + s * direction, 0 * v0))
        residual = equations.tree.loop_rows(equations.tree.at(q0 + s * direction, 0 * v0)).residual
        if np.abs(residual).max(initial=0.0) > 1e3 * _SAME:
            return None
        inertia.append(direction @ M @ direction)
        force.append(-np.einsum("nij,ni,j", J, loads, direction))
    waves = np.column_stack([np.sin(turn), np.cos(turn)])
    sine, cosine = np.linalg.lstsq(waves, np.array(force), rcond=None)[0]
    scale = max(np.abs(force).max(), _SAME)
    if np.ptp(inertia) > 1e3 * _SAME * inertia[0] or np.abs(waves @ [sine, cosine] - force).max() > 1e3 * _SAME * scale:
        return None
    # force = −F sin(s + shift)
    shift, w2 = float(np.arctan2(-cosine, -sine)), float(np.hypot(sine, cosine) / np.mean(inertia))
    if w2 == 0 or swing(shift, speed, w2, np.zeros(1)) is None:
        return None

    def motion(times: Array) -> tuple[Array, Array]:
        pendulum = swing(shift, speed, w2, times)
        assert pendulum is not None
        return q0 + np.outer(pendulum[0] - shift, direction), np.outer(pendulum[1], direction)

    return ClosedForm("pendulum, Jacobi elliptic functions", motion, lambda t: motion(t)[0], lambda r: r.q)


def _oscillators(mechanism: Mechanism) -> ClosedForm | None:
    """Uncoupled oscillators: joints on the ground with linear springs and dampers."""
    if mechanism.loops or any(joint.parent != WORLD or joint.nv > 1 for joint in mechanism.joints):
        return None
    bodies = {body.name: body for body in mechanism.bodies}
    systems = []
    for joint in mechanism.joints:
        if joint.kind == JointKind.FIXED:
            continue
        body, gravity = bodies[joint.child], np.array(mechanism.gravity)
        axis, arm = np.array(joint.axis), np.array(body.com) - joint.child_position
        off_axis = arm - axis * (axis @ arm)
        if joint.kind == JointKind.REVOLUTE:
            if not joint.stiffness or (off_axis.any() and gravity.any()):
                return None
            inertia = axis @ np.array(body.inertia) @ axis + body.mass * off_axis @ off_axis
            drive = joint.constant_drive
        else:
            inertia = body.mass
            drive = joint.constant_drive + body.mass * gravity @ from_rpy(joint.orientation) @ axis
        constant = (drive + joint.stiffness * joint.rest) / inertia
        systems.append(
            (np.array([[0, 1, 0], [-joint.stiffness / inertia, -joint.damping / inertia, constant], [0, 0, 0]]), joint)
        )

    def motion(times: Array) -> tuple[Array, Array]:
        states = [np.array([expm(A * t) @ [*j.q0, *j.v0, 1.0] for t in times]) for A, j in systems]
        return np.column_stack([s[:, 0] for s in states]), np.column_stack([s[:, 1] for s in states])

    return ClosedForm("damped oscillators, exponentials", motion, lambda t: motion(t)[0], lambda r: r.q)


def _alone(mechanism: Mechanism, kind: str) -> Joint | None:
    """Joint of a mechanism of one body, if it is of this kind and undamped; else None."""
    joint = mechanism.joints[0]
    return joint if len(mechanism.bodies) == 1 and joint.kind == kind and not joint.damping else None


def _free_body(mechanism: Mechanism) -> ClosedForm | None:
    """Angular velocity, in body axes, of a torque-free body with three different moments of inertia."""
    joint = _alone(mechanism, JointKind.FREE)
    if joint is None:
        return None
    moments, axes = np.linalg.eigh(np.array(mechanism.bodies[0].inertia))
    axes = axes * np.sign(np.linalg.det(axes))
    w = axes.T @ joint.v0[3:]
    if np.min(np.diff(moments)) < _SAME * moments[2]:
        return None
    # I3·2E − L² and L² − I1·2E as sums of squares; if the first is larger, the first and third axes are exchanged
    order = [0, 1, 2]
    if moments[2] * (moments[2] - moments[1]) * w[2] ** 2 < moments[0] * (moments[1] - moments[0]) * w[0] ** 2:
        order = [2, 1, 0]  # the equations keep their form
    (I1, I2, I3), (w1, w2, w3) = moments[order], w[order]
    over = I1 * (I3 - I1) * w1**2 + I2 * (I3 - I2) * w2**2
    under = I2 * (I2 - I1) * w2**2 + I3 * (I3 - I1) * w3**2
    m = (I2 - I1) * over / ((I3 - I2) * under) if under else 1.0
    if not 0 < m < 1 - _SAME:
        return None
    a1, a2, a3 = np.sqrt([over / (I1 * (I3 - I1)), over / (I2 * (I3 - I2)), under / (I3 * (I3 - I1))])
    rate = np.sign(w3) * np.sqrt((I3 - I2) * under / (I1 * I2 * I3))
    start = ellipkinc(np.arctan2(w2 / a2, w1 / a1), m)

    def part(times: Array) -> Array:
        sn, cn, dn, _ = ellipj(rate * times + start, m)
        w_B = np.zeros((len(times), 3))
        w_B[:, order] = np.column_stack([a1 * cn, a2 * sn, np.sign(w3) * a3 * dn])
        turned: Array = w_B @ axes.T
        return turned

    return ClosedForm("free body, Jacobi elliptic functions (angular velocity)", None, part, lambda r: r.v[:, 3:])


def _heavy_top(mechanism: Mechanism) -> ClosedForm | None:
    """Cosine of the tilt of a symmetric top about a fixed point."""
    joint, body = _alone(mechanism, JointKind.SPHERICAL), mechanism.bodies[0]
    gravity = np.array(mechanism.gravity)
    if joint is None or not gravity.any():
        return None
    arm = np.array(body.com) - joint.child_position
    length = float(np.linalg.norm(arm))
    if length == 0:
        return None
    axis = arm / length
    about_tip = np.array(body.inertia) + body.mass * (length**2 * np.eye(3) - np.outer(arm, arm))
    axial = float(axis @ about_tip @ axis)
    across = float(np.trace(about_tip) - axial) / 2
    if np.abs(about_tip - across * np.eye(3) - (axial - across) * np.outer(axis, axis)).max() > _SAME * across:
        return None
    up = -gravity / np.linalg.norm(gravity)
    motion = JointCoordinates(mechanism).tree.at(*mechanism.start())
    w, height = motion.w_WB[0], motion.R_WB[0] @ axis
    u0, spin = float(height @ up), float(w @ height)
    rate0 = float(np.cross(w, height) @ up)
    beta = 2 * body.mass * float(np.linalg.norm(gravity)) * length / across
    a = axial * spin / across
    # b: angular momentum about the vertical over the transverse moment of inertia
    b = float(w @ up) + (axial / across - 1) * spin * u0
    squared = float(w @ w) - spin**2  # square of the transverse angular velocity
    alpha = squared + beta * u0
    # u̇² = β u³ − (α + a²) u² + (2ab − β) u + α − b²
    if abs(rate0) <= _SAME * np.sqrt(squared + beta):
        linear, constant = beta * u0 - (alpha + a * a), beta * u0**2 - (alpha + a * a) * u0 + 2 * a * b - beta
        roots = np.append(np.roots([beta, linear, constant]), u0)  # the start is a root; the others keep their digits
    else:
        roots = np.roots([beta, -(alpha + a * a), 2 * a * b - beta, alpha - b * b])
    if np.abs(np.imag(roots)).max() > 0:
        return None
    u1, u2, u3 = np.sort(np.real(roots))
    m = (u2 - u1) / (u3 - u1)
    if not 0 < m < 1 - _SAME:
        return None
    frequency = np.sqrt(beta * (u3 - u1)) / 2
    if u0 in (u1, u2):
        start = 0.0 if u0 == u1 else float(ellipk(m))
    else:
        sine = np.sqrt(np.clip((u0 - u1) / (u2 - u1), 0, 1))
        start = float(np.sign(rate0) * ellipkinc(np.arcsin(sine), m))

    def part(times: Array) -> Array:
        cosine: Array = u1 + (u2 - u1) * ellipj(frequency * times + start, m)[0] ** 2
        return cosine

    def same(record: Record) -> Array:
        from scipy.spatial.transform import Rotation

        turned: Array = Rotation.from_quat(record.q_WB[:, 0], scalar_first=True).apply(axis) @ up
        return turned

    return ClosedForm("heavy top, Jacobi elliptic functions (nutation)", None, part, same)
