"""Checks the content of files and settings against typed dataclasses, with one line about the first mistake."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Annotated, Any, TypeVar, get_args, get_type_hints

from pydantic import BeforeValidator, ConfigDict, TypeAdapter, ValidationError

from proofroll.core.bounds import OutOfBounds
from proofroll.core.errors import InputError, no_such_key
from proofroll.core.parameters import Unit
from proofroll.core.quantity import OR

_T = TypeVar("_T")
# Number that may be infinite (friction without a bound); JSON writes null for infinity.
FloatOrInf = Annotated[float, BeforeValidator(lambda value: math.inf if value is None else value)]
# Beginning of a type of error in pydantic -> advice to the user, if it is better than pydantic's own.
_WORDS = {
    "int": "give a whole number",
    "float": "give a number",
    "finite": "give a finite number",
    "string": "give a text",
    "bool": "give true or false",
    "list": "give a list: [value, value]",
    "tuple": "give a list: [value, value]",
    "dict": "give a table of names and values",
    "mapping": "give a table of names and values",
    "missing": "the list is too short; add the missing entries",
    "dataclass": "give a table of names and values",
}

_UNKNOWN = ("unexpected_keyword_argument", "extra_forbidden")


def strict(*types: type, finite: bool = False) -> None:
    """Makes unknown keys of these dataclasses an error for pydantic, and with ``finite`` also inf and NaN."""
    for kind in types:
        config = ConfigDict(extra="forbid", allow_inf_nan=not finite)
        setattr(kind, "__pydantic_config__", config)  # noqa: B010 -- the name is pydantic's


def validated(kind: type[_T], content: Mapping[str, Any], place: str, **program_values: object) -> _T:
    """A dataclass filled with the content of a file, or of a table in it.

    Args:
        kind: the dataclass.
        content: key -> value.
        place: name of the file, for messages.
        program_values: fields whose values the program knows; the file must not have them.

    Raises:
        InputError: the first mistake, with its location.
    """
    for name in (name for name in content if name in program_values):
        raise no_such_key(f"{place}: {name}", content[name], _keys(kind, (), program_values))
    try:
        content_of_kind: _T = _adapter(kind).validate_python({**content, **program_values})  # type: ignore[arg-type]  # any class can be hashed
    except ValidationError as error:
        raise _first_problem(error, place, kind, content, program_values) from None
    except OverflowError:
        raise InputError(place, content, "a product or power of its numbers is too large; give smaller ones") from None
    for location, value in _booleans(content, content_of_kind):
        raise InputError(f"{place}: {'.'.join(location)}", value, "this is not a number; give one")
    return content_of_kind


def _booleans(content: Any, read: Any, location: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], bool]]:
    """Every true and false that pydantic took for a number."""
    if isinstance(content, bool) and not isinstance(read, bool):
        yield location, content
    parts = content if isinstance(content, Mapping) else dict(enumerate(content if isinstance(content, list) else ()))
    for name, item in parts.items():
        inside = read[name] if isinstance(read, (Mapping, list, tuple)) else getattr(read, str(name), item)
        yield from _booleans(item, inside, (*location, str(name)))


@cache
def _adapter(kind: type) -> TypeAdapter[Any]:
    """Pydantic's adapter of a type, cached: to make it costs a hundred times as much as a check."""
    return TypeAdapter(kind)


def _tables(kind: Any) -> list[Any]:
    """Dataclasses in a type: the type itself, or the members of a list or a union."""
    return [kind] if is_dataclass(kind) else [table for part in get_args(kind) for table in _tables(part)]


def _keys(kind: Any, location: Sequence[str | int], own_keys: Iterable[str]) -> list[str]:
    """Allowed keys of the tables at a location in a type, as files spell them."""
    tables = _tables(kind)
    for part in location:
        hints = [get_type_hints(table, include_extras=True) for table in tables]
        inside = [table for hint in hints if part in hint for table in _tables(hint[part])]
        tables = inside or [table for table in tables if getattr(table, "kind", None) == part] or tables
    keys = [item.metadata.get("key", item.name) for table in tables for item in fields(table) if item.init]
    return [key for key in dict.fromkeys(keys) if location or key not in own_keys]


