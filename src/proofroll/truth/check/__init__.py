"""Checks of a truth before it leaves: its routes held against the laws of mechanics, which import no route (`laws`)."""
