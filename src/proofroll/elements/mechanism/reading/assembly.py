"""Assembly and checks of a mechanism's start: loops closed, velocities consistent, able to move."""

from dataclasses import replace

import numpy as np

from proofroll.core.errors import InputError
from proofroll.elements.mechanism.contact.start import extent
from proofroll.elements.mechanism.dynamics.analysis import RANK, SINGULAR, least_norm_solution, rank_of, singular_values
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.dynamics.kinematics import BodyMotion, Rows, Tree
from proofroll.elements.mechanism.scene.joint_kinds import DISTANCE, FACTS
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.parts import Loop
from proofroll.elements.mechanism.scene.rotations import Array

CLOSED = 1e-12  # largest gap of a closed loop, by round-off: relative to the mechanism's size or speeds, or rad
_AWAY = 8 * np.finfo(float).eps  # round-off of positions, relative to their distance from the world's origin
_ROUNDS = 50  # Newton's steps; from a fair guess it needs five
_PART = 1e-6  # velocities below this, relative to the largest in a motion, are round-off
_LARGEST = 0.5  # rad or m in one step: beyond it, the linearisation does not hold
IMMOBILE = "it cannot move; free a joint or a loop"
ADVICE = "correct q0, or give the joints that follow from the loops dependent = true and q0 as a guess"


def assemble(mechanism: Mechanism) -> Mechanism:
    """Mechanism with q0 and v0 of the dependent joints found from its loops; their own q0 are guesses.

    Raises:
        InputError: there is no loop or coupling to find them from, or a number overflows.
    """
    dependent = [joint.name for joint in mechanism.joints if joint.dependent]
    if not dependent:
        return mechanism
    if not mechanism.loops and not mechanism.couplings:
        advice = "there is no loop or coupling that it could follow from; add one, or leave dependent out"
        raise InputError(f"joints.{dependent[0]}.dependent", True, advice)
    tree = Tree(mechanism)
    q, v = mechanism.start()
    free = np.concatenate([np.full(joint.nv, joint.dependent) for joint in mechanism.joints])
    for _ in range(_ROUNDS):
        rows = _finite(tree.loop_rows(tree.at(q, v)))
        dv = np.zeros(len(v))
        dv[free] = -least_norm_solution(rows.C[:, free], rows.residual)
        q = tree.moved(q, dv * min(1.0, _LARGEST / max(np.abs(dv).max(initial=0.0), 1e-300)))
        if np.abs(dv).max(initial=0.0) < 1e-15:
            break
    C = _finite(tree.loop_rows(tree.at(q, v))).C
    v[free] = -least_norm_solution(C[:, free], C[:, ~free] @ v[~free])
    return started(mechanism, q, v)


def started(mechanism: Mechanism, q: Array, v: Array) -> Mechanism:
    """Mechanism that starts at coordinates, (nq), and velocities, (nv); joints whose motion is imposed keep theirs."""
    joints = tuple(
        joint if joint.motion is not None else replace(joint, q0=tuple(q[at_q]), v0=tuple(v[at_v]), dependent=False)
        for joint, at_q, at_v in zip(mechanism.joints, mechanism.q_slices, mechanism.v_slices, strict=True)
    )
    return replace(mechanism, joints=joints)


def _finite(rows: Rows) -> Rows:
    """Returns the rows unchanged; raises InputError if a number in them is not finite."""
    if not all(np.isfinite(part).all() for part in rows):
        raise InputError("loops", "infinite", "lengths, coordinates or velocities are too large to be computed with")
    return rows


def _check_inertia(mechanism: Mechanism, M: Array, C: Array) -> None:
    """Raises InputError if some velocity that loops and couplings (rows C) allow moves nothing that has inertia."""
    if not np.isfinite(M).all():
        raise InputError("mass matrix", "infinite", "masses, moments or lengths are too large to be computed with")
    size = np.sqrt(np.where(np.diag(M) > 0, np.diag(M), 1.0))
    allowed = np.eye(len(M))
    if C.size:
        _, singular_values, directions = np.linalg.svd(C / size)
        allowed = directions[np.sum(singular_values > RANK * singular_values.max()) :].T
    values, vectors = np.linalg.eigh(allowed.T @ (M / np.outer(size, size)) @ allowed)
    if len(values) and values[0] < SINGULAR:
        way = allowed @ vectors[:, 0] / size
        moving = np.abs(way) > _PART * np.abs(way).max()
        joints = zip(mechanism.joints, mechanism.v_slices, strict=True)
        names = ", ".join(joint.name for joint, columns in joints if moving[columns].any())
        advice = "can move so that nothing with inertia does; give a body that they move mass and moments, or fix one"
        raise InputError("joints", names, advice)


