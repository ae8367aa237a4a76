"""Blajer's projection method (Blajer 2006) for a ball on a surface and for mechanisms, coded by hand."""

from proofroll.engines.projection.adapter import Projection

__all__ = ["Projection"]
