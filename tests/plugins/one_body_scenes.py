"""Scene files of one body, and the line by which a wrong one is refused."""

from pathlib import Path

import pytest

from proofroll.core.errors import InputError
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.run.element import the_mechanism
from proofroll.files.scene_file import load_scene

_TEXT = """
title = "t"
source = "s"
[gravity]
magnitude = 0
[[bodies]]
name = "b"
mass = 1
inertia = [1, 1, 1]
[[joints]]
name = "j"
kind = "{kind}"
parent = "world"
child = "b"
{more}
"""


def one_body(folder: Path, kind: str, more: str) -> Mechanism:
    """Mechanism of a scene of one body without weight, on a joint of this kind, with further tables."""
    (folder / "scene.toml").write_text(_TEXT.replace("{kind}", kind).replace("{more}", more))
    return the_mechanism(load_scene(str(folder))).mechanism


def refusal(folder: Path, kind: str, more: str) -> str:
    """The one line by which such a scene is refused."""
    with pytest.raises(InputError) as caught:
        one_body(folder, kind, more)
    assert "\n" not in str(caught.value)
    return str(caught.value)
