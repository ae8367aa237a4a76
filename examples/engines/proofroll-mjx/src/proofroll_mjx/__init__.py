"""MJX for proofroll."""
