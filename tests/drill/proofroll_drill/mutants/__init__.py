"""Engines with planted faults, and whether they are detected and their faults named."""
