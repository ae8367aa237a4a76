"""Mechanisms whose bushings have other axes."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.scene.bushing import Bushing
from proofroll_drill.mutants.mechanism_models import MechanismMutant


class OfBushing(MechanismMutant):
    """Base of mutants of one bushing.

    Attributes:
        bushing: its name.
    """

    scene: ClassVar[Any] = ("engine_on_mounts", {})
    bushing: ClassVar[str] = "rear"

    def other(self, mechanism: Mechanism) -> Mechanism:
        """Mechanism with that bushing changed."""
        bushings = tuple(self.changed(item) if item.name == self.bushing else item for item in mechanism.bushings)
        return dataclasses.replace(mechanism, bushings=bushings)

    def changed(self, bushing: Bushing) -> Bushing:
        """Bushing that it has."""
        return bushing


class Exchanged(OfBushing):
    """Stiffness and damping of two axes are exchanged."""

    fault = "axes of a bushing exchanged"
    named = ("bushing rear exchanges y and z",)

    def changed(self, bushing: Bushing) -> Bushing:
        """Bushing with y and z exchanged."""
        (a, b, c, d, e, f), (u, v, w, x, y, z) = bushing.stiffness, bushing.damping
        return dataclasses.replace(bushing, stiffness=(a, c, b, d, f, e), damping=(u, w, v, x, z, y))


class Upright(OfBushing):
    """The frame of an inclined bushing is that of the body."""

    fault = "bushing in the axes of the body"
    named = ("bushing left acts along the axes of world, not of its frame there",)
    bushing = "left"

    def changed(self, bushing: Bushing) -> Bushing:
        """Bushing without its orientation."""
        return dataclasses.replace(bushing, orientation_a=(0, 0, 0), orientation_b=(0, 0, 0))
