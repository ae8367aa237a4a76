"""Mechanisms as scene files describe them, checked."""
