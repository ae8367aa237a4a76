"""TOML files: reading with one clear line about the first mistake, writing plain tables, finding those of a study."""

import json
import math
import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from proofroll.core.errors import InputError
from proofroll.files.data_folders import study_folders

# Limits on a file's size and nesting, far above those of real files: beyond them reading is slow or recurses too deep.
_MOST_BYTES = 1 << 18
_DEEPEST = 16
_LONGEST_LINE = 80  # characters that a message shows of a file's line


def read_toml(path: Path) -> dict[str, Any]:
    """Content of a file. Raises InputError if it is broken, too large or unreadable."""
    try:
        if path.exists() and not path.is_file():  # reading a pipe would block
            raise InputError("file", path, "this is no ordinary file")
        with path.open("rb") as file:
            text = file.read(_MOST_BYTES + 1)
        if len(text) > _MOST_BYTES:
            raise InputError("file", path, f"the file is larger than {_MOST_BYTES >> 10} kB; shorten it")
        lines = text.decode("utf-8-sig")  # some editors begin with a byte-order mark
        content = tomllib.loads(lines)
    except UnicodeDecodeError:
        raise InputError("file", path, "the file is broken: it is no text in UTF-8") from None
    except ValueError as error:  # no TOML, or an integer of thousands of digits
        raise InputError("file", path, f"the file is broken: {error}{_line_of(error, lines)}") from None
    except RecursionError:
        raise _too_deep(path) from None
    except OSError as error:
        raise InputError("file", path, f"the file cannot be read: {error.strerror}") from None
    level: list[Any] = [content]
    for _ in range(_DEEPEST):  # a loop, as recursion is limited
        inside = (list(item.values()) if isinstance(item, dict) else item for item in level)
        level = [value for values in inside for value in values if isinstance(value, (dict, list))]
    if level:
        raise _too_deep(path)
    return content


def _line_of(error: ValueError, text: str) -> str:
    """Clause with the line of a text that an error names; empty if it names none."""
    number = re.search(r"\(at line (\d+)", str(error))
    if number is None:
        return ""
    line = text.splitlines()[int(number[1]) - 1].strip()
    return f": {line if len(line) <= _LONGEST_LINE else f'{line[:_LONGEST_LINE]}…'}"


def _too_deep(path: Path) -> InputError:
    return InputError("file", path, f"tables and lists are nested more than {_DEEPEST} deep; use fewer levels")


def study_of(path: Path) -> str | None:
    """Name of the study that a file belongs to; None: it is a comparison, or cannot be read."""
    try:
        study = read_toml(path).get("study")
    except InputError:
        return None  # the error is reported when the file itself is read
    return None if study is None else str(study)


def study_files(study: str) -> Iterator[tuple[Path, dict[str, Any]]]:
    """Path and content of the files of a study, sorted by name within each folder."""
    for folder in study_folders():
        for path in sorted(folder.glob("*.toml")):
            if study_of(path) == study:
                yield path, study_content(path, study)


def study_content(path: Path, study: str) -> dict[str, Any]:
    """Content of a file of a study, without the key ``study``.

    Raises:
        InputError: the file is broken, or belongs to another study.
    """
    content = read_toml(path)
    kind = content.pop("study", None)
    if kind != study:
        raise InputError(f"{path}: study", kind, f'only a file with study = "{study}" can be used here')
    return content


def named_file(name: str) -> Path | None:
    """Path of the file of a study or comparison, from a path or from its name with or without ``.toml``; or None.

    A path never means a shipped file; a name with its folder, as ``mechanisms/stop``, does unless there is such a path.
    """
    path = Path(name)
    is_plain = name == path.as_posix() and not path.is_absolute() and ".." not in path.parts
    folders = study_folders() if name == path.name or (is_plain and not path.exists()) else ()
    paths = [path, *(folder / file for folder in folders for file in (f"{name}.toml", name))]
    return next((path for path in paths if path.is_file() and path.name != "scene.toml"), None)


def study_file(name: str, study: str) -> tuple[Path, dict[str, Any]]:
    """Path and content of a file of a study, by its path, its name, or its scene.

    Raises:
        InputError: there is none, it is broken, or it belongs to another study.
    """
    path = named_file(name)
    if path is None:
        ours = {item: content.get("scene") for item, content in study_files(study)}
        path = next((item for item, scene in ours.items() if scene == name), None)
        if path is None:
            advice = f"there is no such file; choose one of {', '.join(item.stem for item in ours)}, or give a path"
            raise InputError(study, name, advice)
    return path, study_content(path, study)


def toml_text(content: Mapping[str, Any]) -> str:
    """Text of a TOML file: numbers, texts and lists first, then tables and lists of tables.

    Args:
        content: name -> number, text, bool, list of these, table, or list of tables.
    """
    plain = {name: value for name, value in content.items() if not _is_table(value)}
    lines = [f"{name} = {_value(value)}" for name, value in plain.items()]
    for name, value in content.items():
        if name in plain:
            continue
        header, tables = (f"[{name}]", [value]) if isinstance(value, Mapping) else (f"[[{name}]]", value)
        for table in tables:
            lines += ["", header, *(f"{key} = {_value(item)}" for key, item in table.items())]
    return "\n".join(lines) + "\n"


def _is_table(value: object) -> bool:
    return isinstance(value, Mapping) or (isinstance(value, list) and bool(value) and isinstance(value[0], Mapping))


def _value(value: Any) -> str:
    """A value as TOML writes it; an inner table in braces."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_value(item)}" for key, item in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_value, value)) + "]"
    if isinstance(value, str):
        return json.dumps(str(value), ensure_ascii=False)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float) and not math.isfinite(value):
        return "nan" if math.isnan(value) else "inf" if value > 0 else "-inf"
    return repr(float(value)) if isinstance(value, float) else repr(value)  # numpy's float has another text
