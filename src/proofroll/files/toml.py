"""TOML files: read with one clear line about what is wrong, and found by what they are for."""

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from proofroll.core.errors import InputError
from proofroll.files.data_folders import study_folders

# Files of scenes and comparisons have some kB and tables some levels deep: what has more is a mistake, and would take
# long to read or end what reads it.
_MOST_BYTES = 1 << 18
_DEEPEST = 16


def read_toml(path: Path) -> dict[str, Any]:
    """The content of a file. Raises InputError if it is broken, far too large or cannot be read."""
    try:
        if path.exists() and not path.is_file():  # a pipe would be waited for without end
            raise InputError("file", path, "this is no ordinary file")
        with path.open("rb") as file:
            text = file.read(_MOST_BYTES + 1)
        if len(text) > _MOST_BYTES:
            raise InputError("file", path, f"the file is larger than {_MOST_BYTES >> 10} kB; shorten it")
        content = tomllib.loads(text.decode())
    except UnicodeDecodeError:
        raise InputError("file", path, "the file is broken: it is no text in UTF-8") from None
    except ValueError as error:  # no TOML, or an integer of thousands of digits
        raise InputError("file", path, f"the file is broken: {error}") from None
    except RecursionError:
        raise _too_deep(path) from None
    except OSError as error:
        raise InputError("file", path, f"the file cannot be read: {error.strerror}") from None
    level: list[Any] = [content]
    for _ in range(_DEEPEST):  # without recursion, which has an end of its own
        inside = (list(item.values()) if isinstance(item, dict) else item for item in level)
        level = [value for values in inside for value in values if isinstance(value, (dict, list))]
    if level:
        raise _too_deep(path)
    return content


def _too_deep(path: Path) -> InputError:
    return InputError("file", path, f"tables and lists are nested more than {_DEEPEST} deep; use fewer levels")


def study_of(path: Path) -> str | None:
    """Study of a file; None: a comparison, or a file that cannot be read."""
    try:
        study = read_toml(path).get("study")
    except InputError:
        return None  # whoever asks for that file is told what is wrong with it
    return None if study is None else str(study)


def study_files(study: str) -> Iterator[tuple[Path, dict[str, Any]]]:
    """The files for a study with the rest of their content, each folder's sorted by name."""
    for folder in study_folders():
        for path in sorted(folder.glob("*.toml")):
            if study_of(path) == study:
                yield path, study_content(path, study)


def study_content(path: Path, study: str) -> dict[str, Any]:
    """Content of a file for a study, without the name of the study.

    Raises:
        InputError: it is broken, or for something else.
    """
    content = read_toml(path)
    given = content.pop("study", "nothing")
    if given != study:
        raise InputError(f"{path}: study", given, f'only a file with study = "{study}" can be used here')
    return content


def named_file(name: str) -> Path | None:
    """File of a study: at a path, or by its name in a folder of studies, with or without ``.toml``."""
    places = [Path(name), *(folder / file for folder in study_folders() for file in (f"{name}.toml", name))]
    return next((place for place in places if place.is_file() and place.name != "scene.toml"), None)


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
    return path, study_content(path, study)
