"""TOML files: read with one clear line about what is wrong, and found by what they are for."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from proofroll.core.errors import InputError
from proofroll.files.data_folders import study_folders


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
    """What a file is for, its ``study``; None: a comparison, or a file that cannot be read."""
    try:
        study = read_toml(path).get("study")
    except InputError:
        return None  # whoever asks for that file is told what is wrong with it
    return None if study is None else str(study)


def study_files(study: str) -> Iterator[tuple[Path, dict[str, Any]]]:
    """The files for a study with their content, each folder's sorted by name."""
    for folder in study_folders():
        for path in sorted(folder.glob("*.toml")):
            if study_of(path) == study:
                yield path, read_toml(path)


def named_file(name: str) -> Path | None:
    """The file at a path, or the one of this name, with or without ``.toml``, in a folder of studies."""
    places = [Path(name), *(folder / file for folder in study_folders() for file in (f"{name}.toml", name))]
    return next((place for place in places if place.is_file()), None)


def study_file(name: str, study: str) -> tuple[Path, dict[str, Any]]:
    """A file for a study with the rest of its content, by its path, its name, or the scene that it is about.

    Raises:
        InputError: there is none, it is broken, or it is for something else.
    """
    path = named_file(name)
    if path is None:
        ours = {item: content.get("scene") for item, content in study_files(study)}
        path = next((item for item, scene in ours.items() if scene == name), None)
        if path is None:
            advice = f"there is no such file; choose one of {', '.join(item.stem for item in ours)}, or give a path"
            raise InputError(study, name, advice)
    content = read_toml(path)
    if content.pop("study", None) != study:
        raise InputError(str(path), "study", f'only a file with study = "{study}" can be used here')
    return path, content
