"""The built wheel works on its own: without the repository, from any folder."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest
from packaging.metadata import Metadata

import proofroll

REPOSITORY = Path(__file__).parents[2]

pytest.importorskip("hatchling", reason="the wheel is built with what is installed; pip install hatchling")
pytest.importorskip("build", reason="the wheel is built with what is installed; pip install build")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, built from the repository."""
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder), str(REPOSITORY)]
    subprocess.run(command, check=True, capture_output=True)
    (found,) = folder.glob("*.whl")
    return found


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the wheel in it and nothing else; a wheel is a zip archive of exactly that."""
    folder = tmp_path_factory.mktemp("installed")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder)
    return folder


def python(installed: Path, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Python with the installed wheel before everything else, in a folder of its own."""
    environment = {key: value for key, value in os.environ.items() if not key.startswith("PYTHON")}
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env=environment | {"PYTHONPATH": str(installed)},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.nightly
def test_type_checkers_refuse_what_is_not_there(installed: Path, tmp_path: Path) -> None:
    """A strict type checker knows the public names, and the types of their arguments."""
    (tmp_path / "user.py").write_text("import proofroll\nproofroll.nothing()\nproofroll.simulate('pendulum', 3)\n")
    said = python(installed, tmp_path, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path), "user.py").stdout
    assert 'Module has no attribute "nothing"' in said
    assert 'Argument 2 to "simulate" has incompatible type "int"' in said


def test_contents(wheel: Path) -> None:
    """The wheel holds the package, its models, comparisons, templates and license, and no tests."""
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    for name in (
        "proofroll/__init__.py",
        "proofroll/models/sphere_in_cylinder/scene.toml",
        "proofroll/models/inclined_plane/scene.toml",
        "proofroll/conformance/checks.py",
        "proofroll/docs/examples/semi_implicit.py",
        "proofroll/docs/examples/tree_euler.py",
    ):
        assert name in names
    models = {path.relative_to(REPOSITORY).as_posix() for path in (REPOSITORY / "models").rglob("*") if path.is_file()}
    claims = {path.relative_to(REPOSITORY).as_posix() for path in (REPOSITORY / "comparisons").glob("*.toml")}
    assert claims
    assert {f"proofroll/{name}" for name in models | claims} <= set(names)
    source = REPOSITORY / "src"
    pages = {path.relative_to(source).as_posix() for path in source.rglob("templates/**/*") if path.is_file()}
    assert {Path(page).parts[1] for page in pages} == {"report", "papers", "elements", "cli", "robots"}
    assert pages <= set(names)
    assert any(name.endswith("LICENSE") for name in names)
    assert not any(name.startswith(("tests/", "proofroll/tests/")) for name in names)
    assert not any("__pycache__" in name for name in names)
    assert {name.partition("/")[0].partition("-")[0] for name in names} == {"proofroll"}


@pytest.mark.drill
def test_it_is_the_wheel_that_is_used(installed: Path, tmp_path: Path) -> None:
    """The package and its data come from the wheel, not from the repository, and its claims are found by name."""
    code = (
        "import proofroll, proofroll.files.data_folders as f\n"
        "print(proofroll.__file__); print(f.data_folder('models'))\n"
        "from proofroll.files.comparison_file import *; print(*[load_comparison(n).name for n in comparison_names()])"
    )
    done = python(installed, tmp_path, "-c", code)
    assert done.returncode == 0, done.stderr
    *places, names = done.stdout.splitlines()
    assert all(line.startswith(str(installed)) for line in places)
    assert len(places) == 2
    assert {path.stem for path in (REPOSITORY / "comparisons").glob("*.toml")} >= set(names.split()) >= {"paper"}


@pytest.mark.nightly
def test_scenes(installed: Path, tmp_path: Path) -> None:
    """The command line finds the scenes without the repository."""
    done = python(installed, tmp_path, "-m", "proofroll", "scenes", "--json")
    assert done.returncode == 0, done.stderr
    assert {scene["name"] for scene in json.loads(done.stdout)} >= {"sphere_in_cylinder", "inclined_plane"}


@pytest.mark.drill
def test_run(installed: Path, tmp_path: Path) -> None:
    """A run from another folder works, in a worker process of the same wheel."""
    arguments = [
        "run",
        "inclined_plane",
        "--engine",
        "projection",
        "--until",
        "0.2",
        "--every",
        "0.1",
        "--out",
        "run.nc",
        "--json",
    ]
    done = python(installed, tmp_path, "-m", "proofroll", *arguments)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["status"] == "done"
    assert (tmp_path / "run.nc").is_file()


def test_entry_points(installed: Path) -> None:
    """The wheel announces the command and our engines, and none of the commands that other packages have."""
    (metadata,) = installed.glob("proofroll-*.dist-info/entry_points.txt")
    text = metadata.read_text()
    for name in ("proofroll = ", "projection = ", "exudyn = ", "pinocchio = ", "mujoco = "):
        assert name in text
    assert "fuzz" not in text
    assert "throughput" not in text
    assert "cluster" not in text
    assert "balance" not in text


def test_types_are_announced(wheel: Path) -> None:
    """The package says that it is typed."""
    with zipfile.ZipFile(wheel) as archive:
        assert "proofroll/py.typed" in archive.namelist()


@pytest.mark.nightly
def test_the_source_archive_makes_the_same_wheel(wheel: Path, tmp_path: Path) -> None:
    """The archive builds without the repository; its wheel has the same files, and the metadata of both are valid."""
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(tmp_path)]
    subprocess.run([*command, "--sdist", str(REPOSITORY)], check=True, capture_output=True)
    with tarfile.open(next(tmp_path.glob("*.tar.gz"))) as tar:
        tar.extractall(tmp_path / "source", filter="data")
    (source,) = (tmp_path / "source").iterdir()
    assert not {path.name for path in source.iterdir()} & {"out", "dist", ".venv"}
    subprocess.run([*command, "--wheel", str(source)], check=True, capture_output=True)
    with zipfile.ZipFile(wheel) as one, zipfile.ZipFile(next(tmp_path.glob("*.whl"))) as other:
        assert set(one.namelist()) == set(other.namelist())
        (name,) = [name for name in one.namelist() if name.endswith(".dist-info/METADATA")]
        metadata = Metadata.from_email(one.read(name), validate=True)
    archived = Metadata.from_email((source / "PKG-INFO").read_bytes(), validate=True)
    assert str(metadata.version) == str(archived.version) == proofroll.__version__
    assert metadata.description_content_type == "text/markdown"
    assert metadata.description
