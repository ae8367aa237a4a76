"""Exudyn: redundant coordinates with constraints, joint trees, and contacts of spheres and of discs."""

from proofroll.engines.exudyn.adapter import Exudyn

__all__ = ["Exudyn"]
