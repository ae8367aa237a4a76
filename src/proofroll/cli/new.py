"""Commands ``new``: write a working example of a scene, a comparison, a package with an engine, or a probe."""

from __future__ import annotations

import keyword
import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from proofroll.cli import options
from proofroll.core.errors import InputError

if TYPE_CHECKING:
    from proofroll.core.scene import Scene

new = typer.Typer(help="Write a working start: scene, comparison, engine or probe.", no_args_is_help=True)
Name = Annotated[str, typer.Argument(help="Its name: letters, digits and _; the folder or file is named so.")]
_TEMPLATES = Path(__file__).parent / "templates"
_ANOTHER = "choose another name"
_LAYOUTS = {"mujoco": "playground", "isaaclab": "isaaclab"}  # program of a probe -> whose arrays its record has
_EXAMPLE, _CLASS = "tree_euler", "TreeEuler"  # an engine of docs/examples, and its class


@new.command()
def scene(name: Name) -> None:
    """Write a folder NAME with a scene.toml: a rod that swings, to be changed into your scene."""
    from proofroll.files.scene_file import scene_names

    folder = _fresh(name, name)
    if name in scene_names():
        raise InputError("name", name, f"the package has a scene of this name, and commands would use it; {_ANOTHER}")
    _write(folder / "scene.toml", _filled(_TEMPLATES / "scene.toml", {"name": name}))
    _say(folder, f"proofroll check {folder}", f"proofroll run {folder} --engine truth")


@new.command()
def comparison(name: Name, scene: Annotated[str, typer.Option(help="The scene, or the path of its folder.")]) -> None:
    """Write NAME.toml: every installed engine that can, held against the truth of a scene."""
    from proofroll.files.scene_file import load_scene
    from proofroll.files.toml import named_file

    file = _fresh(name, f"{name}.toml")
    if named_file(name) is not None:
        raise InputError("name", name, f"the package has a study of this name, and commands would use it; {_ANOTHER}")
    _write(file, _comparison(name, scene, load_scene(scene)))
    _say(file, f"proofroll check {file}", f"proofroll compare {file}")


@new.command()
def engine(
    name: Annotated[str, typer.Argument(help="The engine's name: letters, digits and _; commands take it so.")],
) -> None:
    """Write a package proofroll_NAME with a working engine NAME, its entry point and its conformance test."""
    from importlib.util import find_spec

    from proofroll.core.plugins import engine_names
    from proofroll.files.data_folders import data_folder

    package = f"proofroll_{name}"  # of its own: one called NAME would hide the library of the engine
    folder = _fresh(name, package)
    if name in {*engine_names(), "truth"} or find_spec(package):
        raise InputError("name", name, f"an installed engine or its package has this name; {_ANOTHER}")
    names = {"name": name, "package": package, "Class": "".join(part.capitalize() for part in name.split("_")) or name}
    for template in sorted((_TEMPLATES / "engine").rglob("*")):
        if template.is_file():  # some end in .txt, so that tools do not take them for files of this project
            target = folder / template.relative_to(_TEMPLATES / "engine")
            _write(target.with_suffix("") if target.suffix == ".txt" else target, _filled(template, names))
    example = (data_folder("docs/examples") / f"{_EXAMPLE}.py").read_text(encoding="utf-8")
    source = example.replace(_CLASS, names["Class"]).replace(f'"{_EXAMPLE}"', f'"{name}"')
    _write(folder / "src" / package / "__init__.py", source)
    _say(folder, f"pip install --editable {folder}", f"pytest {folder}")


