"""TOML files: read with one clear line about what is wrong, and found among the comparisons by what they are for."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from proofroll.core.errors import InputError
from proofroll.files.data_folders import data_folder


def read_toml(path: Path) -> dict[str, Any]:
    """The content of a file.

    Raises:
        InputError: it is broken or cannot be read.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(str(path), "TOML", f"the file is broken: {error}") from None
    except OSError as error:
        raise InputError(str(path), "TOML", f"the file cannot be read: {error.strerror}") from None


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
