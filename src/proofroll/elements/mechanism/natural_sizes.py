"""Natural sizes of the quantities of a mechanism, by their units."""

import numpy as np

from proofroll.elements.mechanism.model import Mechanism


def natural_sizes(mechanism: Mechanism, length: float, speed: float) -> dict[str, float]:
    """Natural size of a quantity, by its unit, of a mechanism of a length [m] and a speed [m/s].

    A force is its weight, or if larger the centripetal force of its mass.
    """
    force = mechanism.mass * max(float(np.linalg.norm(mechanism.gravity)), speed**2 / length)
    momentum, energy = mechanism.mass * speed, force * length
    sizes = {"m": length, "m/s": speed, "N": force, "J": energy, "N m": energy}
    return sizes | {"N s": momentum, "N m s": momentum * length, "1": 1.0}
