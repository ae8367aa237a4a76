"""Benchmarks: what speed the project claims for itself, and what it costs, measured here and now."""
