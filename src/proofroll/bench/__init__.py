"""Benchmarks: what speed the project claims for itself, measured here and now."""
