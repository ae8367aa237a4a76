"""Ladder of models: one quantity while terms of the scene are added one by one."""
