"""Figures of an article drawn from our own runs, and the numbers that its text states held against them."""
