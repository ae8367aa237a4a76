"""Scenes with mechanisms, as their folders hold them."""

import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.reader import read_mechanism

MODELS = Path(__file__).parents[3] / "models"


@pytest.fixture(scope="session")
def scene() -> Callable[..., Mechanism]:
    """A function that reads a scene with some of its parameters set."""

    def read(name: str, **parameters: float) -> Mechanism:
        return read_mechanism(tomllib.loads((MODELS / name / "scene.toml").read_text()), **parameters)

    return read
