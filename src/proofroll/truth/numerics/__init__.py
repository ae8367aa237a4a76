"""Numerics of all truths: hybrid motions, series, collocation, scalars."""
