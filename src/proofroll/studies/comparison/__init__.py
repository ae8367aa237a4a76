"""Comparisons: rows of engines at points of a scene's parameters, each judged against the truth."""
