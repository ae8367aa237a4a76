"""Reads ``models/<scene>/scene.toml`` into a :class:`~proofroll.scene.Scene`, with the user's parameters set."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError

from proofroll.bounds import OutOfBounds
from proofroll.errors import InputError, choices
from proofroll.folders import data_folder
from proofroll.scene import Ball, Contact, Gravity, InitialMotion, Scene
from proofroll.surfaces import AnySurface
from proofroll.toml_file import read_toml


@dataclass(frozen=True)
class Parameter:
    """A number that a user may set by name.

    Attributes:
        value: default, or the name of the parameter whose value is the default.
        unit, symbol, meaning, source: for a person.
        above, at_least, below, at_most: bounds, as numbers or names of other parameters.
        nonzero: why the value must not be zero.
        unbounded: whether inf is allowed.
    """

    value: float | str
    unit: str
    meaning: str
    source: str
    symbol: str = ""
    above: float | str | None = None
    at_least: float | str | None = None
    below: float | str | None = None
    at_most: float | str | None = None
    nonzero: str | None = None
    unbounded: bool = False


@dataclass(frozen=True)
class SceneFile:
    """The contents of a ``scene.toml`` before parameters are set."""

    title: str
    source: str
    parameters: dict[str, Parameter]
    balls: list[dict[str, Any]]
    surfaces: list[dict[str, Any]]
    gravity: dict[str, Any]
    contacts: list[dict[str, Any]]
    initial: list[dict[str, Any]]
    asks: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class _Mechanics:
    balls: tuple[Ball, ...]
    surfaces: tuple[Annotated[AnySurface, Field(discriminator="kind")], ...]
    gravity: Gravity
    contacts: tuple[Contact, ...]
    initial: tuple[InitialMotion, ...]


_T = TypeVar("_T")

_STRICT = ConfigDict(extra="forbid")
for _typed in (Parameter, SceneFile, _Mechanics, Ball, Contact, Gravity, InitialMotion, *AnySurface.__args__):
    _typed.__pydantic_config__ = _STRICT  # how pydantic is told about stdlib dataclasses

# Unit of each number of the mechanics by its key; nothing is converted.
_UNITS: dict[str, str] = {
    item.name: item.metadata["unit"]
    for kind in (Ball, Contact, Gravity, InitialMotion, *AnySurface.__args__)
    for item in fields(kind)
    if "unit" in item.metadata
}
_KNOWN_UNITS = dict.fromkeys([*_UNITS.values(), "s", "N"])


def scene_names() -> list[str]:
    """Names of all scenes, sorted."""
    return sorted(path.parent.name for path in data_folder("models").glob("*/scene.toml"))


def read_scene_file(name: str) -> SceneFile:
    """The scene's file, checked against the vocabulary.

    Args:
        name: a folder under ``models/``, or the path of a folder that holds a ``scene.toml``.

    Raises:
        InputError: there is no such scene, or its file is broken.
    """
    return _parse(scene_folder(name) / "scene.toml")


def scene_folder(name: str) -> Path:
    """Folder of the scene.

    Raises:
        InputError: there is no such scene.
    """
    for folder in (data_folder("models") / name, Path(name)):
        try:
            if name and (folder / "scene.toml").is_file():
                return folder
        except (OSError, ValueError):  # too long for a file system, or a zero byte
            break
    raise InputError("scene", name, f"there is no such scene; choose one of {', '.join(scene_names())}")


def load_scene(name: str, /, *, asks: Any = (), **parameters: float) -> Scene:
    """The scene with some of its parameters set, SI units.

    Args:
        name: a folder under ``models/``, e.g. ``sphere_in_cylinder``, or the path of such a folder.
        asks: names of what is wanted besides the motion and what the scene's own file asks for, e.g.
            ``("orientation",)``. (Typed as Any, for type checkers would not let numbers be unpacked beside it.)
        **parameters: e.g. ``speed=3.3``; see ``proofroll scenes``.

    Raises:
        InputError: unknown scene or parameter, or a value that makes no sense; or nothing of that name can be asked.
    """
    folder = scene_folder(name)
    file = _parse(folder / "scene.toml")
    values = _values(file, parameters)
    where = str(folder / "scene.toml")
    mechanics = _validated(
        _Mechanics,
        {
            key: _substituted(getattr(file, key), file, values, f"{where}: {key}")
            for key in ("balls", "surfaces", "gravity", "contacts", "initial")
        },
        where,
    )
    _check_contacts(mechanics, where)
    return Scene(
        name=folder.name,
        title=file.title,
        balls=mechanics.balls,
        surfaces=mechanics.surfaces,
        contacts=mechanics.contacts,
        gravity=mechanics.gravity,
        initial=mechanics.initial,
        parameters=values,
        folder=folder,
        asks=tuple(dict.fromkeys([*file.asks, *_names(asks)])),
    )


def _names(asks: object) -> list[str]:
    """What is asked for, as a list."""
    if isinstance(asks, str):
        return [asks]
    if not isinstance(asks, Sequence):
        raise InputError("asks", asks, "give a list of names")
    return [str(name) for name in asks]


def _parse(path: Path) -> SceneFile:
    content = read_toml(path)
    file = _validated(SceneFile, content, str(path))
    for name, parameter in file.parameters.items():
        where = f"{path}: parameters.{name}"
        if parameter.unit not in _KNOWN_UNITS:
            advice = f"this unit is not known, and nothing is converted; write the value in {choices(_KNOWN_UNITS)}"
            raise InputError(f"{where}.unit", parameter.unit, advice)
        for key in ("value", "above", "at_least", "below", "at_most"):
            other = getattr(parameter, key)
            if not isinstance(other, str):
                continue
            if other == name or other not in file.parameters:
                known = choices(item for item in file.parameters if item != name)
                advice = f"there is no such parameter to refer to; choose from {known}"
                raise InputError(f"{where}.{key}", other, advice)
            if file.parameters[other].unit != parameter.unit:
                advice = f"its unit is {file.parameters[other].unit}, that of {name} is {parameter.unit}"
                raise InputError(f"{where}.{key}", other, advice)
        _check_end(file, name, f"{where}.value")
    return file


def _check_end(file: SceneFile, name: str, where: str) -> None:
    """The defaults that follow one another end at a number.

    Raises:
        InputError: they go round in a circle.
    """
    passed = [name]
    while isinstance(following := file.parameters[passed[-1]].value, str) and following in file.parameters:
        if following in passed:
            raise InputError(where, " -> ".join([*passed, following]), "this goes round in a circle; give a number")
        passed.append(following)


def _check_contacts(mechanics: _Mechanics, where: str) -> None:
    """Contacts and initial motions name what there is, and what touches fits together.

    Raises:
        InputError: the first name that leads nowhere, or a ball that has no room.
    """
    balls, surfaces = [ball.name for ball in mechanics.balls], [surface.name for surface in mechanics.surfaces]
    for kind, items in (("contacts", mechanics.contacts), ("initial", mechanics.initial)):
        for index, item in enumerate(items):
            for key, known in (("body", balls), ("surface", surfaces)):
                name = getattr(item, key, None)
                if name is not None and name not in known:
                    raise InputError(f"{where}: {kind}.{index}.{key}", name, f"choose one of {', '.join(known)}")
    for index, contact in enumerate(mechanics.contacts):
        ball, wall = mechanics.balls[balls.index(contact.body)], mechanics.surfaces[surfaces.index(contact.surface)]
        try:
            wall.offset(ball.radius)
        except InputError as error:
            raise error.within(f"{where}: contacts.{index}", contact.body) from None


def _validated(kind: type[_T], content: object, where: str) -> _T:
    try:
        return TypeAdapter(kind).validate_python(content)
    except ValidationError as error:
        raise first_problem(error, where) from None


def first_problem(error: ValidationError, where: str) -> InputError:
    """One line about the first thing that pydantic found wrong in ``where``."""
    problem = error.errors()[0]
    location = ".".join(str(part) for part in problem["loc"])
    if problem["type"] in {"unexpected_keyword_argument", "extra_forbidden"}:
        return InputError(f"{where}: {location}", problem["input"], "there is no such key here; remove it")
    if problem["type"] in {"missing", "missing_argument"}:
        return InputError(f"{where}: {location}", "nothing", "this key is required; add it")
    error_found = problem.get("ctx", {}).get("error")
    if isinstance(error_found, OutOfBounds):
        return InputError(f"{where}: {location}.{error_found.field}", error_found.value, error_found.advice)
    if problem["type"] in {"union_tag_invalid", "union_tag_not_found"}:
        key = problem["ctx"]["discriminator"].strip("'")
        if problem["type"] == "union_tag_not_found":
            return InputError(f"{where}: {location}.{key}", "nothing", "this key is required; add it")
        return InputError(
            f"{where}: {location}.{key}", problem["ctx"]["tag"], f"choose one of {problem['ctx']['expected_tags']}"
        )
    return InputError(f"{where}: {location}", problem["input"], problem["msg"][0].lower() + problem["msg"][1:])


def _values(file: SceneFile, given: Mapping[str, object]) -> dict[str, float]:
    """Every parameter's number: given, or default, or that of the parameter it follows."""
    for name, value in given.items():
        if name not in file.parameters:
            raise InputError(name, value, f"there is no such parameter; choose from {choices(file.parameters)}")
    values: dict[str, float] = {}
    for name, parameter in file.parameters.items():
        source = name
        while source not in given and isinstance(following := file.parameters[source].value, str):
            source = following
        values[name] = _number(name, given.get(source, file.parameters[source].value), parameter)
    # Numbers first, then other parameters: a parameter is never blamed for the bad value of another.
    for kind in (float, str):
        for name, parameter in file.parameters.items():
            _check_bounds(name, parameter, values, kind)
    return values


