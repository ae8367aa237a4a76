"""The pose of a mechanism in words, for a message."""

import numpy as np

from proofroll.elements.mechanism.model import Mechanism
from proofroll.elements.mechanism.placed import Placed
from proofroll.elements.mechanism.sampling import MechanismSample

# Largest number of joints whose coordinates a message lists.
_MOST = 6


def pose(mechanism: Mechanism, sample: MechanismSample) -> str:
    """Coordinates of the first joints with one coordinate each; empty without such joints."""
    arrays = (sample.p_WB, sample.v_WB, sample.w_WB, sample.q_WB)
    placed = Placed(mechanism, np.zeros(1), *(np.asarray(item)[None] for item in arrays))
    found = placed.coordinates()
    units = {joint.name: "rad" if joint.kind == "revolute" else "m" for joint in mechanism.joints}
    words = [f"q.{name} = {float(q[0]):.4g} {units[name]}" for name, (q, _) in list(found.items())[:_MOST]]
    return ", ".join(words) + (", …" if len(found) > _MOST else "")