@new.command()
def probe(
    robot: Annotated[Path, typer.Argument(help="The robot file: URDF, or MJCF for mujoco.")],
    program: Annotated[str, typer.Option("--for", help="Simulator that runs the script: mujoco or isaaclab.")],
    base: Annotated[str, typer.Option(help="What carries the root of a URDF: fixed or free.")] = "fixed",
    _root: options.Root = None,
) -> None:
    """Write a script that records a tenth of a second of a robot in the air in your simulator, for `judge`."""
    from proofroll.core.errors import require_known
    from proofroll.files.scene_sources import StartsProbes, command_line, source_of

    require_known("--for", program, _LAYOUTS, "there is no probe for it; choose from")
    require_known("--base", base, ("fixed", "free"), "choose one of")
    source = source_of(str(robot))
    if source is None or not isinstance(source[0], StartsProbes):
        raise InputError("robot", robot, "give the path of a robot file, .urdf or .xml")
    start = source[0].probe_start(robot, free=base == "free")
    if start.kind != "urdf" and base == "free":
        raise InputError("--base", base, "an MJCF says itself what carries its root; leave it out")
    if program == "isaaclab" and start.kind != "urdf":
        raise InputError("robot", robot, "Isaac Lab reads a URDF; give the robot's, or --for mujoco")
    name = f"probe_{re.sub('[^a-z0-9_]', '_', robot.stem.lower())}_{program}"
    judge = command_line("judge", f"{name}.npz", "--as", _LAYOUTS[program], robot=robot)
    rows = (
        f"    {_quoted(joint)}: ({', '.join(f'{number:.6g}' for number in row)}),\n"
        for joint, row in start.joints.items()
    )
    numbers = start.base and f"[{', '.join(f'{number:.9g}' for number in start.base)}]"
    texts = {"robot": _quoted(str(robot.resolve())), "base": str(numbers), "joints": f"{{\n{''.join(rows)}}}"}
    file = Path(f"{name}.py")
    if file.exists():
        advice = "this file is there already; remove or move it, or run the command in another folder"
        raise InputError("probe", file, advice)
    text = _filled(_TEMPLATES / "probe" / f"{program}.py.txt", texts | {"name": name, "judge": judge})
    of_urdf = "" if start.kind == "urdf" else ".*\n"  # lines of a template that only a URDF needs
    _write(file, re.sub(f"@urdf@{of_urdf}", "", text))
    _say(file, f"python {file}", judge)


def _fresh(name: str, path: str) -> Path:
    """Path of a new file or folder. Raises InputError if it exists or the name is no identifier."""
    if not re.fullmatch(r"[a-z][a-z0-9_]*", name):
        raise InputError("name", name, "write small letters, digits and _, a letter first")
    if keyword.iskeyword(name):
        raise InputError("name", name, f"this is a keyword of Python; {_ANOTHER}")
    if Path(path).exists():
        raise InputError("name", path, f"this is there already; {_ANOTHER} or folder")
    return Path(path)


def _filled(template: Path, names: Mapping[str, str]) -> str:
    text = template.read_text(encoding="utf-8")
    for key, value in names.items():
        text = text.replace(f"@{key}@", value)
    return text


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def _say(path: Path, *commands: str) -> None:
    sys.stdout.write("\n".join([f"{path} is written. Next:", *(f"  {command}" for command in commands), ""]))


def _comparison(name: str, place: str, loaded: Scene) -> str:
    """Text of a comparison file: each engine that can run the scene, allowed one per cent of each motion."""
    from proofroll.core.number_format import exact
    from proofroll.files.scene_file import read_scene_file
    from proofroll.studies.comparison.default_comparison import able, bounds, times_of

    until, every = times_of(read_scene_file(place))
    lines = (
        f'{_quoted(key)} = "{100 * item.value:g} %"\n'
        if item.relative
        else f'{_quoted(key)} = "{item.value:g} {item.unit}"\n'
        for key, item in bounds(loaded, every).items()
    )
    rows = "".join(f'\n[[rows]]\nengine = "{text}"\ntolerance = "close"\n' for text in able(loaded, preferred=True))
    return (
        f'title = "{name}"\nquestion = "Which engines agree with the truth?"\nscene = {_quoted(place)}\n'
        f"until = {exact(until)}\nevery = {exact(every)}\n\n"
        "# Every combination of these values is run: [vary], then parameter = [value, value].\n\n"
        "# How far an observable may be from the truth, and why.\n"
        "# `proofroll check --keys WORD` describes every key.\n"
        f'[tolerances.close]\nbecause = "a first look; say here why this is close enough"\n'
        f"{''.join(lines)}\n"
        '# What is expected of each engine: expect = "agrees" unless it says another verdict, and because.\n' + rows
    )


def _quoted(text: str) -> str:
    import json

    return json.dumps(text)
