"""Contacts of mechanisms in MuJoCo."""
