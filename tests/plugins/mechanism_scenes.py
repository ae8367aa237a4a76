"""Mechanisms of scenes, as their folders hold them, and their truths."""

from collections.abc import Callable

import numpy as np
import pytest

from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.run.element import the_mechanism
from proofroll.files.scene_file import load_scene
from proofroll.truth.error_bars import TwoRouteMotion
from proofroll.truth.truth_of_mechanism import truth_of


def mechanism_named(name: str, **parameters: float) -> Mechanism:
    """The mechanism of a scene with some of its parameters set."""
    return the_mechanism(load_scene(name, **parameters)).mechanism


def true_motion(name: str, times: list[float], **parameters: float) -> TwoRouteMotion:
    """The truth of a scene of one mechanism at these times."""
    return truth_of(mechanism_named(name, **parameters), np.array(times))


@pytest.fixture(scope="session")
def scene() -> Callable[..., Mechanism]:
    """A function that reads a scene with some of its parameters set."""
    return mechanism_named
