"""Comparison of two versions of one engine on the same cases."""
