"""What engines are held against."""

from __future__ import annotations

from typing import Any

import numpy as np

from proofroll.elements.ball_on_surface.observables import Observable
from proofroll.files.scene_file import load_scene
from proofroll.studies.reference import Reference


def reference(**curves: list[float]) -> Reference:
    """A truth of which only some observables matter."""
    nothing: Any = None
    found = {name: Observable(name, "s", np.array(values)) for name, values in curves.items()}
    return Reference(load_scene("sphere_in_cylinder"), nothing, found, {"z": 0.2})


def test_a_percentage_of_the_first_slip_is_of_its_time() -> None:
    """The first slip at 1.7 s has that as its scale; where the ball does not slip, there is none."""
    assert reference(first_slip=[1.7]).scale("first_slip") == 1.7
    assert reference(first_slip=[]).scale("first_slip") is None
    assert reference().scale("first_slip") is None
    assert reference().scale("z") == 0.2
    assert reference().scale("event_order") is None
