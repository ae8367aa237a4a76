"""Census of a package's robots on the floors of their files: what stands, and what is refused, by name."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

from proofroll import load_scene
from proofroll.core.errors import InputError
from proofroll.files.scene_sources import ROOT, with_control

gymnasium = pytest.importorskip("gymnasium")
pytest.importorskip("mujoco")
pytestmark = pytest.mark.nightly

ASSETS = Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets"
# File -> pairs of shapes that come near each other within a second of a start at rest without servos.
STAND = {"ant": 4, "half_cheetah": 2, "hopper": 2, "humanoid": 22, "point": 1, "walker2d": 4, "walker2d_v5": 4}
REFUSED = {
    "humanoidstandup": r"they overlap by 2\.27 mm at the start: begin elsewhere by \[start\]",
    "pusher": "a margin of 0.004 m around cylinder",
    "pusher_v5": "a margin of 0.004 m around cylinder",
    "inverted_pendulum": "no shape of it comes near",
    "inverted_double_pendulum": "no shape of it comes near",
    "reacher": "no shape of it comes near",
    "swimmer": "no shape of it comes near",
}


# Package -> its MJCFs that stand on something: gymnasium 1.4.0, metaworld 3.1.1, dm_control 1.0.50, robosuite 1.5.2,
# playground; folders of others than gymnasium by the variable.
PACKAGES = "PROOFROLL_ROBOT_PACKAGES"
EXPRESSIBLE = {"gymnasium": 7, "metaworld": 47, "dm_control": 9, "robosuite": 1, "mujoco_playground": 12}
# What is said of the others: of shapes that touch or come near, that none does, or that the file is no robot.
SAID = (
    r"a scene has no contact of .+ and .+ \(.+\)( and \d+ other pairs?)?; give \[ground\] feet",
    r"no shape of it comes near a floor or another shape within a second; give",
    r"no shapes that come near each other within a second have a rule or touch: (contact|collision meshes) of .+; give",
    r"nothing in it moves$",
    r"there is no such file$",
    r"it has no meaning: mujoco [\d.]+ refuses it",
    r"its shapes cannot be read: mujoco [\d.]+ refuses it: .+; take --ground none",
)


def _controlled(path: Path, folder: Path) -> str:
    control = folder / "stand.toml"
    control.write_text("rate = 50\n[ground]\n", encoding="utf-8")
    return with_control(str(path), control)


def _named(name: str, folder: Path) -> str:
    path = ASSETS / f"{name}.xml"
    if not path.is_file():
        pytest.skip(f"this version has no {path.name}")
    return _controlled(path, folder)


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


@pytest.mark.parametrize(
    "package", [str(ASSETS.parents[2]), *filter(None, os.environ.get(PACKAGES, "").split(os.pathsep))]
)
def test_each_file_of_a_package_stands_or_says_why_not(
    package: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As many as before stand on something, and of each other one a known sentence says what it lacks."""
    folder = Path(package).resolve()
    monkeypatch.setenv(ROOT, str(folder))
    standing, unknown = 0, list[str]()
    for path in sorted(folder.rglob("*.xml")):
        if b"<mujoco" not in path.read_bytes():
            continue
        try:
            standing += bool(load_scene(_controlled(path, tmp_path)).elements)
        except InputError as error:
            unknown += [] if any(re.search(said, str(error)) for said in SAID) else [str(error)]
    assert not unknown
    assert standing >= EXPRESSIBLE[folder.name]
