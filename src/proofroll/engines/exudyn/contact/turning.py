"""Rolling resistance and friction against spin in Exudyn: moments as loads beside a contact.

A connector of two bodies would do; but Exudyn differentiates it by each of its coordinates in each step, which takes
five times as many calls.
"""

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from proofroll.elements.mechanism.contact.rolling_and_spin import TurningFriction
from proofroll.elements.mechanism.scene.rotations import Floats3, plain_cross
from proofroll.engines.exudyn.native import Output, exu, items


def add_turning(
    system: Any,
    friction: TurningFriction,
    markers: Sequence[Any],
    pressing: Callable[[], tuple[float, Floats3]],
    zone: float,
) -> None:
    """Adds the moment of one friction between the bodies of its contact.

    Args:
        system: Exudyn's system.
        friction: its law.
        markers: of the contact's bodies a and b; of a ball whose motion is resisted at its centre; None: the world.
        pressing: gives the present normal force [N] and normal of the contact, from b to a.
        zone: angular velocity up to which the moment is proportional to it [rad/s].
    """
    marker_a, marker_b = markers
    bend, coefficient, spins = friction.bend, friction.friction, friction.spins

    def read(marker: Any, output: Any) -> Floats3:
        if marker is None:
            return 0.0, 0.0, 0.0
        x, y, z = system.GetMarkerOutput(marker, output, exu.ConfigurationType.Current).tolist()
        return x, y, z

    def apart(output: Any) -> Floats3:
        (xa, ya, za), (xb, yb, zb) = read(marker_a, output), read(marker_b, output)
        return xa - xb, ya - yb, za - zb

    def opposed(normal: Floats3) -> Floats3:
        """Angular velocity that the moment opposes; of a ball that rolls as its centre moves over the wall [rad/s]."""
        if not bend:
            return apart(Output.AngularVelocity)
        (x, y, z), of_wall = apart(Output.Velocity), read(marker_b if bend > 0 else marker_a, Output.AngularVelocity)
        if any(of_wall):
            u, v, w = plain_cross(of_wall, apart(Output.Position))
            x, y, z = x - u, y - v, z - w
        x, y, z = plain_cross(normal, (x, y, z))
        return bend * x, bend * y, bend * z

    def moment(sign: float, *_state: Any) -> list[float]:
        """Moment on a body in the world [N m]; ``sign``: 1 for body a, -1 for body b."""
        N, normal = pressing()
        if N <= 0.0:
            return [0.0, 0.0, 0.0]
        (nx, ny, nz), (x, y, z) = normal, opposed(normal)
        spin = nx * x + ny * y + nz * z
        u, v, w = spin * nx, spin * ny, spin * nz
        x, y, z = (u, v, w) if spins else (x - u, y - v, z - w)
        scale = -sign * coefficient * N / max(math.hypot(x, y, z), zone)
        return [scale * x, scale * y, scale * z]

    for marker, sign in ((marker_a, 1.0), (marker_b, -1.0)):
        if marker is not None:
            load = partial(moment, sign)
            system.AddLoad(items.LoadTorqueVector(markerNumber=marker, loadVector=[0] * 3, loadVectorUserFunction=load))
