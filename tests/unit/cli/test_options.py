"""Names of scenes and values of parameters as a person types them."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from proofroll.cli import options
from proofroll.cli.checking import checked_file
from proofroll.core.errors import InputError
from proofroll.files import comparison_file, scene_file, toml
from proofroll.files.data_folders import data_folder, study_folders
from proofroll.files.scene_file import load_scene, scene_folder, scene_names
from proofroll.files.toml import named_file
from proofroll.running.idle_workers import Workers
from proofroll.studies.cases import single_case
from proofroll.studies.comparison.by_name import comparison_named

CommandLine = Callable[..., tuple[int, str, str]]


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder of work in which ``pendulum`` is a scene of one's own, with a parameter more."""
    (tmp_path / "pendulum").mkdir()
    text = (data_folder("models") / "pendulum" / "scene.toml").read_text()
    extra = '[parameters.extra]\nvalue = 1.0\nunit = "1"\nmeaning = "none"\nsource = "here"\n\n[parameters.mass]'
    (tmp_path / "pendulum" / "scene.toml").write_text(text.replace("[parameters.mass]", extra))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_path_never_means_a_shipped_scene(own: Path) -> None:
    """With a separator the name is a path; without one a function reads the shipped scene."""
    assert "extra" in load_scene("./pendulum").parameters
    assert "extra" in load_scene(str(own / "pendulum")).parameters
    assert "extra" not in load_scene("pendulum").parameters
    shutil.rmtree(own / "pendulum")
    with pytest.raises(InputError, match="no such scene"):
        scene_folder("./pendulum")


def test_a_command_reads_the_folder_here(own: Path, command_line: CommandLine) -> None:
    """A name that a folder here and a shipped scene share is the folder's, with a line that says so."""
    for words in (["check", "pendulum"], ["scenes", "pendulum"]):
        code, out, err = command_line(*words)
        assert code == 0, err
        assert "pendulum is read from the folder ./pendulum here" in err
    shutil.rmtree(own / "pendulum")
    code, out, err = command_line("scenes", "pendulum")
    assert (code, err) == (0, "")
    assert "extra" not in out


def test_a_path_of_a_command_never_means_what_is_shipped(own: Path, command_line: CommandLine) -> None:
    """``./NAME`` of a folder without a scene, or of no file, is refused; its own scene is read without a line."""
    code, _, err = command_line("check", "./pendulum")
    assert (code, err) == (0, "")
    (own / "cone").mkdir()
    assert command_line("check", "cone")[0] == 0
    for words, reason in (("./cone", "has no scene.toml"), ("./stop", "no such scene"), ("./stick_slip", "no such")):
        code, _, err = command_line("check", words)
        assert code == 2
        assert reason in err
    code, _, err = command_line("check", "n" * 5000)
    assert (code, err.count("\n")) == (2, 1)
    assert len(err) < 500


class _ReadError(Exception):
    """Ends a door's work at the first file that it reads."""


def _first_file(door: Callable[[str], object], name: str) -> Path | str:
    """The file that a door reads for a name, or the sentence with which it refuses it."""
    try:
        door(options.own_first(name))
    except _ReadError as found:
        return Path(str(found))
    except InputError as error:
        return str(error)
    return "nothing is read"


