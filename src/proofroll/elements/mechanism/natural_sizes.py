"""Natural sizes of the quantities of a mechanism, by their units."""

import numpy as np

from proofroll.elements.mechanism.model import Mechanism


def natural_sizes(mechanism: Mechanism, length: float, speed: float) -> dict[str, float]:
    """Unit -> natural size, for a mechanism of this length [m] and speed [m/s].

    Force: the mechanism's weight or, if larger, the centripetal force on its mass.
    """
    force = mechanism.mass * max(float(np.linalg.norm(mechanism.gravity)), speed**2 / length)
    momentum, energy = mechanism.mass * speed, force * length
    sizes = {"m": length, "m/s": speed, "N": force, "J": energy, "N m": energy}
    return sizes | {"N s": momentum, "N m s": momentum * length, "1": 1.0}
