"""Mechanisms without contacts in Exudyn."""
