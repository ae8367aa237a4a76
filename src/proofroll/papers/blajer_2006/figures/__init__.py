"""Figures of an article drawn from our own runs, and checks of the numbers that its text states."""
