"""Pinocchio: its terms of the equations of motion, with the rows of rolling and the integrator on top.

Pinocchio has no rolling joint. It supplies mass matrix, bias, Jacobians, their drift, reactions and the arithmetic of
configurations; here the rows of the surface and of rolling are put to it, and the motion is integrated. Where friction
is bounded, the rows of rolling give way to friction from event to event. Its own solver of contact with friction is the
formulation ``contact``.

Needs Pinocchio 4 (``tangentMap``), which counts ``forwardDynamics`` and ``impulseDynamics`` among its unsupported
algorithms: shipped, but without a promise.
"""

from proofroll.engines.pinocchio.adapter import Pinocchio
from proofroll.engines.pinocchio.settings import PinocchioSettings

__all__ = ["Pinocchio", "PinocchioSettings"]
