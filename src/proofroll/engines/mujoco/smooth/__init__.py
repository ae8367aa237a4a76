"""Mechanisms without contacts in MuJoCo."""
