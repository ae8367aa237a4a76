"""Drawings of scenes with their symbols, made from the scene's own surface, as plain data that a page draws."""

from proofroll.elements.ball_on_surface.report.drawings.contact import contact
from proofroll.elements.ball_on_surface.report.drawings.net import net
from proofroll.elements.ball_on_surface.report.drawings.surfaces import overview
from proofroll.report.pen import Drawing

__all__ = ["Drawing", "contact", "net", "overview"]
