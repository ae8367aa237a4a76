"""Where joints, loops, springs and tracked points are fastened to the bodies of a mechanism."""

from __future__ import annotations

from proofroll.elements.mechanism.checks import WORLD, Vector
from proofroll.elements.mechanism.model import Mechanism


def fastened(mechanism: Mechanism) -> dict[str, list[Vector]]:
    """For each body, and for the world at the end, the points in its own frame where something is fastened [m].

    A free joint fastens nothing.
    """
    found: dict[str, list[Vector]] = {name: [] for name in [*(body.name for body in mechanism.bodies), WORLD]}
    for connection in mechanism.connections:
        if connection.kind != "free":
            found[connection.a].append(connection.position_a)
            found[connection.b].append(connection.position_b)
    for spring in mechanism.springs:
        found[spring.body_a].append(spring.position_a)
        found[spring.body_b].append(spring.position_b)
    for point in mechanism.points:
        found[point.body].append(point.position)
    return found
