"""Contacts of mechanisms in the projection method."""
