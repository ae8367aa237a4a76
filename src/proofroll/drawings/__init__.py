"""Drawings of scenes with their symbols, made from the scene's own surface, as plain data that a page draws."""

from proofroll.drawings.contact import contact
from proofroll.drawings.pen import Drawing
from proofroll.drawings.surfaces import overview

__all__ = ["Drawing", "contact", "overview"]
