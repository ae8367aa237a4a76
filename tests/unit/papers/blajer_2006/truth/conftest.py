"""Scenes with a ball on a surface, where the folder above has mechanisms."""

from ball_scenes import scene  # noqa: F401 -- a fixture, which pytest finds here
