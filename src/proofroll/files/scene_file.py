"""Reads ``models/<scene>/scene.toml`` into a :class:`~proofroll.core.scene.Scene`, with the user's parameters set.

Files of other formats with a reader (:mod:`proofroll.files.scene_sources`), for example robot files, are scenes, too.
"""

from __future__ import annotations

import dataclasses
import itertools
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from proofroll.core.element import Element
from proofroll.core.errors import InputError, choices, no_such_key
from proofroll.core.gravity import Gravity
from proofroll.core.parameters import Parameters
from proofroll.core.plugins import load_element_kinds
from proofroll.core.scene import Scene
from proofroll.core.time_grid import LATEST
from proofroll.core.validation import strict, units_of, validated
from proofroll.files.data_folders import data_folder
from proofroll.files.json_data import plain
from proofroll.files.scene_parameters import Parameter, check_parameters, units_read, values_of
from proofroll.files.scene_sources import source_of, stem_of
from proofroll.files.toml import named_file, read_toml, toml_text


@dataclass(frozen=True)
class SceneFile:
    """Contents of a ``scene.toml`` before parameters are set.

    Attributes:
        title: description in one line.
        source: origin of the scene, as a reference.
        gravity: the table that all kinds of elements share.
        parameters: numbers that a user sets by name.
        asks: results wanted besides the motion, e.g. ``orientation``.
        reason: purpose of the scene, for a person.
        duration: length of a run that shows the purpose of the scene [s].
        dt: step that is short enough for engines with a fixed one [s]; recommended if a run with a longer one fails,
            and used by a first look.
        every: sampling interval [s] of a first look, where the usual one does not fit the step; None: the usual one.
        files: models beside it in the formats of engines, e.g. ``mujoco_chart.xml``, with the meshes that these read.
        tables: all others, which kinds of elements read.
    """

    title: str
    source: str
    gravity: dict[str, Any]
    parameters: dict[str, Parameter] = field(default_factory=dict)
    asks: list[str] = field(default_factory=list)
    reason: str = ""
    duration: float | None = None
    dt: float | None = None
    every: float | None = None
    files: list[str] = field(default_factory=list)
    tables: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class _GravityTable:
    """Table of gravity, which all kinds of elements share."""

    gravity: Gravity


SCENE_IS_A_FOLDER = "a scene is a folder: put this file into one, under the name scene.toml"
strict(Parameter, SceneFile, Gravity)
_NO_MARKS = "./\\"  # in names, as names of observables and files have them between their parts
_OWN = frozenset(item.name for item in dataclasses.fields(SceneFile)) - {"tables"}


@cache
def _units() -> tuple[str, ...]:
    """All units that a number of a scene may have."""
    kinds = (kind.units.values() for kind in load_element_kinds())
    return tuple(dict.fromkeys([*units_of(Gravity).values(), *itertools.chain.from_iterable(kinds), "s", "N"]))


def scene_names() -> list[str]:
    """Names of all scenes, sorted."""
    return sorted(path.parent.name for path in data_folder("models").glob("*/scene.toml"))


def scene_titles() -> dict[str, str]:
    """Title of each scene under ``models/``, without the rest of its file."""
    folder = data_folder("models")
    heads = {name: (folder / name / "scene.toml").read_text(encoding="utf-8") for name in scene_names()}
    return {name: str(tomllib.loads(head.partition("\n[")[0])["title"]) for name, head in heads.items()}


def read_scene_file(name: str) -> SceneFile:
    """File of a scene, with its keys checked.

    Args:
        name: a folder under ``models/``, or the path of a folder that holds a ``scene.toml``, or of a robot's file.

    Raises:
        InputError: there is no such scene, or its file is broken.
    """
    if (importer := source_of(name)) is not None:  # its tables may need other parameters than the defaults
        source, path = importer
        return _checked({"gravity": {}, **source.content(path)}, path)
    return _read(name, {})[0]


def _read(name: str, asked: Mapping[str, object]) -> tuple[SceneFile, dict[str, float], Path, tuple[str, ...]]:
    """File of a scene, the value of each parameter, the path of the file, and clauses on what the scene omits of it."""
    importer = source_of(name)
    if importer is None:
        path = scene_folder(name) / "scene.toml"
        file = _checked(read_toml(path), path)
        return file, values_of(file.parameters, asked), path, ()
    source, path = importer
    file = _checked({"gravity": {}, **source.content(path)}, path)
    values = values_of(file.parameters, asked)
    tables = dict(source.tables(path, values))
    omitted = tuple(tables.pop("omitted", ()))
    title = "; ".join([file.title, *filter(None, [tables.pop("about", "")])])
    return dataclasses.replace(file, title=title, gravity=tables.pop("gravity"), tables=tables), values, path, omitted


