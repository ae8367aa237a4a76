"""Runs cases: worker processes, the store, recording and timing."""
