"""Rolling resistance and friction against spin in Exudyn: a connector with a moment of its own beside a contact."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from proofroll.elements.mechanism.contact.rolling_and_spin import TurningFriction
from proofroll.elements.mechanism.scene.rotations import cross
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
        markers: of the contact's bodies a and b; of a ball whose motion is resisted at its centre.
        pressing: gives the present normal force [N] and normal of the contact, from b to a.
        zone: angular velocity up to which the moment is proportional to it [rad/s].
    """
    kind, velocity, rotation = exu.ConfigurationType.Current, Output.AngularVelocity, Output.RotationMatrix
    body_a, body_b = markers

    def moving(normal: Sequence[float], w_a: Sequence[float], w_b: Sequence[float]) -> Any:
        """Angular velocity with which a ball would roll as its centre moves over the wall [rad/s]."""
        outputs = ((marker, output) for output in (Output.Velocity, Output.Position) for marker in markers)
        va, vb, pa, pb = (np.array(system.GetMarkerOutput(*item, kind)) for item in outputs)
        of_wall = np.array(w_b if friction.bend > 0 else w_a)
        return (friction.bend * cross(np.array(normal), va - vb - cross(of_wall, pa - pb))).tolist()

    def wrench(system: Any, *_state: Any) -> list[float]:
        """Force and moment on the first marker, in its axes; plain floats, for each residual calls it."""
        xa, ya, za = system.GetMarkerOutput(body_a, velocity, kind).tolist()
        xb, yb, zb = system.GetMarkerOutput(body_b, velocity, kind).tolist()
        R = system.GetMarkerOutput(body_a, rotation, kind).tolist()
        N, (nx, ny, nz) = pressing()
        x, y, z = xa - xb, ya - yb, za - zb
        if friction.bend:
            x, y, z = moving((nx, ny, nz), (xa, ya, za), (xb, yb, zb))
        spin = nx * x + ny * y + nz * z
        sx, sy, sz = spin * nx, spin * ny, spin * nz
        x, y, z = (sx, sy, sz) if friction.spins else (x - sx, y - sy, z - sz)
        scale = -friction.friction * max(N, 0.0) / max(math.hypot(x, y, z), zone)
        return [0.0, 0.0, 0.0, *(scale * (R[k] * x + R[k + 3] * y + R[k + 6] * z) for k in range(3))]

    system.AddObject(
        items.ObjectConnectorRigidBodySpringDamper(markerNumbers=markers, springForceTorqueUserFunction=wrench)
    )
