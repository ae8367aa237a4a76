"""Shapes of bodies, walls, and pairs of them that may touch."""
