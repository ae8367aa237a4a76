"""Scenes with mechanisms, as their folders hold them."""

from mechanism_scenes import scene  # noqa: F401 -- a fixture, which pytest finds here
