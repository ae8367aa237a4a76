"""Checks of robot files: differences between an engine's model and the one that the file describes, and causes."""
