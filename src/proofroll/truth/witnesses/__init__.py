"""Motions known in closed form."""
