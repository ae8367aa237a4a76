"""Blajer's projection method for a ball that rolls on a surface (Blajer 2006), coded by hand; no engine behind it."""

from proofroll.engines.projection.adapter import Projection

__all__ = ["Projection"]