def scene_text(name: str, asked: Mapping[str, object]) -> str:
    """Text of a ``scene.toml`` that is the scene of a file in another format, with numbers in place of parameters.

    Args:
        name: path of the file.
        asked: values of its parameters, those that are not its defaults.

    Raises:
        InputError: no such file, a scene's own file, or one under a controller whose targets are held.
    """
    if source_of(name) is None:
        raise InputError("--as", "scene", f"{name} is no robot file; a scene has its text in its scene.toml")
    file, _, _, omitted = _read(name, asked)
    if file.tables.get("control") is not None:
        raise InputError("--as", "scene", "a scene.toml holds no targets between instants; leave rate out of --control")
    head = {key: value for key in ("title", "source", "reason", "duration") if (value := getattr(file, key))}
    tables = {key: rows for key, rows in plain(file.tables).items() if rows}
    names = {str(row["name"]): "" for rows in tables.values() for row in _rows(rows) if "name" in row}
    for own in names:
        plain_name = own.translate(dict.fromkeys(map(ord, _NO_MARKS), "_"))
        while plain_name != own and plain_name in {*names, *names.values()}:
            plain_name += "_"
        names[own] = plain_name
    content = {**head, "gravity": plain(file.gravity), **_renamed(tables, names)}
    return f"# Not in this scene: {', '.join(omitted)}\n{toml_text(content)}"


def _renamed(content: Any, names: Mapping[str, str]) -> Any:
    """Content with other names; all texts that are a name are meant."""
    if isinstance(content, Mapping):
        return {key: _renamed(item, names) for key, item in content.items()}
    if isinstance(content, list):
        return [_renamed(item, names) for item in content]
    return names.get(content, content) if isinstance(content, str) else content


def scene_folder(name: str) -> Path:
    """Folder of a scene. Raises InputError if there is no such scene."""
    missing = "there is no such scene"
    beside = Path(name).parent if Path(name).name == "scene.toml" else Path(name)
    is_path = str(name) != beside.name  # a path never means a shipped scene
    for folder in (beside,) if is_path else (data_folder("models") / name, beside):
        try:
            if folder.suffix == ".toml" and folder.name != "scene.toml" and folder.is_file():
                raise InputError("scene", name, SCENE_IS_A_FOLDER)
            if name and (folder / "scene.toml").is_file():
                return folder
            if name and folder.is_dir():
                missing = "this folder has no scene.toml; proofroll new scene writes one"
        except (OSError, ValueError):  # the name is too long for the file system, or has a zero byte
            break
    raise InputError("scene", name, f"{missing}; choose one of {choices(scene_names(), name)}")


def means_scene(name: str, *, alone: bool = False) -> bool:
    """True if a name means a scene. A name of both a scene and a comparison means the comparison unless ``alone``.

    Args:
        name: name or path.
        alone: True if the user gave an option that is for scenes only.
    """
    shared = not alone and named_file(name) is not None
    return source_of(name) is not None or (not shared and (is_scene(name) or Path(name).is_dir()))


def is_scene(name: str) -> bool:
    """True if there is a scene, or a file with a scene, of this name; it may be broken."""
    try:
        return source_of(name) is not None or bool(scene_folder(name))
    except InputError:
        return False


def load_scene(name: str, /, *, asks: Any = (), **parameters: float) -> Scene:
    """Scene with some of its parameters set, in SI units.

    Args:
        name: a folder under ``models/``, e.g. ``sphere_in_cylinder``, or the path of such a folder or of a robot file.
        asks: results wanted besides the motion and those that the scene's own file asks for, e.g. ``("orientation",)``.
            (Typed as Any: otherwise type checkers reject ``**numbers`` in the same call.)
        **parameters: e.g. ``speed=3.3``; see ``proofroll scenes``.

    Raises:
        InputError: unknown scene, parameter or question, or a value that makes no sense.
    """
    file, values, path, omitted = _read(name, parameters)
    is_own_file = path.name == "scene.toml"
    place = str(path)
    numbers = Parameters(values, {name: item.unit for name, item in file.parameters.items()})
    gravity = {"gravity": numbers.filled(file.gravity, f"{place}: gravity", units_of(Gravity))}
    requirements = _names(asks)
    try:
        return Scene(
            name=path.parent.name if is_own_file else stem_of(name),
            title=file.title,
            elements=_elements(file.tables, validated(_GravityTable, gravity, place).gravity, numbers, place),
            parameters=values,
            folder=path.parent if is_own_file else Path(),
            asks=tuple(dict.fromkeys([*file.asks, *requirements])),
            files=tuple(sorted(file.files)),
            omitted=omitted,
        )
    except InputError as error:
        if error.field == "asks" and error.value in requirements:
            raise
        wrong = error.of(place)
        if not parameters or not _loads(name, asks):
            raise wrong from None
        *others, last = parameters
        besides = "".join(f", {key} = {values[key]:g}" for key in others)
        raise InputError(last, values[last], f"with this{besides} {wrong}") from None


