"""Which reactions of a mechanism are drawn over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.observable import Observable, Role
from proofroll.elements.mechanism.element import MechanismElement

if TYPE_CHECKING:
    import xarray as xr

# Curves of forces, and of torques, of one case.
_MOST = 8
# What changes by less than this part of the widest range is a straight line in its figure.
_STILL = 1e-6


def reactions(element: MechanismElement, truth: xr.Dataset) -> list[Observable]:
    """Determinate components of the wrenches on children that change most, in the order of joints and loops.

    Args:
        element: the mechanism.
        truth: its true motion, with the variables of :mod:`proofroll.elements.mechanism.dataset`.
    """
    names = [connection.name for connection in element.mechanism.connections]
    found = []
    for kind, unit in (("force", "N"), ("torque", "N m")):
        components = [truth[f"{kind}.{name}.{axis}"] for name in names for axis in "xyz"]
        # At time 0 a reaction belongs to the certificate.
        ranges = {
            str(item.name): float(np.ptp(item.to_numpy()[1:])) for item in components if not item.attrs.get("absent")
        }
        widest = max(ranges.values(), default=0.0)
        moving = [name for name, width in ranges.items() if width > _STILL * widest]
        largest = sorted(moving, key=lambda name: -ranges[name])[:_MOST]
        found += [
            Observable(name, unit, str(truth[name].attrs["long_name"]), Role.REACTION, floor=_STILL * widest)
            for name in moving
            if name in largest
        ]
    return found
