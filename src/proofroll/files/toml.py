"""TOML files: read with one clear line about what is wrong, and found among the comparisons by what they are for."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from proofroll.core.errors import InputError
from proofroll.files.data_folders import data_folder

# Files of scenes and comparisons have some kB and tables some levels deep: what has more is a mistake, and would take
# long to read or end what reads it.
_MOST_BYTES = 1 << 18
_DEEPEST = 16


def read_toml(path: Path) -> dict[str, Any]:
    """The content of a file.

    Raises:
        InputError: it is broken, far too large or cannot be read.
    """
    try:
        if path.exists() and not path.is_file():  # a pipe would be waited for without end
            raise InputError(str(path), "TOML", "this is no ordinary file")
        with path.open("rb") as file:
            text = file.read(_MOST_BYTES + 1)
        if len(text) > _MOST_BYTES:
            raise InputError(str(path), "TOML", f"the file is larger than {_MOST_BYTES >> 10} kB; shorten it")
        content = tomllib.loads(text.decode())
    except ValueError as error:  # no TOML, no UTF-8, or an integer of thousands of digits
        raise InputError(str(path), "TOML", f"the file is broken: {error}") from None
    except RecursionError:
        raise _too_deep(path) from None
    except OSError as error:
        raise InputError(str(path), "TOML", f"the file cannot be read: {error.strerror}") from None
    level: list[Any] = [content]
    for _ in range(_DEEPEST):  # without recursion, which has an end of its own
        inside = (list(item.values()) if isinstance(item, dict) else item for item in level)
        level = [value for values in inside for value in values if isinstance(value, (dict, list))]
    if level:
        raise _too_deep(path)
    return content


def _too_deep(path: Path) -> InputError:
    return InputError(str(path), "TOML", f"tables and lists are nested more than {_DEEPEST} deep; use fewer levels")


def study_of(path: Path) -> str | None:
    """What a file under ``comparisons/`` is for, its ``study``; None: a comparison, or a file that cannot be read."""
    try:
        study = read_toml(path).get("study")
    except InputError:
        return None  # whoever asks for that file is told what is wrong with it
    return None if study is None else str(study)


def study_files(study: str) -> Iterator[tuple[Path, dict[str, Any]]]:
    """The files under ``comparisons/`` for a study with their content, sorted by name."""
    for path in sorted(data_folder("comparisons").glob("*.toml")):
        if study_of(path) == study:
            yield path, read_toml(path)
