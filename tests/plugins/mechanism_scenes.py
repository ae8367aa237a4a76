"""Fixture of scenes with mechanisms, as their folders hold them."""

from collections.abc import Callable

import pytest

from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.files.scene_file import load_scene


@pytest.fixture(scope="session")
def scene() -> Callable[..., Mechanism]:
    """A function that reads a scene with some of its parameters set."""

    def read(name: str, **parameters: float) -> Mechanism:
        (element,) = load_scene(name, **parameters).elements
        assert isinstance(element, MechanismElement)
        return element.mechanism

    return read
