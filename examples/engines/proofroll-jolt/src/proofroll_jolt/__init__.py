"""Jolt Physics for proofroll."""
