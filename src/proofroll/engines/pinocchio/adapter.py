"""Adapter between proofroll and Pinocchio."""

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import pinocchio as pin

from proofroll.core.engine_abilities import Level, Steps, Term
from proofroll.core.errors import Refused
from proofroll.core.plugins import release
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.capabilities import MechanismCapability, require
from proofroll.elements.mechanism.run.sampling import mechanism_of
from proofroll.engines.pinocchio.contact import impulse_run
from proofroll.engines.pinocchio.contact.impulse_run import ImpulseRun
from proofroll.engines.pinocchio.settings import PRESETS, PinocchioSettings
from proofroll.engines.pinocchio.smooth import constraint_dynamics, joint_tree
from proofroll.engines.pinocchio.smooth.mechanism_run import MechanismRun

# Before 4.0 the constraints had other signatures and other results.
_OF_PINOCCHIO_4 = {"constraint_dynamics", "impulses"}


class Pinocchio:
    """Adapter of Pinocchio: its equations of motion with the rows of joints and loops, or its own contact solver."""

    name: ClassVar[str] = "pinocchio"
    title: ClassVar[str] = "Pinocchio"
    witness: ClassVar[bool] = False
    oldest: ClassVar[str] = "3.9"  # oldest version tried
    provides: ClassVar[Mapping[str, frozenset[str]]] = {
        "null_space": joint_tree.PROVIDES,
        "constraint_dynamics": constraint_dynamics.PROVIDES,
        "impulses": impulse_run.PROVIDES,
    }
    made_for: ClassVar[Mapping[str, frozenset[str]]] = {
        "impulses": frozenset(MechanismCapability[name] for name in ("CONTACT", "JOINT_FRICTION", "STOPS"))
    }
    lacking: ClassVar[Mapping[str, Mapping[str, str]]] = {
        "null_space": joint_tree.LACKING,
        "constraint_dynamics": constraint_dynamics.LACKING,
        "impulses": impulse_run.LACKING,
    }
    settings: ClassVar[type[Any]] = PinocchioSettings
    lines = staticmethod(constraint_dynamics.own_lines)
    presets: ClassVar[Mapping[str, Mapping[str, PinocchioSettings]]] = PRESETS
    levels: ClassVar[Mapping[str, Level]] = {
        "null_space": Level.CONSTRAINT,
        "constraint_dynamics": Level.CONSTRAINT,
        "impulses": Level.CONTACT,
    }
    references: ClassVar[Mapping[str, Steps]] = {"impulses": Steps(exact_cone=True, hard_contact=True)}
    terms: ClassVar[Sequence[Term]] = (
        Term(
            name="projection",
            formulations=("null_space", "constraint_dynamics"),
            on={"projection": True},
            off={"projection": False},
            because="puts the state back on the constraints after each step",
        ),
    )

    @staticmethod
    def caveat(settings: PinocchioSettings) -> str:
        """See :class:`proofroll.core.engine_abilities.TellsCaveats`: Pinocchio computes terms, it has no integrator."""
        around = " around its contact solver" if settings.solver else ""
        return f"integrated by proofroll{around} (Pinocchio has no integrator)"

    @staticmethod
    def brought(settings: PinocchioSettings) -> str:  # noqa: ARG004 -- of the protocol
        """See :class:`proofroll.core.engine_abilities.BringsAPart`."""
        return "integrator"

    family = staticmethod(impulse_run.family)

    @staticmethod
    def lowered(settings: PinocchioSettings) -> Mapping[str, int]:
        """See :class:`proofroll.core.engine_abilities.LowersOrder`."""
        return settings.lowered

    @staticmethod
    def version() -> str:
        """See :class:`proofroll.core.engine.Engine`."""
        return str(pin.__version__)

    @staticmethod
    def defaults() -> Mapping[str, Any]:
        """See :class:`proofroll.core.engine_abilities.TellsDefaults`: gravity, and settings of the proximal solver."""
        solver = pin.ProximalSettings()
        defaults = {
            f"proximal {name}": getattr(solver, name) for name in ("absolute_accuracy", "relative_accuracy", "mu")
        }
        defaults |= {"proximal max_iter": solver.max_iter}
        return defaults | {"gravity": pin.Model().gravity.linear.tolist()}

    @classmethod
    def build(cls, scene: Scene, settings: PinocchioSettings) -> MechanismRun:
        """See :class:`proofroll.core.engine.Engine`; returns a run of the formulation."""
        if settings.formulation in _OF_PINOCCHIO_4 and release(cls.version()) < (4,):
            raise Refused(f"{settings.formulation} needs the constraints of pinocchio 4.0, and this is {cls.version()}")
        mechanism, formulation = mechanism_of(scene), settings.formulation
        require(mechanism, cls.provides[formulation], cls.lacking[formulation])
        return (ImpulseRun if formulation == "impulses" else MechanismRun)(mechanism, settings)
