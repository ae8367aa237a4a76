"""Answers to what the harness asks of a mechanism."""
