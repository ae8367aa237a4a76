"""Sentences about a mechanism for a person: its start, and its pose in a message."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.number_format import vector
from proofroll.elements.mechanism.contact.start import touches
from proofroll.elements.mechanism.dynamics.kinematics import Tree
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.scene.joint_kinds import WITH_QUATERNION, JointKind

if TYPE_CHECKING:
    from proofroll.elements.mechanism.run.element import MechanismElement
    from proofroll.elements.mechanism.run.sampling import MechanismSample
    from proofroll.elements.mechanism.scene.model import Mechanism

# Largest number of bodies whose places are listed, and of joints whose coordinates a message lists.
_BODIES, _JOINTS = 8, 6
FRAMES = (
    "axes: com, inertia and positions are along those of their body, v0 of free and spherical joints along the "
    "child's; velocities and forces of a run along the world's"
)


def start_facts(element: MechanismElement) -> Sequence[str]:
    """Sentences on degrees of freedom, redundant constraints, a singular pose, places of bodies, and gaps of pairs."""
    analysis, mechanism = element.analysis, element.mechanism
    clauses = [f"degrees of freedom: {analysis.mobility}"]
    driven = len(mechanism.prescribed)
    if rows := analysis.rows - driven:
        repeated = f", of which {analysis.redundant} follow from the others" if analysis.redundant else ""
        clauses[0] += f"; loops add {rows} constraints{repeated}"
    if driven:
        clauses[0] += f"; prescribed motions: {', '.join(joint.name for joint, _, _ in mechanism.prescribed)}"
    if analysis.singular_start:
        clauses.append("the start is a singular pose: constraints lose rank there, and the motion may go several ways")
    moving = element.start
    for body in mechanism.bodies[:_BODIES]:
        centre = moving.point(body.name, body.com)[0]
        speed = float(np.linalg.norm(moving.velocity(body.name, body.com)[0]))
        clauses.append(f"{body.name}: centre of mass at {vector(centre)} m, speed {speed:.4g} m/s")
    if more := len(mechanism.bodies) - _BODIES:
        clauses += [f"and {more} more bodies"] if more > 0 else []
    clauses += [*_start_velocities(element), *_on_wall(element)]
    bound = element.step_bound(())
    clauses += [bound] if bound else []
    touching = touches(mechanism, Tree(mechanism).at(*mechanism.start()))
    gaps = dict[str, float]()  # the least one of each pair, which may have many points
    for contact, touch in zip(mechanism.contacts, touching, strict=True):
        gaps[contact.pair] = min(gaps.get(contact.pair, np.inf), touch.gap)
    clauses += [f"gaps of pairs: {', '.join(f'{pair} {gap:.4g} m' for pair, gap in gaps.items())}"] if gaps else []
    return [*clauses, FRAMES]


def _start_velocities(element: MechanismElement) -> list[str]:
    """Sentences on v0 of free and spherical joints, which is along the child's axes, with the world's beside it."""
    sentences = []
    for joint in element.mechanism.joints:
        if joint.kind not in WITH_QUATERNION or not any(joint.v0):
            continue
        linear = f"velocity {vector(joint.v0[:3])} m/s, " if joint.kind == JointKind.FREE else ""
        velocity = f"{linear}angular velocity {vector(joint.v0[-3:])} rad/s along the axes of {joint.child}"
        number = element.mechanism.body_index[joint.child]
        moving = [f"{vector(element.start.w_WB[0, number])} rad/s"]
        if linear:
            moving.insert(0, f"{vector(element.start.v_WB[0, number])} m/s")
        sentences.append(f"{joint.name}: v0 is {velocity}; along the world's: {' and '.join(moving)}")
    return sentences[:_BODIES]


def _on_wall(element: MechanismElement) -> list[str]:
    """Sentence on the coordinates of a ball on its wall, and on what presses it."""
    ball = element.on_wall
    if ball is None:
        return []
    named = zip(ball.surface.coordinates, ball.u0.tolist(), ball.surface.units, strict=True)
    place = ", ".join(f"{name} = {value:.4g}{'' if unit == '1' else f' {unit}'}" for name, value, unit in named)
    force = float(np.linalg.norm(element.first_press[ball.contact_index]))
    pressed = f"; the wall's force on it is {force:.4g} N" if np.isfinite(force) else ""
    return [f"{ball.ball.name} on its wall: {place}{pressed}"]


def pose(mechanism: Mechanism, sample: MechanismSample) -> str:
    """Coordinates of the first joints with one coordinate each; empty without such joints."""
    arrays = (sample.p_WB, sample.v_WB, sample.w_WB, sample.q_WB)
    placed = Placed(mechanism, np.zeros(1), *(np.asarray(item)[None] for item in arrays))
    coordinates = placed.coordinates()
    units = {joint.name: joint.unit for joint in mechanism.joints}
    words = [f"q.{name} = {float(q[0]):.4g} {units[name]}" for name, (q, _) in list(coordinates.items())[:_JOINTS]]
    return ", ".join(words) + (", …" if len(coordinates) > _JOINTS else "")
