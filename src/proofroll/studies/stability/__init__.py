"""Stability maps: places along an axis of parameters at which runs fail, and numbers that explain them."""
