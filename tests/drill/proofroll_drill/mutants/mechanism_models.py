"""Mechanisms of other bodies, joints, loads and starts than the scene's."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import partial
from typing import Any, ClassVar

import numpy as np

from proofroll.core.scene import Scene
from proofroll.elements.mechanism import BodyMotion, Mechanism
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.dynamics.kinematics import Rows
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.run.sampling import MechanismSample
from proofroll.elements.mechanism.scene.kinks import Functions
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll_drill.mutants.base import STEP, Honest, Mutant, planted

PENDULUM: Any = ("double_pendulum", {})
CRANK: Any = ("slider_crank", {})
TOP: Any = ("heavy_top", {})
SPRUNG: Any = ("oscillators", {})


class MechanismMutant(Mutant):
    """Builds a changed mechanism."""

    formulation: ClassVar[str] = "dependent"
    scene: ClassVar[Any] = PENDULUM
    until: ClassVar[float] = 0.12  # to move a mechanism costs most, and its faults show at once
    every: ClassVar[float] = 0.006

    def misread(self, scene: Scene) -> Scene:
        """The mechanism changed."""
        (element,) = scene.elements
        assert isinstance(element, MechanismElement)
        return dataclasses.replace(scene, elements=(MechanismElement(self.other(element.mechanism)),))

    def other(self, mechanism: Mechanism) -> Mechanism:
        """Mechanism that it builds."""
        return mechanism


def each(kind: str, name: str = "", **fields: Callable[[Any], Any]) -> Callable[[Any, Mechanism], Mechanism]:
    """Method ``other`` of a mutant: other fields of all bodies, joints, pairs …, or of the one with a name.

    Args:
        kind: field of the mechanism, as ``joints``.
        name: of the one that changes; empty: all do.
        fields: field of a part -> function from the right part to its value.
    """

    def other(_: Any, mechanism: Mechanism) -> Mechanism:
        def changed(part: Any) -> Any:
            if name not in {"", part.name}:
                return part
            return dataclasses.replace(part, **{field: value(part) for field, value in fields.items()})

        parts: dict[str, Any] = {kind: tuple(map(changed, getattr(mechanism, kind)))}
        return dataclasses.replace(mechanism, **parts)

    return other


def times(factor: float, field: str) -> Callable[[Any], Any]:
    """Value for :func:`each`: a number of the part times a factor."""
    return lambda part: factor * getattr(part, field)


class JointsMutant(MechanismMutant):
    """Runge-Kutta 4 on equations in joint coordinates that have a fault; it gives no reactions."""

    def __init__(self, scene: Scene, settings: Any) -> None:
        super().__init__(scene, settings)
        self.equations = self.faulty(self.element.mechanism)
        self.y = np.concatenate(self.element.mechanism.start())

    def faulty(self, mechanism: Mechanism) -> JointCoordinates:
        """The equations; without a fault here."""
        return JointCoordinates(mechanism)

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        rate, h = self.equations.rate, STEP
        for _ in range(round((t - self.t) / h)):
            k1 = rate(0.0, self.y)
            k2 = rate(0.0, self.y + h / 2 * k1)
            k3 = rate(0.0, self.y + h / 2 * k2)
            self.y = self.y + h / 6 * (k1 + 2 * k2 + 2 * k3 + rate(0.0, self.y + h * k3))
        self.t = t

    def sample(self) -> MechanismSample:
        """See :class:`proofroll.core.engine.Engine`."""
        n = self.element.mechanism.nq
        said = self.equations.sample(self.y[:n], self.y[n:])
        return MechanismSample(**{name: said[name] for name in ("p_WB", "v_WB", "w_WB", "q_WB")})

    def built(self) -> Any:
        """Model as given; without its start."""
        return dataclasses.replace(self.claimed.built(), acceleration=None, angular_acceleration=None)


class ToldMutant(Honest, MechanismMutant):
    """Base of mutants that tell all that they have built."""


def _gravity(change: Callable[[Any], Any]) -> Callable[[Any, Mechanism], Mechanism]:
    return lambda _, mechanism: dataclasses.replace(mechanism, gravity=tuple(map(change, mechanism.gravity)))


def _about_origin(body: Any) -> Any:
    """Inertia with Steiner's part, as if that about the joint were that about the centre of mass."""
    c = np.array(body.com)
    return body.inertia + body.mass * (c @ c * np.eye(3) - np.outer(c, c))


def _without_start(self: Any) -> Any:
    """Model as given; without its start."""
    return dataclasses.replace(self.claimed.built(), acceleration=None, angular_acceleration=None)


def _lost_terms(_: Any, mechanism: Mechanism) -> JointCoordinates:
    """Equations with the diagonal of the mass matrix alone."""
    equations = JointCoordinates(mechanism)
    whole = equations.inertial

    def inertial(motion: BodyMotion) -> tuple[Array, Array, Array]:
        J, M, loads = whole(motion)
        return J, np.diag(np.diag(M)), loads

    equations.inertial = inertial  # type: ignore[method-assign]  # that is the fault
    return equations


def _without_row(_: Any, mechanism: Mechanism) -> JointCoordinates:
    """Equations without the second row of the loop: the rod's end may leave the guide's line."""
    equations = JointCoordinates(mechanism, rank=1)
    whole = equations.tree.loop_rows

    def rows(motion: BodyMotion, time: float = 0.0, *functions: Functions) -> Rows:
        right = whole(motion, time, *functions)
        less: dict[str, Any] = {
            name: np.delete(part, 1, axis=0) for name, part in right._asdict().items() if name != "moved"
        }
        return right._replace(**less)

    equations.tree.loop_rows = rows  # type: ignore[method-assign, assignment]  # that is the fault
    return equations


