"""Modes of contacts (sticking, slipping, open) and impacts."""
