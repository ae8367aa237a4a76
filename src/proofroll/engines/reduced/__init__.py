"""Reduced equations of a ball on a surface, solved as an engine of its own."""

from proofroll.engines.reduced.adapter import Reduced

__all__ = ["Reduced"]
