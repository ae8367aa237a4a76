"""Mechanisms without contacts in the projection method."""
