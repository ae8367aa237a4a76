"""Benchmarks of the speed that the project claims for itself and of its cost, measured here and now."""
