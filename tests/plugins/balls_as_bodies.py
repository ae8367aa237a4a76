"""Scenes of balls read as mechanisms: a body with a sphere that touches a wall."""

from __future__ import annotations

from typing import Any
from unittest.mock import patch

from proofroll.core.plugins import load_element_kinds
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.kind import BallOnSurfaceKind, BallsAsBodies
from proofroll.files import scene_file


def as_bodies(name: str, **parameters: Any) -> Scene:
    """A scene of balls by the reader of bodies; the same arguments as :func:`proofroll.files.scene_file.load_scene`."""
    # by name: the test of a package's surface reloads the module of the kind
    balls = BallOnSurfaceKind.__name__
    kinds = tuple(BallsAsBodies if kind.__name__ == balls else kind for kind in load_element_kinds())
    with patch.object(scene_file, "load_element_kinds", lambda: kinds):
        return scene_file.load_scene(name, **parameters)
