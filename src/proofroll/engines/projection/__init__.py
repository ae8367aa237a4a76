"""Blajer's projection method (Blajer 2006) for mechanisms, coded by hand."""

from proofroll.engines.projection.adapter import Projection

__all__ = ["Projection"]
