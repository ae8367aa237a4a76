"""Stability maps: steps beyond which runs fail, along axes of parameters, and numbers that explain them."""
