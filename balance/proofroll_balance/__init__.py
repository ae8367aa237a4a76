"""Equilibria of mechanisms, and small motions about them, by two routes and in every engine."""
