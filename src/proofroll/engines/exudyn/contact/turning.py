"""Rolling resistance and friction against spin in Exudyn: a connector with a moment of its own beside a contact."""

import math
from collections.abc import Callable, Sequence
from typing import Any

from proofroll.elements.mechanism.contact.rolling_and_spin import TurningFriction
from proofroll.engines.exudyn.native import Output, exu, items


def add_turning(
    system: Any,
    friction: TurningFriction,
    markers: list[Any],
    pressing: Callable[[], tuple[float, Sequence[float]]],
    zone: float,
) -> None:
    """Adds the moment of one friction between the bodies of its contact.

    Args:
        system: Exudyn's system.
        friction: its law.
        markers: of the contact's bodies a and b.
        pressing: gives the present normal force [N] and normal of the contact.
        zone: angular velocity up to which the moment is proportional to it [rad/s].
    """
    kind, velocity, rotation = exu.ConfigurationType.Current, Output.AngularVelocity, Output.RotationMatrix
    body_a, body_b = markers

    def wrench(system: Any, *_state: Any) -> list[float]:
        """Force and moment on the first marker, in its axes; plain floats, for each residual calls it."""
        xa, ya, za = system.GetMarkerOutput(body_a, velocity, kind).tolist()
        xb, yb, zb = system.GetMarkerOutput(body_b, velocity, kind).tolist()
        R = system.GetMarkerOutput(body_a, rotation, kind).tolist()
        N, (nx, ny, nz) = pressing()
        x, y, z = xa - xb, ya - yb, za - zb
        spin = nx * x + ny * y + nz * z
        sx, sy, sz = spin * nx, spin * ny, spin * nz
        x, y, z = (sx, sy, sz) if friction.spins else (x - sx, y - sy, z - sz)
        scale = -friction.friction * max(N, 0.0) / max(math.hypot(x, y, z), zone)
        return [0.0, 0.0, 0.0, *(scale * (R[k] * x + R[k + 3] * y + R[k + 6] * z) for k in range(3))]

    system.AddObject(
        items.ObjectConnectorRigidBodySpringDamper(markerNumbers=markers, springForceTorqueUserFunction=wrench)
    )
