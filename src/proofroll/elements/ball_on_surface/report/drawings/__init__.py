"""Drawings of scenes with their symbols, made from the scene's own surface, as plain data that a page draws."""

from proofroll.elements.ball_on_surface.report.drawings.surfaces import overview

__all__ = ["overview"]
