"""Bodies of Jolt: boxes that have the inertia of the scene's bodies, and what impulses do to them."""

from __future__ import annotations

from typing import Any

import culverin
import numpy as np

from proofroll.adapter import Array, Body, Refused, to_quaternion

# Half of the shortest edge that culverin takes [m]; a shorter one becomes this long.
_THINNEST = 1e-3
# Part of a body's largest moment that a box may have too much or too little.
_ROUNDED = 1e-6
# Time in which an impulse acts [s].
_INSTANT = 1e-6


def world_of(gravity: Array, bodies: int) -> Any:
    """World of culverin with room for so many bodies."""
    wanted = {"gravity": tuple(gravity.tolist()), "num_threads": 1, "max_bodies": max(16, 2 * bodies)}
    return culverin.PhysicsWorld(settings=wanted)


def add_ground(world: Any) -> int:
    """Handle of a body that never moves and touches nothing."""
    return int(world.create_body(pos=(0, 0, 0), motion=culverin.MOTION_STATIC, category=0, mask=0))


def add_body(world: Any, body: Body, centre: Array, R: Array) -> int:
    """Handle of a body that touches nothing, with its centre of mass [m] and its rotation."""
    half_edges, axes = box(body)
    made = world.create_body(
        shape=culverin.SHAPE_BOX,
        size=tuple(half_edges.tolist()),
        mass=float(body.mass),
        pos=tuple(centre.tolist()),
        rot=tuple(np.roll(to_quaternion(R @ axes), -1).tolist()),
        category=0,
        mask=0,
    )
    return int(made)


def box(body: Body) -> tuple[Array, Array]:
    """Half edges [m] and axes, as columns in the body's frame, of the box with this body's mass and inertia.

    Raises:
        Refused: no box that culverin takes has this inertia.
    """
    moments, axes = np.linalg.eigh(body.inertia)
    axes[:, 2] *= np.linalg.det(axes)
    squares = 1.5 / body.mass * (moments.sum() - 2 * moments)  # of the half edges
    half_edges = np.sqrt(np.maximum(squares, _THINNEST**2))
    made = body.mass / 3 * (half_edges @ half_edges - half_edges**2)
    if np.max(np.abs(made - moments)) > _ROUNDED * moments.max():
        raise Refused(
            f"{body.name}: culverin takes inertia from shapes with edges of at least {2 * _THINNEST:g} m, "
            f"and no such box has these moments: {', '.join(f'{moment:.4g}' for moment in moments)} kg m²"
        )
    return half_edges, axes


def measured(body: Body) -> tuple[float, Array]:
    """Mass [kg] and inertia [kg m²] in the body's frame, from what impulses do to it in a world of its own.

    culverin tells neither.
    """
    _, axes = box(body)
    mass = body.mass / _after_impulse(body, "apply_impulse", "velocities", 0, body.mass)
    pushes = np.linalg.eigvalsh(body.inertia)  # to 1 rad/s, for Jolt cuts fast spins
    moments = [
        push / _after_impulse(body, "apply_angular_impulse", "angular_velocities", k, push)
        for k, push in enumerate(pushes.tolist())
    ]
    return float(mass), np.asarray(axes @ np.diag(moments) @ axes.T)


def _after_impulse(body: Body, push: str, told: str, direction: int, size: float) -> float:
    """Speed [m/s, rad/s] in a direction of the box's axes after an impulse [N s, N m s] in that direction."""
    world = world_of(np.zeros(3), 1)
    _, axes = box(body)
    handle = add_body(world, body, np.zeros(3), axes.T)
    world.step(0.0)
    getattr(world, push)(handle, *(size * np.eye(3)[direction]).tolist())
    world.step(_INSTANT)
    return float(np.frombuffer(getattr(world, told), np.float32)[4 * world.get_index(handle) + direction])
