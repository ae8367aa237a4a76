"""Mechanisms in the report."""
