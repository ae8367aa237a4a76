"""Exudyn: redundant coordinates with constraints, joint trees, and balls on walls."""

from proofroll.engines.exudyn.adapter import Exudyn

__all__ = ["Exudyn"]
