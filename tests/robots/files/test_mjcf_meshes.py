"""Meshes of an MJCF: those that give mass are found where MuJoCo finds them, and no others are asked for."""

from __future__ import annotations

from pathlib import Path

import pytest

from proofroll.core.errors import InputError
from proofroll.core.limits import TIME_LIMIT
from proofroll.robots.files.meaning import meaning, opened
from proofroll.robots.files.opening import open_robot
from proofroll.robots.files.reading import write
from proofroll.robots.model import Robot

# A corner of a cube: 0.1³/6 m³ of 1000 kg/m³.
TETRAHEDRON = "v 0 0 0\nv .1 0 0\nv 0 .1 0\nv 0 0 .1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
MASS = 1 / 6
INERTIAL = '<inertial pos="0.1 0 0" mass="1.5" diaginertia="0.01 0.02 0.021"/>'


def _file(folder: Path, mesh: str, geom: str, *, compiler: str = "", default: str = "") -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "robot.xml"
    path.write_text(
        f'<mujoco model="m"><compiler {compiler}/><asset>{mesh}</asset><default>{default}</default><worldbody>'
        f'<body name="a" pos="0 0 1"><joint name="h"/>{geom}</body></worldbody></mujoco>'
    )
    return path


def _meant(path: Path, root: Path | None = None) -> Robot:
    pytest.importorskip("mujoco")
    file = opened(path, "fixed", root)
    place = path.parent / "written"
    place.mkdir()
    return meaning(file, write(file, place), TIME_LIMIT)[0]


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("place", "name", "compiler"),
    [
        ("", "tet.obj", ""),
        ("", "tet.obj", 'meshdir="."'),
        ("", "tet.obj", 'texturedir="elsewhere"'),
        ("meshes", "tet.obj", 'meshdir="meshes" texturedir="elsewhere"'),
        ("assets", "tet.obj", 'assetdir="assets"'),
        ("meshes", "far/away/tet.obj", 'meshdir="meshes" strippath="true"'),
        ("meshes", "meshes/tet.obj", ""),
    ],
)
def test_found_where_mujoco_finds_them(place: str, name: str, compiler: str, tmp_path: Path) -> None:
    """A mesh beside the file, or in the folder that the file says, weighs what it weighs in plain MuJoCo."""
    path = _file(tmp_path, f'<mesh name="t" file="{name}"/>', '<geom type="mesh" mesh="t"/>', compiler=compiler)
    (tmp_path / place).mkdir(exist_ok=True)
    (tmp_path / place / "tet.obj").write_text(TETRAHEDRON)
    assert _meant(path).bodies["a"].mass == pytest.approx(MASS)


@pytest.mark.parametrize("weighed", [False, True])
def test_named_in_a_default_class(weighed: bool, tmp_path: Path) -> None:
    """A mesh that only a default class names is kept where it gives mass, and left out with its shape where not."""
    default = '<default class="c"><geom type="mesh" mesh="t"/></default>'
    geom = '<geom class="c"/>' + ("" if weighed else INERTIAL)
    path = _file(tmp_path, '<mesh name="t" file="tet.obj"/>', geom, default=default)
    (tmp_path / "tet.obj").write_text(TETRAHEDRON)
    assert _meant(path).bodies["a"].mass == pytest.approx(MASS if weighed else 1.5)


def test_named_in_a_class_of_the_body(tmp_path: Path) -> None:
    """A default class that a body or a frame gives its shapes is theirs, and what it inherits from others too."""
    default = '<geom type="mesh"/><default class="c"><default class="d"><geom mesh="t"/></default></default>'
    geom = f'{INERTIAL}<body name="b" childclass="d"><frame><geom/></frame><joint/></body>'
    path = _file(tmp_path, '<mesh name="t" file="tet.obj"/>', geom, default=default)
    (tmp_path / "tet.obj").write_text(TETRAHEDRON)
    assert _meant(path).bodies["b"].mass == pytest.approx(MASS)


def test_root(tmp_path: Path) -> None:
    """Meshes and includes above the file are refused with advice, and read where the root says so."""
    mesh = '<include file="../shared/assets.xml"/><mesh name="t" file="../shared/tet.obj"/>'
    path = _file(tmp_path / "robot", mesh, '<geom type="mesh" mesh="t"/>')
    (tmp_path / "shared").mkdir()
    (tmp_path / "shared" / "tet.obj").write_text(TETRAHEDRON)
    (tmp_path / "shared" / "assets.xml").write_text("<mujocoinclude/>")
    with pytest.raises(InputError, match="--root"):
        open_robot(path)
    assert _meant(path, tmp_path).bodies["a"].mass == pytest.approx(MASS)
    with pytest.raises(InputError, match="not in this folder; name one that holds it"):
        open_robot(path, root=tmp_path / "shared")
    (link := tmp_path / "shared" / "link.xml").symlink_to(path)
    with pytest.raises(InputError, match=f"--root = '{link.parent}': link.xml is in {path.parent}, not in"):
        open_robot(link)


def test_what_is_missing(tmp_path: Path) -> None:
    """A mesh that would give mass and does not exist is a warning, which counts it."""
    path = _file(tmp_path, '<mesh name="t" file="tet.obj"/>', '<geom size="1"/><geom type="mesh" mesh="t"/>')
    (finding,) = open_robot(path).remarks
    assert finding.level == "warning"
    assert "1 mesh shape that would give it mass: no such file" in finding.what
