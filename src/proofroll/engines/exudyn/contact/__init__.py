"""Contacts of mechanisms in Exudyn."""
