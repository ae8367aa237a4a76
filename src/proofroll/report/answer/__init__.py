"""Answers to a tolerance, in words for page and terminal."""
