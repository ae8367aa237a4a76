"""Mechanisms whose contacts have other laws of static friction, rolling and spinning than the scene."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll_drill.mutants.contact_models import ContactMutant, of_pairs


class _OnTheFloor(ContactMutant):
    """Two balls on a floor, followed by the truth's first route, which has all laws of a pair."""

    provides: ClassVar[Mapping[str, frozenset[str]]] = {
        name: needs | {MechanismCapability.TURNING_FRICTION} for name, needs in ContactMutant.provides.items()
    }
    scene: ClassVar[Any] = (str(Path(__file__).parent / "rolling_and_sliding"), {})


class RollingResistanceMore(_OnTheFloor):
    """Rolling is resisted a tenth more."""

    fault = "rolling resistance 1.1 times"
    named = ("rolling resistance of rolls is 1.1 times",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """A tenth more."""
        return of_pairs(mechanism, lambda p: dataclasses.replace(p, rolling_resistance=1.1 * p.rolling_resistance))


class RollingResistanceByRadius(_OnTheFloor):
    """The coefficient of rolling resistance counts as a part of the radius."""

    fault = "rolling resistance with the radius as its arm"
    named = ("rolling resistance of rolls is 0.05 times",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """A moment of f a N."""
        return of_pairs(mechanism, lambda p: dataclasses.replace(p, rolling_resistance=0.05 * p.rolling_resistance))


class SpinningFrictionOff(_OnTheFloor):
    """A spin about the normal goes on."""

    fault = "friction against spin off"
    named = ("friction against spin of slides is off",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """No moment about the normal."""
        return of_pairs(mechanism, lambda pair: dataclasses.replace(pair, spinning_friction=0.0))


class StaticForKinetic(_OnTheFloor):
    """A slip has the friction of what sticks."""

    fault = "static friction in a slip"
    named = ("slides slips with its static friction",)

    def other(self, mechanism: Mechanism) -> Mechanism:
        """The larger coefficient alone."""
        return of_pairs(mechanism, lambda pair: dataclasses.replace(pair, friction=pair.static, static_friction=None))
