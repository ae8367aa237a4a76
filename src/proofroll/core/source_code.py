"""Hashes of the source code that a stored result depends on: a change of the code makes the result invalid."""

import ast
import dataclasses
import hashlib
import sys
from collections.abc import Iterable, Iterator, Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

OWN = Path(__file__).resolve().parents[1]


def package_of(kind: type) -> Path | None:
    """Folder of the outermost package of a class, or file of its module outside packages.

    None for a class that was typed at a prompt.
    """
    name = getattr(sys.modules.get(kind.__module__), "__file__", None)
    if name is None:
        return None
    file = Path(name).resolve()
    if not (file.parent / "__init__.py").is_file():
        return file
    return next(folder for folder in file.parents if not (folder.parent / "__init__.py").is_file())


def code_of(item: Any) -> list[str]:
    """Hashes of the other packages that define dataclasses found in ``item`` at any depth; this package is left out."""
    paths = {package_of(kind) for kind in set(_kinds(item))}
    return sorted(hash_of(with_imports(path)) for path in paths - {None, OWN} if path is not None)


def with_imports(path: Path) -> list[Path]:
    """A module or package outside this one and, at any depth, the modules and packages that it imports, sorted.

    The standard library, this package and other installed packages are left out.
    """
    sources, waiting = set[Path](), [path]
    while waiting:
        sources.add(source := waiting.pop())
        files = source.rglob("*.py") if source.is_dir() else [source]
        names = {name for file in files for name in _imported(file)} - sys.stdlib_module_names
        waiting += {origin for name in names if (origin := _source(name)) is not None} - sources - {OWN}
    return sorted(sources)


def _imported(file: Path) -> Iterator[str]:
    """Top-level names of the modules that a file imports, also inside functions."""
    for node in ast.walk(ast.parse(file.read_bytes())):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        if isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names = [node.module]
        yield from (name.partition(".")[0] for name in names)


def _source(name: str) -> Path | None:
    """File of a module, or folder of a package that is not installed; None if there is neither."""
    try:
        spec = find_spec(name)
    except (ImportError, ValueError):  # a module that was made without a file
        return None
    if spec is None or not (spec.origin or "").endswith(".py"):
        return None
    file = Path(str(spec.origin)).resolve()
    installed = {"site-packages", "dist-packages"} & set(file.parts)
    if file.name != "__init__.py":
        return file
    return None if installed else file.parent


def _kinds(item: Any) -> Iterator[type]:
    if dataclasses.is_dataclass(item) and not isinstance(item, type):
        yield type(item)
        for field in dataclasses.fields(item):
            yield from _kinds(getattr(item, field.name))
    elif isinstance(item, Mapping):
        yield from _kinds(list(item.values()))
    elif isinstance(item, (list, tuple, set, frozenset)):
        for part in item:
            yield from _kinds(part)


def hash_of(paths: Iterable[Path], aside: frozenset[str] = frozenset()) -> str:
    """Hash of Python files and of all Python files in folders.

    Modules and folders whose name is in ``aside`` are left out at any depth. So are modules ``robot_…``, which read
    robot files and affect no result.
    """
    content = hashlib.sha256()
    for path in paths:
        for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
            named = set(file.relative_to(path.parent).with_suffix("").parts)
            if not (aside & named or file.stem.startswith("robot_")):
                content.update(file.read_bytes())
    return content.hexdigest()[:16]
