"""Mechanisms without contacts in Pinocchio."""
