"""Drawings of scenes with their symbols, made from the scene's own surface, as plain data that a page draws."""

from proofroll.ball_studies.report.drawings.surfaces import overview

__all__ = ["overview"]