@pytest.fixture
def doors(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> dict[str, Callable[[str], object]]:
    """The doors at which a person names a scene or a comparison, in an empty folder; each stops at its first file."""

    def read(path: Path) -> None:
        raise _ReadError(path)

    monkeypatch.chdir(tmp_path)
    study_folders()  # which are looked up once
    for module in (toml, scene_file, comparison_file):
        monkeypatch.setattr(module, "read_toml", read)
    for names in ("comparison_names", "further_comparison_names"):  # which a refusal's advice lists, reading all files
        monkeypatch.setattr(comparison_file, names, list)
    return {
        "load_scene": load_scene,
        "run": lambda name: single_case(name, {}, "truth", until=0.1, every=None, time_limit=1.0),
        "check": lambda name: checked_file(name, {}),
        "compare": lambda name: comparison_named(name, {}, Workers(), None),
    }


def _shipped_studies() -> dict[str, Path]:
    """Name, with its folder in a folder of studies -> file of each shipped comparison or other study."""
    files = {path: folder for folder in study_folders() for path in folder.rglob("*.toml")}
    return {path.relative_to(folder).with_suffix("").as_posix(): path for path, folder in files.items()}


@pytest.mark.drill
def test_every_shipped_name_is_found_at_every_door(doors: dict[str, Callable[[str], object]]) -> None:
    """A scene's name at all doors, a study's name, with its folder, too, at those for studies; as a path neither."""
    scenes = {name: data_folder("models") / name / "scene.toml" for name in scene_names()}
    studies = _shipped_studies()
    assert {"mechanisms/andrews_squeezer", "stick_slip"} <= studies.keys()
    for door, enter in doors.items():
        found = {"check": studies | scenes, "compare": scenes | studies}.get(door, scenes)
        assert {name: _first_file(enter, name) for name in found} == found, door
        for name in {*scenes, *studies} - found.keys():
            assert "no such scene" in str(_first_file(enter, name)), (door, name)
    for form in ("./{}", "../{}", "/{}", "~/{}", "{}/", "a/../{}", "{}/."):
        paths = [form.format(name) for name in {*scenes, *studies}]
        assert not [path for path in paths if named_file(path)], form
        for name in ("pendulum", "stick_slip", "mechanisms/stop"):
            read = {door: _first_file(enter, form.format(name)) for door, enter in doors.items()}
            assert not [door for door, file in read.items() if isinstance(file, Path)], (form, name)


def test_a_path_that_exists_is_no_shipped_name(doors: dict[str, Callable[[str], object]], tmp_path: Path) -> None:
    """A folder here that is called as a shipped comparison with its folder is read, or refused without a scene."""
    own = tmp_path / "mechanisms" / "stop"
    own.mkdir(parents=True)
    for door, enter in doors.items():
        assert "no scene.toml" in str(_first_file(enter, "mechanisms/stop")), door
    (own / "scene.toml").touch()
    for door, enter in doors.items():
        assert _first_file(enter, "mechanisms/stop") == Path("mechanisms/stop/scene.toml"), door


def test_a_shipped_scene_in_its_own_folder(monkeypatch: pytest.MonkeyPatch, command_line: CommandLine) -> None:
    """In the folder of the shipped scenes nothing is said."""
    monkeypatch.chdir(data_folder("models"))
    assert command_line("scenes", "pendulum")[2] == ""


def test_a_mistyped_key_has_the_one_that_is_meant(own: Path, command_line: CommandLine) -> None:
    """An unknown key of a scene's file is answered with the known key that resembles it."""
    file = own / "pendulum" / "scene.toml"
    file.write_text(file.read_text().replace("\nmass = ", "\nmasss = ", 1))
    assert "did you mean mass?" in command_line("check", "./pendulum")[2]


@pytest.mark.drill
def test_given_parameters_are_blamed(command_line: CommandLine) -> None:
    """A body that a given parameter makes impossible is told with the parameter; angles that turn often are doubted."""
    code, _, err = command_line("check", "pendulum", "--set", "length=2 mm")
    assert code == 2
    assert err.startswith("proofroll: length = 0.002: with this ")
    code, out, _ = command_line("check", "pendulum", "--set", "angle=60")
    assert code == 0
    assert "60 rad is 9.5 turns" in " ".join(out.split())
    asked = ["run", "pendulum", "--engine", "truth", "--until", "0.1", "--set", "angle=60"]
    assert "60 rad is 9.5 turns" in command_line(*asked)[2]


def test_an_sdf_is_called_so(tmp_path: Path, command_line: CommandLine) -> None:
    """Every command that reads a robot file says of an SDF that it is one."""
    file = tmp_path / "world.sdf"
    file.write_text('<?xml version="1.0"?><sdf version="1.9"><world name="w"/></sdf>')
    said = {command_line(*words.split())[2] for words in (f"check {file}", f"compare {file}", f"recommend {file}")}
    assert said == {command_line("run", str(file), "--engine", "truth")[2]}
    assert "it is an SDF, which is not read; give the robot as a URDF or an MJCF" in said.pop()
