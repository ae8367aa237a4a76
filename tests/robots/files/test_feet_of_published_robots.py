"""Census of a package's robots on the floors of their files: what stands, and what is refused, by name."""

from __future__ import annotations

from pathlib import Path

import pytest

from proofroll import load_scene
from proofroll.core.errors import InputError
from proofroll.files.scene_sources import with_control

gymnasium = pytest.importorskip("gymnasium")
pytest.importorskip("mujoco")
pytestmark = pytest.mark.nightly

ASSETS = Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets"
# File -> pairs of shapes that come near each other within a second of a start at rest without servos.
STAND = {"ant": 4, "half_cheetah": 2, "hopper": 2, "humanoid": 22, "point": 1, "walker2d": 4, "walker2d_v5": 4}
REFUSED = {
    "humanoidstandup": "they overlap by",
    "pusher": "a margin of 0.004 m around cylinder",
    "pusher_v5": "a margin of 0.004 m around cylinder",
    "inverted_pendulum": "no shape of it comes near",
    "inverted_double_pendulum": "no shape of it comes near",
    "reacher": "no shape of it comes near",
    "swimmer": "no shape of it comes near",
}


def _named(name: str, folder: Path) -> str:
    control = folder / "stand.toml"
    control.write_text("rate = 50\n[ground]\n", encoding="utf-8")
    path = ASSETS / f"{name}.xml"
    if not path.is_file():
        pytest.skip(f"this version has no {path.name}")
    return with_control(str(path), control)


@pytest.mark.parametrize(("name", "count"), STAND.items())
def test_a_published_robot_stands_on_its_floor(name: str, count: int, tmp_path: Path) -> None:
    """Its scene has a pair for each two shapes that come near each other."""
    (element,) = load_scene(_named(name, tmp_path)).elements
    assert len(element.mechanism.pairs) == count  # type: ignore[attr-defined]


@pytest.mark.parametrize(("name", "says"), REFUSED.items())
def test_a_published_robot_that_cannot_stand_is_refused(name: str, says: str, tmp_path: Path) -> None:
    """One line says what no scene has, or that nothing touches."""
    with pytest.raises(InputError, match=says):
        load_scene(_named(name, tmp_path))