def _weight_at_origin(_: Any, mechanism: Mechanism) -> JointCoordinates:
    """Equations with each body's weight at the origin of its frame; its inertia is right."""
    equations = JointCoordinates(mechanism)
    whole, g = equations.inertial, np.array(mechanism.gravity)

    def inertial(motion: BodyMotion) -> tuple[Array, Array, Array]:
        J, M, loads = whole(motion)
        n = len(mechanism.bodies)
        arms = np.einsum("nij,nj->ni", motion.R_WB[:n], [body.com for body in mechanism.bodies])
        moved = loads.copy()
        moved[:n, 3:] += np.cross(arms, [body.mass * g for body in mechanism.bodies])
        return J, M, moved

    equations.inertial = inertial  # type: ignore[method-assign]  # that is the fault
    return equations


def _with_armature(_: Any, mechanism: Mechanism) -> JointCoordinates:
    """Equations with the rotor inertia that an actuator brings in each joint."""
    return JointCoordinates(each("joints", armature=lambda _: 0.05)(None, mechanism))


_TILTED = each("joints", "elbow", axis=lambda _: (0.0, 0.05, 1.0))
_changed, _told = partial(planted, MechanismMutant), partial(planted, ToldMutant, scene=TOP)
_in_joints = partial(planted, JointsMutant)
FAULTS = (
    _changed(
        "AboutOrigin", "inertia about the wrong point", "wrong point", other=each("bodies", inertia=_about_origin)
    ),
    # the lower one, with the inertia of one
    _changed(
        "HeavyBody",
        "mass of one body counted twice",
        "body lower with its mass counted twice",
        other=each("bodies", "lower", mass=times(2, "mass")),
    ),
    _changed(
        "NoCentres",
        "centres of mass forgotten",
        "centres of mass",
        scene=TOP,
        other=each("bodies", com=lambda _: (0, 0, 0)),
    ),
    _changed(
        "Falling",
        "gravity of a mechanism with the wrong sign",
        "gravity with the wrong sign",
        other=_gravity(lambda g: -g),
    ),
    _changed(
        "Undamped",
        "joint damping ignored",
        "damping of the joints left out",
        scene=SPRUNG,
        other=each("joints", damping=lambda _: 0.0),
    ),
    _changed(
        "DampedJoints", "joint damping left on", "every joint has damping", other=each("joints", damping=lambda _: 0.1)
    ),
    _changed(
        "Degrees",
        "joint stiffness per degree",
        "stiffness of the joints",
        scene=SPRUNG,
        other=each("joints", stiffness=times(np.pi / 180, "stiffness")),
    ),
    _changed(
        "TiltedAxis",
        "wrong joint axis",
        "elbow turns about",
        scene=("double_pendulum", {"bend": 0.0}),
        other=_TILTED,
        built=_without_start,
    ),
    planted(ToldMutant, "ToldAxis", "wrong joint axis, and read back", "elbow was built with the axis", other=_TILTED),
    _in_joints("Armature", "armature", "every joint has an armature", faulty=_with_armature),
    _in_joints("LoopWithoutRow", "loop with a missing row", "lacks a row", scene=CRANK, faulty=_without_row),
    _in_joints(
        "OutOfOrder", "tree out of order: terms of the mass matrix lost", "mass matrix lacks", faulty=_lost_terms
    ),
    _in_joints("WeightAtOrigin", "weight at the origin of the body's frame", "weight", faulty=_weight_at_origin),
    _changed(
        "OrderOfMoments",
        "moments of inertia in another order",
        "moments of inertia",
        scene=("free_body", {}),
        other=each("bodies", inertia=lambda body: np.array(body.inertia)[np.ix_([0, 2, 1], [0, 2, 1])]),
    ),
    # what the damping does grows slowly
    _changed(
        "SpringUndamped",
        "damping of a spring ignored",
        "damping of the springs left out",
        scene=("gyroscope_cart", {}),
        until=0.3,
        every=0.01,
        other=each("springs", damping=lambda _: 0.0),
    ),
    _changed(
        "Backwards",
        "initial velocities with the wrong sign",
        "wrong sign",
        scene=CRANK,
        other=each("joints", v0=lambda joint: tuple(-x for x in joint.v0)),
    ),
    _told(
        "StandardGravity",
        "standard gravity instead of the scene's, and read back",
        "gravity 0.999659 times",
        other=_gravity(lambda g: g and -9.80665),
    ),
    _told(
        "HeavierTop",
        "mass 1.001 times, and read back",
        "mass 1.001 times",
        other=each("bodies", mass=times(1.001, "mass")),
    ),
    _told(
        "StifferTop",
        "inertia 1.001 times, and read back",
        "inertia 1.001 times",
        other=each("bodies", inertia=lambda body: 1.001 * np.array(body.inertia)),
    ),
    _told(
        "AxialTop",
        "one moment of inertia off, and read back",
        "inertia 0.01001 instead of 0.01",
        other=each("bodies", inertia=lambda body: np.array(body.inertia) * np.diag([1.0, 1.0, 1.001])),
    ),
    _told(
        "TransverseTop",
        "a moment of inertia across the axis off, and read back",
        "inertia 0.02002 instead of 0.02",
        other=each("bodies", inertia=lambda body: np.array(body.inertia) * np.diag([1.001, 1.0, 1.0])),
    ),
    _told(
        "HigherTop",
        "centre of mass 1.001 times, and read back",
        "centre of mass 1.001 times",
        other=each("bodies", com=lambda body: tuple(1.001 * x for x in body.com)),
    ),
    _told(
        "AsideTop",
        "centre of mass beside the axis, and read back",
        "centre of mass 0.001, 0, 0.3",
        other=each("bodies", com=lambda body: (1e-3, 0.0, body.com[2])),
    ),
)
