"""Contacts of mechanisms in Pinocchio."""
