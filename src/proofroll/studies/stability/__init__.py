"""Stability maps: where along an axis of parameters a run fails, and what explains it."""
