"""Tops that are built of other numbers than the scene's by little, and that tell it: all they hold is read back."""

from __future__ import annotations

import dataclasses
from typing import Any, ClassVar

import numpy as np

from proofroll.elements.mechanism import Mechanism
from proofroll_drill.mutants.base import Honest
from proofroll_drill.mutants.mechanism_models import TOP, MechanismMutant, of_bodies


class ToldTop(Honest, MechanismMutant):
    """A top with one number off.

    Attributes:
        factors: field of the body -> factor on it; empty: none.
    """

    scene: ClassVar[Any] = TOP
    factors: ClassVar[dict[str, Any]] = {}

    def other(self, mechanism: Mechanism) -> Mechanism:
        """The fields changed."""

        def changed(body: Any) -> Any:
            fields = {name: np.array(getattr(body, name)) * factor for name, factor in self.factors.items()}
            if "com" in fields:
                fields["com"] = tuple(fields["com"].tolist())
            return dataclasses.replace(body, **fields)

        return of_bodies(mechanism, changed)


class StandardGravity(ToldTop):
    """Another g is at hand."""

    fault = "standard gravity instead of the scene's, and read back"
    named = ("gravity 0.999659 times",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """9.80665 m/s²."""
        return dataclasses.replace(mechanism, gravity=(0.0, 0.0, -9.80665))


class HeavierTop(ToldTop):
    """A thousandth of mass too much."""

    fault = "mass 1.001 times, and read back"
    named = ("mass 1.001 times",)
    factors: ClassVar[dict[str, Any]] = {"mass": 1.001}


class StifferTop(ToldTop):
    """A thousandth of inertia too much."""

    fault = "inertia 1.001 times, and read back"
    named = ("inertia 1.001 times",)
    factors: ClassVar[dict[str, Any]] = {"inertia": 1.001}


class AxialTop(ToldTop):
    """The same about its axis alone."""

    fault = "one moment of inertia off, and read back"
    named = ("inertia 0.01001 instead of 0.01",)
    factors: ClassVar[dict[str, Any]] = {"inertia": np.diag([1.0, 1.0, 1.001])}


class TransverseTop(ToldTop):
    """The same about one axis across it."""

    fault = "a moment of inertia across the axis off, and read back"
    named = ("inertia 0.02002 instead of 0.02",)
    factors: ClassVar[dict[str, Any]] = {"inertia": np.diag([1.001, 1.0, 1.0])}


class HigherTop(ToldTop):
    """Its centre of mass is a thousandth too high."""

    fault = "centre of mass 1.001 times, and read back"
    named = ("centre of mass 1.001 times",)
    factors: ClassVar[dict[str, Any]] = {"com": 1.001}


class AsideTop(ToldTop):
    """Its centre of mass is off its axis."""

    fault = "centre of mass beside the axis, and read back"
    named = ("centre of mass 0.001, 0, 0.3",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """Mechanism with the centre of mass off by a millimetre."""
        return of_bodies(mechanism, lambda body: dataclasses.replace(body, com=(1e-3, 0.0, body.com[2])))
