"""Loads and targets that an adapter sets from outside."""

from __future__ import annotations

import numpy as np
import pytest

from proofroll.adapter import loads_at, targets_at
from proofroll.elements.mechanism import Body, Force, Joint, Mechanism, Tree
from proofroll.elements.mechanism.run.sampling import mechanism_of
from proofroll.elements.mechanism.scene.signal import Formula
from proofroll.files.scene_file import load_scene

INERTIA = (0.1, 0.2, 0.3)


def arm() -> Mechanism:
    """A turning base with a driven slide, and forces on its load, one of them with a reaction on the base."""
    return Mechanism(
        (Body("base", 2.0, (0.1, 0, 0), INERTIA), Body("load", 1.0, (0, 0.2, 0), INERTIA)),
        (
            Joint("turn", "revolute", "world", "base", axis=(0, 0.6, 0.8), q0=(0.4,), torque=Formula("2 + 3*t")),
            Joint("slide", "prismatic", "base", "load", (0.3, 0.1, 0), axis=(1, 0, 0), q0=(0.2,), torque=-5.0),
        ),
        forces=(
            Force("wind", "load", "force", (1.0, Formula("t"), 0.0), (0.1, 0, 0.3)),
            Force("grip", "load", "force", (0.0, 4.0, 1.0), (0, 0.1, 0), frame="body", reaction="base"),
            Force("twist", "load", "moment", (0.5, 0.0, 2.0), reaction="base"),
        ),
    )


def test_loads_are_the_power_of_each_along_the_tree() -> None:
    """Along the joints they are the drives, and forces and moments as their points and bodies move."""
    mechanism, t = arm(), 0.7
    motion = Tree(mechanism).at(*mechanism.start())
    force, moment = loads_at(mechanism, t, motion.p_WB[:-1], motion.R_WB[:-1])
    along = sum(motion.J[k].T @ np.concatenate([force[k], moment[k]]) for k in range(2))
    expected = np.array([2 + 3 * t, -5.0])
    base, load = motion.J[0], motion.J[1]

    def point(J: np.ndarray, arm: np.ndarray) -> np.ndarray:
        return np.asarray(J[:3] - np.cross(np.eye(3), arm) @ J[3:])

    R, p = motion.R_WB, motion.p_WB
    at = R[1] @ (0.1, 0, 0.3)
    expected = expected + point(load, at).T @ (1.0, t, 0.0)
    grip, place = R[1] @ (0.0, 4.0, 1.0), p[1] + R[1] @ (0, 0.1, 0)
    expected = expected + (point(load, place - p[1]) - point(base, place - p[0])).T @ grip
    expected = expected + (load[3:] - base[3:]).T @ (0.5, 0.0, 2.0)
    np.testing.assert_allclose(along, expected, atol=1e-12)


def test_loads_between_bodies_cancel() -> None:
    """What a slide's drive does to one body its reaction does to the other, force and moment about one point."""
    mechanism = Mechanism(arm().bodies, (Joint("turn", "revolute", "world", "base", q0=(0.4,)), arm().joints[1]))
    motion = Tree(mechanism).at(*mechanism.start())
    force, moment = loads_at(mechanism, 0.0, motion.p_WB[:-1], motion.R_WB[:-1])
    assert np.linalg.norm(force[0]) == pytest.approx(5.0)
    np.testing.assert_allclose(force.sum(axis=0), 0.0, atol=1e-14)
    np.testing.assert_allclose((moment + np.cross(motion.p_WB[:-1], force)).sum(axis=0), 0.0, atol=1e-14)


def test_targets_are_those_of_the_actuators_at_the_time() -> None:
    """Targets stand in the scene's order, evaluated at the time that is asked."""
    mechanism = mechanism_of(load_scene("servo"))
    assert targets_at(mechanism, 0.3) == pytest.approx([float(item.target) for item in mechanism.actuators])
