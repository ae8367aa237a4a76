"""Bushings in Exudyn: connectors of six components with a function of their own.

Exudyn's own law is of Tait-Bryan angles, which no energy has, and its connector applies the opposite force at the other
end, where it changes the moment of momentum. Here its function has the moment of the rotation vector, and a load adds
the moment that the force needs to act at one place on both bodies.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from proofroll.elements.mechanism import WORLD, Mechanism
from proofroll.elements.mechanism.scene.bushing import Bushing
from proofroll.elements.mechanism.scene.rotations import Array, cross
from proofroll.engines.exudyn.native import Output, exu, items

_READ = (Output.RotationMatrix, Output.Position, Output.Velocity, Output.AngularVelocity)


def add_bushings(
    system: Any, mechanism: Mechanism, marker: Callable[[str, Any], Any], turns: Mapping[str, Array] | None = None
) -> None:
    """Adds the bushings.

    Args:
        system: Exudyn's system.
        mechanism: with the bushings.
        marker: makes Exudyn's marker at a place in a body's frame.
        turns: body name -> rotation from the body's axes to its marker's; None: they are the same.
    """
    for bushing in mechanism.bushings:
        ends = ((bushing.body_a, bushing.position_a), (bushing.body_b, bushing.position_b))
        markers = [marker(*end) for end in ends]
        frames = [np.eye(3) if turns is None else turns[body] for body, _ in ends]
        law = _Law(bushing, markers, frames)
        system.AddObject(
            items.ObjectConnectorRigidBodySpringDamper(markerNumbers=markers, springForceTorqueUserFunction=law.wrench)
        )
        if bushing.body_a != WORLD:
            system.AddLoad(
                items.LoadTorqueVector(
                    markerNumber=markers[0], loadVector=[0.0, 0.0, 0.0], loadVectorUserFunction=law.moment_of_arm
                )
            )


class _Law:
    """Functions of one bushing for Exudyn; ``frames`` turn the axes of bodies to those of their markers."""

    def __init__(self, bushing: Bushing, markers: list[Any], frames: list[Array]) -> None:
        self._bushing, self._markers, self._frames = bushing, markers, frames

    def _load(self, system: Any) -> tuple[Array, Array, Array, Array]:
        """Rotation of the first marker, distance of the ends, force and moment on body_b, world axes."""
        now = exu.ConfigurationType.Current
        read: Any = [
            [np.array(system.GetMarkerOutput(marker, output, now)) for output in _READ] for marker in self._markers
        ]
        (axes_a, p_a, v_a, w_a), (axes_b, p_b, v_b, w_b) = read
        A = axes_a.reshape(3, 3)
        R_a, R_b = A @ self._frames[0], axes_b.reshape(3, 3) @ self._frames[1]
        force, moment = self._bushing.load(R_a, R_b, p_b - p_a, v_b - v_a, w_a, w_b)
        return A, p_b - p_a, force, moment

    def wrench(self, system: Any, *_state: Any) -> list[float]:
        """Force and moment on the first marker, in its axes."""
        A, _, force, moment = self._load(system)
        return [float(x) for x in -np.concatenate([A.T @ force, A.T @ moment])]

    def moment_of_arm(self, system: Any, *_state: Any) -> list[float]:
        """Moment of the opposite force about the end on body_a, world axes."""
        _, apart, force, _ = self._load(system)
        return [float(x) for x in -cross(apart, force)]