def _check_closed(tree: Tree, motion: BodyMotion, loop: Loop, angle: float, near: float) -> None:
    """Raises InputError if a loop is open by more than ``near`` [m], or its axes by an ``angle`` [rad]."""
    field, between, index = f"loops.{loop.name}", f"{loop.body_a} to {loop.body_b}", tree.mechanism.body_index
    apart = tree.point(motion, loop.body_b, np.array(loop.position_b))[0]
    apart = apart - tree.point(motion, loop.body_a, np.array(loop.position_a))[0]
    if loop.kind == DISTANCE:
        if abs(off := float(np.linalg.norm(apart)) - loop.length) > near:
            raise InputError(field, between, f"its points are {off:.3g} m farther apart than its length; {ADVICE}")
        return
    A, B = motion.R_WB[index[loop.body_a]] @ loop.frame_a, motion.R_WB[index[loop.body_b]] @ loop.frame_b
    locked = FACTS[loop.kind].translations
    distance = float(np.linalg.norm(apart if len(locked) == 3 else A[:, list(locked)].T @ apart))
    if distance > near:
        raise InputError(field, between, f"does not close: its points are {distance:.3g} m apart; {ADVICE}")
    turned = len(FACTS[loop.kind].rotations) == 3 and np.trace(A.T @ B) < 1
    if angle > CLOSED or turned:
        turn = "half a turn" if turned else f"{angle:.3g} rad"
        raise InputError(field, between, f"does not close: its axes are {turn} apart; {ADVICE}")


def check_start(mechanism: Mechanism) -> None:
    """Checks that loops close, velocities keep them closed, springs have a direction, and something can move.

    Raises:
        InputError: one of these checks fails.
    """
    if not mechanism.nv:
        raise InputError("mechanism", f"{len(mechanism.joints)} joints", IMMOBILE)
    tree = Tree(mechanism)
    q, v = mechanism.start()
    motion = tree.at(q, v)
    rows, away = _finite(tree.loop_rows(motion)), float(_AWAY * np.abs(motion.p_WB).max())
    near = CLOSED * extent(mechanism, motion) + away
    for spring in mechanism.springs:
        ends = ((spring.body_a, spring.position_a), (spring.body_b, spring.position_b))
        end_a, end_b = (tree.point(motion, body, np.array(place))[0] for body, place in ends)
        if np.linalg.norm(end_b - end_a) <= near:
            advice = "its ends are at one place at the start, so that it has no direction; move one"
            raise InputError(f"springs.{spring.name}", f"{spring.body_a} to {spring.body_b}", advice)
    for number, loop in enumerate(mechanism.loops):
        mine = rows.loop == number
        _check_closed(tree, motion, loop, float(np.abs(rows.residual[mine]).max(initial=0.0)), near)
        rate, least_rate = _opening(rows.C[mine], v, away)
        if rate > least_rate:
            advice = f"v0 opens the loop at {rate:.3g} m/s (or rad/s); {ADVICE.replace('q0', 'v0', 1)}"
            raise InputError(f"loops.{loop.name}", f"{loop.body_a} to {loop.body_b}", advice)
    for number, coupling in enumerate(mechanism.couplings, len(mechanism.loops)):
        field, between = f"couplings.{coupling.name}", coupling.between
        apart, sizes = rows.residual[rows.loop == number], np.abs([coupling.place, *q])
        if abs(apart[0]) > CLOSED * max(1.0, sizes.max()):
            raise InputError(field, between, f"q0 of {coupling.terms[0][0]} is {apart[0]:.3g} rad (or m) off; {ADVICE}")
        rate, least_rate = _opening(rows.C[rows.loop == number], v, 0.0)
        if rate > least_rate:
            advice = f"v0 opens the coupling at {rate:.3g} rad/s (or m/s); {ADVICE.replace('q0', 'v0', 1)}"
            raise InputError(field, between, advice)
    equations = JointCoordinates(mechanism)
    _check_inertia(mechanism, equations.inertial(motion)[1], rows.C)
    _check_motions(mechanism, rows)
    with np.errstate(all="ignore"):  # the line below says it
        acceleration = equations.solve(q, v, ("free",) * len(equations.switched)).acceleration
    if not np.isfinite(acceleration).all():
        advice = "forces, gains or velocities are too large to be computed with"
        raise InputError("accelerations", "infinite", advice)


def _check_motions(mechanism: Mechanism, rows: Rows) -> None:
    """Raises InputError if a prescribed motion already follows from the loops and the motions before it."""
    first_row = len(rows.C) - rows.moved
    rank = rank_of(singular_values(rows.C[:first_row]))
    for number, (joint, _, _) in enumerate(mechanism.prescribed, first_row + 1):
        if rank_of(singular_values(rows.C[:number])) == rank:
            advice = "loops, couplings and other motions already decide this joint; remove one motion"
            raise InputError(f"joints.{joint.name}.motion", str(joint.motion), advice)
        rank += 1


def _opening(C: Array, v: Array, away: float) -> tuple[float, float]:
    """Rate at which rows open, and the largest rate that round-off explains if positions are known to ``away`` [m]."""
    fastest = np.abs(v).max(initial=0.0)
    return float(np.abs(C @ v).max(initial=0.0)), float((CLOSED * np.abs(C).max(initial=0.0) + away) * fastest)
