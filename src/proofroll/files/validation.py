"""Checks what a file says against typed dataclasses, with one line about the first thing that is wrong."""

from __future__ import annotations

from dataclasses import fields
from functools import cache
from typing import Any, TypeVar

from pydantic import ConfigDict, TypeAdapter, ValidationError

from proofroll.core.bounds import OutOfBounds
from proofroll.core.errors import InputError

_T = TypeVar("_T")


def strict(*types: type) -> None:
    """Makes unknown keys of these dataclasses an error; it is how pydantic is told about stdlib dataclasses."""
    for kind in types:
        setattr(kind, "__pydantic_config__", ConfigDict(extra="forbid"))  # noqa: B010 -- the name is pydantic's


def validated(kind: type[_T], content: object, where: str) -> _T:
    """The content as this type.

    Raises:
        InputError: the first problem, with its place in ``where``.
    """
    try:
        found: _T = _adapter(kind).validate_python(content)  # type: ignore[arg-type]  # any class can be hashed
        return found
    except ValidationError as error:
        raise _first_problem(error, where) from None


@cache
def _adapter(kind: type) -> TypeAdapter[Any]:
    """What pydantic makes of a type: once, for it costs a hundred times what a check does."""
    return TypeAdapter(kind)


def _first_problem(error: ValidationError, where: str) -> InputError:
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


def units_of(*types: type) -> dict[str, str]:
    """Unit of each number of dataclasses whose fields carry one."""
    return {item.name: item.metadata["unit"] for kind in types for item in fields(kind) if "unit" in item.metadata}
