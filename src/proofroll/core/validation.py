"""Checks what files and settings say against typed dataclasses, with one line about the first thing that is wrong."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any, TypeVar, get_args, get_type_hints

from pydantic import ConfigDict, TypeAdapter, ValidationError

from proofroll.core.bounds import OutOfBounds
from proofroll.core.errors import InputError, no_such_key

_T = TypeVar("_T")


def strict(*types: type, finite: bool = False) -> None:
    """Makes unknown keys of these dataclasses an error, with ``finite`` also inf and NaN, as pydantic is told."""
    for kind in types:
        config = ConfigDict(extra="forbid", allow_inf_nan=not finite)
        setattr(kind, "__pydantic_config__", config)  # noqa: B010 -- the name is pydantic's


def validated(kind: type[_T], content: Mapping[str, Any], where: str, **own: object) -> _T:
    """The content of a file, called ``where`` in messages, or of a table in it as this dataclass.

    ``own`` are fields that no file has, for they are known otherwise.

    Raises:
        InputError: the first problem, with its place in ``where``.
    """
    for name in (name for name in content if name in own):
        raise no_such_key(f"{where}: {name}", content[name], _keys(kind, (), own))
    try:
        found: _T = _adapter(kind).validate_python({**content, **own})  # type: ignore[arg-type]  # any class can be hashed
        return found
    except ValidationError as error:
        raise _first_problem(error, where, kind, own) from None


@cache
def _adapter(kind: type) -> TypeAdapter[Any]:
    """What pydantic makes of a type: once, for it costs a hundred times what a check does."""
    return TypeAdapter(kind)


def _tables(kind: Any) -> list[Any]:
    """Dataclasses that a type is, or is a list or a choice of."""
    return [kind] if is_dataclass(kind) else [table for part in get_args(kind) for table in _tables(part)]


def _keys(kind: Any, place: Sequence[str | int], own: Iterable[str]) -> list[str]:
    """The keys of the tables at a place of a type, as files write them."""
    tables = _tables(kind)
    for part in place:
        hints = [get_type_hints(table, include_extras=True) for table in tables]
        inside = [table for hint in hints if part in hint for table in _tables(hint[part])]
        tables = inside or [table for table in tables if getattr(table, "kind", None) == part] or tables
    found = [item.metadata.get("key", item.name) for table in tables for item in fields(table) if item.init]
    return [key for key in dict.fromkeys(found) if place or key not in own]


def _first_problem(error: ValidationError, where: str, kind: type, own: Iterable[str]) -> InputError:
    """One line about the first thing that pydantic found wrong in ``where``."""
    problem = error.errors()[0]
    location = ".".join(str(part) for part in problem["loc"])
    if problem["type"] in {"unexpected_keyword_argument", "extra_forbidden"}:
        return no_such_key(f"{where}: {location}", problem["input"], _keys(kind, problem["loc"][:-1], own))
    if problem["type"] in {"missing", "missing_argument"}:
        return InputError(f"{where}: {location}", "nothing", "this key is required; add it")
    error_found = problem.get("ctx", {}).get("error")
    if isinstance(error_found, OutOfBounds):
        location = ".".join(filter(None, [location, error_found.field]))
        return InputError(f"{where}: {location}", error_found.value, error_found.advice)
    if problem["type"] in {"union_tag_invalid", "union_tag_not_found"}:
        key = problem["ctx"]["discriminator"].strip("'")
        if problem["type"] == "union_tag_not_found":
            return InputError(f"{where}: {location}.{key}", "nothing", "this key is required; add it")
        return InputError(
            f"{where}: {location}.{key}", problem["ctx"]["tag"], f"choose one of {problem['ctx']['expected_tags']}"
        )
    return InputError(f"{where}: {location}", problem["input"], problem["msg"][0].lower() + problem["msg"][1:])


def units_of(*types: type) -> dict[str, str]:
    """Unit of each number of dataclasses whose fields carry one."""
    return {item.name: item.metadata["unit"] for kind in types for item in fields(kind) if "unit" in item.metadata}
