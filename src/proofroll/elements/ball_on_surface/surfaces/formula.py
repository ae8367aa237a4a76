"""Functions for formulas of surfaces; see :mod:`proofroll.elements.mechanism.scene.shapes.walls.formula`."""

from proofroll.elements.mechanism.scene.shapes.walls.formula import Jet, cos, differentiated, sin, sqrt, variables

__all__ = ["Jet", "cos", "differentiated", "sin", "sqrt", "variables"]