def _location(location: Iterable[str | int], content: Any) -> list[str]:
    """Location of a mistake in a file, without the names of types that pydantic inserts."""
    keys = []
    for part in location:
        inside = isinstance(content, Mapping) and part in content
        inside = inside or (isinstance(content, (list, tuple)) and isinstance(part, int) and part < len(content))
        keys += [str(part)] * inside
        content = content[part] if inside else content
    return keys


def _first_problem(
    error: ValidationError, place: str, kind: type, content: Mapping[str, Any], keys: Iterable[str]
) -> InputError:
    """Error for the first mistake that pydantic found, or for all keys that are missing."""

    def is_absent(entry: Mapping[str, Any]) -> bool:
        return entry["type"] in {"missing", "missing_argument"} and not isinstance(entry["loc"][-1], int)

    def located(entry: Mapping[str, Any]) -> str:
        return ".".join(_location(entry["loc"], content) + [str(part) for part in entry["loc"][-1:]] * is_absent(entry))

    # An unknown key goes before a missing one, as it may be the missing one misspelt.
    problem = min(error.errors(), key=lambda entry: entry["type"] not in _UNKNOWN)
    location, absent = located(problem), is_absent(problem)
    if problem["type"] in _UNKNOWN:
        return no_such_key(f"{place}: {location}", problem["input"], _keys(kind, problem["loc"][:-1], keys))
    if absent:
        # a type in the place of a key is one of several that the table might be, whose keys may be another's
        plain = {".".join(map(str, entry["loc"])) for entry in error.errors() if is_absent(entry)}
        names = [name for name in map(located, error.errors()) if name in plain - {location}]
        others = "".join(f", {name}" for name in names)
        return InputError(f"{place}: {location}", None, f"this key is required; add it{others}")
    error_found = problem.get("ctx", {}).get("error")
    if isinstance(error_found, OutOfBounds):
        location = ".".join(filter(None, [location, error_found.field]))
        return InputError(f"{place}: {location}", error_found.value, error_found.advice)
    if problem["type"] in {"union_tag_invalid", "union_tag_not_found"}:
        key = problem["ctx"]["discriminator"].strip("'")
        if problem["type"] == "union_tag_not_found":
            return InputError(f"{place}: {location}.{key}", None, "this key is required; add it")
        return InputError(
            f"{place}: {location}.{key}", problem["ctx"]["tag"], f"choose one of {problem['ctx']['expected_tags']}"
        )
    return InputError(f"{place}: {location}", problem["input"], advice(problem["type"], problem["msg"]))


def advice(kind: str, message: str) -> str:
    """Advice for an error of pydantic, from its type and its message."""
    words = message.removeprefix("Value error, ").replace("Input should", "it must").replace(" after validation", "")
    words = words.replace("Tuple ", "the list ").replace("List ", "the list ")
    return _WORDS.get(kind.partition("_")[0], words[0].lower() + words[1:])


def units_of(*types: type) -> dict[str, str]:
    """Key -> unit, for the fields of dataclasses that carry a unit."""
    return {item.name: item.metadata["unit"] for kind in types for item in fields(kind) if "unit" in item.metadata}


def units_of_kind(table: type, kind: object) -> dict[str, Unit]:
    """Key -> unit of each number of a dataclass whose units may depend on the ``kind`` that the file names."""
    units = {item.name: item.metadata.get("unit", "") for item in fields(table)}
    return {name: unit.get(str(kind), "") if isinstance(unit, Mapping) else unit for name, unit in units.items()}


def all_units_of(*types: type) -> dict[str, str]:
    """Every unit that a number of these dataclasses may have, by ``key``, ``key.kind`` or ``key.kind.index``."""
    units: dict[str, str] = {}
    for kind_of_record in types:
        for item in fields(kind_of_record):
            unit = item.metadata.get("unit", "")
            for kind, unit_text in unit.items() if isinstance(unit, Mapping) else [("", unit)]:
                for index, unit_part in enumerate(unit_text.split(OR) if isinstance(unit_text, str) else unit_text):
                    units[".".join(filter(None, [item.name, kind, str(index or "")]))] = unit_part
    return {name: unit for name, unit in units.items() if unit}