def _number(name: str, value: object, parameter: Parameter) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise InputError(name, value, f"this is not a number; give one in {parameter.unit}")
    try:
        number = float(value)
    except (ValueError, OverflowError):
        raise InputError(name, value, f"this is not a number; give one in {parameter.unit}") from None
    if math.isnan(number) or (math.isinf(number) and not (parameter.unbounded and number > 0)):
        raise InputError(name, value, f"the value must be finite; give a number in {parameter.unit}")
    if parameter.nonzero is not None and number == 0:
        raise InputError(name, value, f"{parameter.nonzero}; give a value other than 0 {parameter.unit}")
    return number


_Bound = tuple[str, float | str | None, Callable[[float, float], bool]]


def _check_bounds(name: str, parameter: Parameter, values: Mapping[str, float], kind: type) -> None:
    value = values[name]
    bounds: tuple[_Bound, ...] = (
        ("above", parameter.above, operator.gt),
        ("at least", parameter.at_least, operator.ge),
        ("below", parameter.below, operator.lt),
        ("at most", parameter.at_most, operator.le),
    )
    for words, bound, holds in bounds:
        if bound is None or not isinstance(bound, kind):
            continue
        limit = values[bound] if isinstance(bound, str) else bound
        if not holds(value, limit):
            shown = f"{bound} = {limit:g}" if isinstance(bound, str) else f"{limit:g}"
            unit = "" if parameter.unit == "1" else f" {parameter.unit}"
            raise InputError(name, value, f"{parameter.meaning} must be {words} {shown}{unit}")


def _substituted(content: Any, file: SceneFile, values: Mapping[str, float], where: str, unit: str = "") -> Any:
    """The content with each ``$name`` replaced by its number, which must have the unit of its place."""
    if isinstance(content, dict):
        return {
            key: _substituted(value, file, values, f"{where}.{key}", _UNITS.get(key, ""))
            for key, value in content.items()
        }
    if isinstance(content, list):
        return [_substituted(value, file, values, f"{where}.{index}", unit) for index, value in enumerate(content)]
    if isinstance(content, bool):
        raise InputError(where, content, "this is not a number; give one" + (f" in {unit}" if unit else ""))
    if isinstance(content, str) and content.startswith("$"):
        if content[1:] not in values:
            raise InputError(where, content, f"there is no such parameter; choose from {choices(values)}")
        given = file.parameters[content[1:]].unit
        if unit and given != unit:
            raise InputError(where, content, f"this number is in {unit}, that parameter in {given}")
        return values[content[1:]]
    return content
