"""Pinocchio: its terms of the equations of motion, with time integration added here.

It supplies mass matrix, bias, Jacobians, their drift, reactions and the arithmetic of configurations; this package
integrates the motion. Pinocchio's own frictional contact solver is the formulation ``impulses``.

Needs Pinocchio 4 (``tangentMap``), which lists ``forwardDynamics`` and ``impulseDynamics`` among its unsupported
algorithms: shipped, but without a promise.
"""

from proofroll.engines.pinocchio.adapter import Pinocchio
from proofroll.engines.pinocchio.settings import PinocchioSettings

__all__ = ["Pinocchio", "PinocchioSettings"]
