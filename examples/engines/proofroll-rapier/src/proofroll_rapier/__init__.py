"""Rapier for proofroll."""
