"""Rolling resistance and friction against spin in Exudyn: a connector with a moment of its own beside a contact."""

from collections.abc import Callable
from typing import Any

import numpy as np

from proofroll.elements.mechanism.contact.turning import TurningFriction
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.engines.exudyn.native import Output, exu, items


def add_turning(
    system: Any, friction: TurningFriction, markers: list[Any], pressing: Callable[[], tuple[float, Array]], zone: float
) -> None:
    """Adds the moment of one friction between the bodies of its contact.

    Args:
        system: Exudyn's system.
        friction: its law.
        markers: of the contact's bodies a and b.
        pressing: gives the present normal force [N] and normal of the contact.
        zone: angular velocity up to which the moment is proportional to it [rad/s].
    """

    def wrench(system: Any, *_state: Any) -> list[float]:
        """Force and moment on the first marker, in its axes."""
        kind = exu.ConfigurationType.Current
        w_a, w_b = (np.array(system.GetMarkerOutput(k, Output.AngularVelocity, kind)) for k in markers)
        R = np.reshape(system.GetMarkerOutput(markers[0], Output.RotationMatrix, kind), (3, 3))
        N, normal = pressing()
        turning = friction.resisted(normal, w_a - w_b)
        moment = R.T @ turning * (-friction.friction * max(N, 0.0) / max(float(np.linalg.norm(turning)), zone))
        return [0.0, 0.0, 0.0, *moment.tolist()]

    system.AddObject(
        items.ObjectConnectorRigidBodySpringDamper(markerNumbers=markers, springForceTorqueUserFunction=wrench)
    )
