"""Functions for formulas of surfaces; see :mod:`proofroll.elements.mechanism.contacts.walls.formula`."""

from proofroll.elements.mechanism.contacts.walls.formula import Jet, cos, differentiated, sin, sqrt, variables

__all__ = ["Jet", "cos", "differentiated", "sin", "sqrt", "variables"]
