"""Stability map in a report and on the terminal."""