def _loads(name: str, asks: Any) -> bool:
    """True if a scene is right with its own parameters."""
    try:
        load_scene(name, asks=asks)
    except InputError:
        return False
    return True


def _elements(tables: Mapping[str, Any], gravity: Gravity, numbers: Parameters, place: str) -> tuple[Element, ...]:
    """Elements in the tables of a file, each read by its kind of element."""
    kinds = load_element_kinds()
    elements: list[Element] = []
    for kind, tables_of_kind in zip(kinds, _of_each([kind.tables for kind in kinds], tables, place), strict=True):
        if tables_of_kind:
            elements += kind.read(tables_of_kind, gravity, numbers, place)
    return tuple(elements)


def _of_each(names_by_kind: Sequence[Sequence[str]], tables: Mapping[str, Any], place: str) -> list[dict[str, Any]]:
    """Tables of each kind of element; ``names_by_kind``: names of the tables that each kind reads.

    A table that several kinds read is divided: each row goes to the kind whose things it names.

    Raises:
        InputError: a table is no list of rows, or a row does not name things of exactly one kind.
    """
    shared = {name for name in tables if sum(name in names_of_kind for names_of_kind in names_by_kind) > 1}
    own_tables = [
        {name: tables[name] for name in names_of_kind if name in tables and name not in shared}
        for names_of_kind in names_by_kind
    ]
    named = [
        {str(row["name"]) for rows in names_of_kind.values() for row in _rows(rows) if "name" in row}
        for names_of_kind in own_tables
    ]
    for table in shared:
        if not isinstance(tables[table], list) or len(_rows(tables[table])) < len(tables[table]):
            raise InputError(f"{place}: {table}", tables[table], f"write each row as a table [[{table}]]")
        for index, row in enumerate(_rows(tables[table])):
            texts = [text for value in row.values() for text in (value if isinstance(value, list) else [value])]
            homes = [
                k
                for k, names in enumerate(named)
                if table in names_by_kind[k] and any(str(text) in names for text in texts)
            ]
            if len(homes) != 1:
                advice = "several kinds of elements have such rows; name a table that only one of them has"
                raise InputError(f"{place}: {table}.{index}", row, advice)
            own_tables[homes[0]].setdefault(table, []).append(row)
    return own_tables


def _rows(table: Any) -> list[Mapping[str, Any]]:
    return [row for row in table if isinstance(row, Mapping)] if isinstance(table, list) else []


def _names(asks: object) -> list[str]:
    """List of the results that a scene is asked for."""
    if isinstance(asks, str):
        return [asks]
    if not isinstance(asks, Sequence):
        raise InputError("asks", asks, "give a list of names")
    return [str(name) for name in asks]


def _check_names(tables: Mapping[str, Any], path: Path) -> None:
    """Raises InputError for a name that cannot be part of the name of an observable, or of a column of a file."""
    for table, rows in tables.items():
        for index, row in enumerate(_rows(rows)):
            name = row.get("name", "")
            if isinstance(name, str) and any(mark in name for mark in _NO_MARKS):
                advice = "a name has no dot and no slash, which names of observables and files have between their parts"
                raise InputError(f"{path}: {table}.{index}.name", name, advice)


def _checked(content: Mapping[str, Any], path: Path) -> SceneFile:
    """Content of a file, with all checks that do not need values of parameters."""
    of_scene = {key: value for key, value in content.items() if key in _OWN}
    tables = {key: value for key, value in content.items() if key not in _OWN}
    table_names = [name for kind in load_element_kinds() for name in kind.tables]
    for name, table in tables.items():
        if name not in table_names:
            raise no_such_key(f"{path}: {name}", table, [*sorted(_OWN), *table_names])
    file = validated(SceneFile, of_scene, str(path), tables=tables)
    for name in ("duration", "dt", "every"):
        value = getattr(file, name)
        if value is not None and not 0 < value <= LATEST:
            raise InputError(f"{path}: {name}", value, f"give a positive, finite time in s, at most {LATEST:g} s")
    _check_names(tables, path)
    for own_file in file.files:
        if Path(own_file).name != own_file or not (path.parent / own_file).is_file():
            advice = "there is no such file in the folder of the scene; copy it there, or take out its name"
            raise InputError(f"{path}: files", own_file, advice)
    file = dataclasses.replace(file, parameters=units_read(file.parameters, str(path)))
    check_parameters(file.parameters, _units(), path)
    return file
