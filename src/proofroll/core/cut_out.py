"""Source code cut from proofroll that runs without it: the definitions, of several modules, that a program uses."""

import ast
import dataclasses
import functools
import importlib
import math
import re
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

_OURS = __name__.partition(".")[0]
_COMMENT = re.compile(r"  # (noqa|type: ignore).*$")
# Short replacements for definitions that check input or need many others.
_INSTEAD = {
    "Diverged": "class Diverged(RuntimeError):\n    pass",
    "Refused": "class Refused(RuntimeError):\n    pass",
    "InputError": "class InputError(RuntimeError):\n    pass",
    "read_only": "def read_only(item):\n    return item",
}
_OVERRIDE = "override"  # a decorator for readers and type checkers alone
_Place = tuple[str, str]  # module, name
_Function = ast.FunctionDef | ast.AsyncFunctionDef


class _Module(NamedTuple):
    """Lines of a module, and the definitions and imports at its top."""

    lines: list[str]
    defined: dict[str, ast.stmt]
    imported: dict[str, list[str] | tuple[str, ast.alias]]


class CutOut:
    """Definitions with everything that they need from the package, each once, in executable order.

    Methods and fields of classes are left out unless they are used: a name counts as used if it occurs somewhere as an
    attribute or as a text. Annotations are kept, but what they name is not.

    Attributes:
        head: import statements, none of proofroll.
        text: source of the definitions.
        names: names of the definitions.
        attributes: names of the attributes that the definitions use.
    """

    def __init__(self, objects: Sequence[object], uses: Iterable[str], instead: Mapping[str, str] = {}) -> None:
        """Cuts out the definitions.

        Args:
            objects: functions and classes of the package.
            uses: attributes that the program uses.
            instead: name -> text that replaces its definition.

        Raises:
            ValueError: two definitions have one name, or one cannot be cut out.
        """
        self.attributes = set(uses)
        self._instead = _INSTEAD | dict(instead)
        self._kept: dict[_Place, ast.stmt] = {}
        self._needs: dict[_Place, list[_Place]] = {}
        self._imports: set[str] = set()
        roots = [(getattr(kind, "__module__"), getattr(kind, "__name__")) for kind in objects]  # noqa: B009 -- of any object
        last_count = -1
        while last_count != len(self.attributes):  # what is called grows with what is kept
            last_count = len(self.attributes)
            self._kept, self._needs = {}, {}
            for place in roots:
                self._take(place)
        ordered: dict[_Place, None] = {}
        for place in roots:
            self._order(place, ordered, set())
        self.names = [name for _, name in ordered]
        if twice := {name for name in self.names if self.names.count(name) > 1}:
            raise ValueError(f"two definitions have one name: {', '.join(sorted(twice))}")
        self._imports |= {"import numpy as np", "from types import SimpleNamespace"}  # for literals
        lines = sorted(self._imports, key=lambda line: (line.startswith("from"), line))
        self.head = "\n".join(["from __future__ import annotations", *lines]) + "\n"
        # two names of one statement are one definition
        self.text = "\n".join(dict.fromkeys(self._source(place) for place in ordered))
        if f" {_OURS}" in self.text:
            raise ValueError(f"an import of {_OURS} is inside a definition among {', '.join(self.names)}")

    def literal(self, value: Any) -> str:
        """Expression for a value; an object of a foreign class becomes a namespace of the attributes in use."""
        value = value.item() if isinstance(value, np.generic) else value
        if isinstance(value, np.ndarray):
            return f"np.array({self.literal(value.tolist())})"
        if isinstance(value, (list, tuple)):
            inner = "".join(f"{self.literal(item)}, " for item in value)
            return f"({inner})" if isinstance(value, tuple) else f"[{inner}]"
        if isinstance(value, dict):
            return "{" + ", ".join(f"{key!r}: {self.literal(item)}" for key, item in value.items()) + "}"
        if value is None or isinstance(value, (bool, int, float, str, slice)):
            return f"float('{value}')" if isinstance(value, float) and not math.isfinite(value) else repr(value)
        if (kind := type(value).__name__) in self.names:
            members = {field.name: getattr(value, field.name) for field in dataclasses.fields(value) if field.init}
        else:
            kind, names = "SimpleNamespace", self.attributes.intersection(dir(value))
            members = {name: getattr(value, name) for name in sorted(names) if not name.startswith("_")}
            members = {name: entry for name, entry in members.items() if not callable(entry)}
        return f"{kind}({', '.join(f'{name}={self.literal(entry)}' for name, entry in members.items())})"

    def _take(self, place: _Place) -> _Place | None:
        """Keeps a definition with all that it needs; returns its place, or None if it is imported or a builtin."""
        module, name = place
        if name in self._instead:
            place = "", name
            if place not in self._kept:
                self._kept[place], self._needs[place] = ast.Pass(), []
            return place
        read = _read(module)
        if name in read.imported and name != _OVERRIDE:
            source = read.imported[name]
            if isinstance(source, list):
                self._imports |= set(source)
            elif source[0].partition(".")[0] == _OURS:
                if name != source[1].name:
                    raise ValueError(f"{module} takes {source[1].name} under another name: {name}")
                if name not in {*self._instead, *_read(source[0]).defined, *_read(source[0]).imported}:
                    raise ValueError(f"{module} takes the whole module {name}, which cannot be cut out")
                return self._take((source[0], name))
            else:
                self._imports.add(f"from {source[0]} import {ast.unparse(source[1])}")
            return None
        if name not in read.defined:
            return None  # Python's own
        if place in self._kept:
            return place
        node = read.defined[name]
        self._kept[place] = node
        names, attributes = _asked(node, self._drops(node))
        self.attributes |= attributes
        needs = [self._take((module, need)) for need in names if need != name]
        self._needs[place] = [need for need in needs if need is not None]
        return place

    def _drops(self, node: ast.stmt) -> list[ast.stmt]:
        """Statements of a class body that nothing uses."""
        if not isinstance(node, ast.ClassDef):
            return []
        return [part for part in node.body if (name := _optional(part)) and name not in self.attributes]

    def _order(self, place: _Place, ordered: dict[_Place, None], begun: set[_Place]) -> None:
        """Appends a definition to the order, after all that it needs."""
        if place in begun:
            return
        begun.add(place)
        for need in self._needs[place]:
            self._order(need, ordered, begun)
        ordered[place] = None

    def _source(self, place: _Place) -> str:
        """Text of a definition without unused members and lint comments; of docstrings only the first line."""
        module, name = place
        if not module:
            return self._instead[name].strip("\n") + "\n"
        lines, node = _read(module).lines, self._kept[place]
        gone = set[int]()
        for dropped in self._drops(node):
            head = _first(dropped)
            while lines[head - 2].lstrip().startswith("#"):
                head -= 1
            gone |= set(range(head - (not lines[head - 2].strip()), (dropped.end_lineno or head) + 1))
        docstrings = _docstrings(node, gone)
        for head, last in docstrings:
            gone |= set(range(head + 1, last + 1))
        short = {head: text for (head, _), text in docstrings.items()}
        kept, begin = list[str](), _first(node)
        while lines[begin - 2].startswith("#"):  # comment above a constant
            begin -= 1
        for number in range(begin, (node.end_lineno or 0) + 1):
            if number not in gone and short.get(number, "-") and lines[number - 1].strip() != f"@{_OVERRIDE}":
                kept.append(short.get(number) or _COMMENT.sub("", lines[number - 1]))
        text = "\n".join(kept)
        if isinstance(node, ast.ClassDef) and not ast.unparse(ast.parse(text + "\n    pass")).count("\n    "):
            text += "\n    pass"
        return re.sub(r":\n\n+", ":\n", re.sub(r"\n{3,}", "\n\n", text)) + "\n"


def _docstrings(node: ast.stmt, gone: set[int]) -> dict[tuple[int, int], str]:
    """First and last line of each docstring -> its first line as code; empty if that line refers to proofroll."""
    first_lines = {}
    for part in ast.walk(node):
        words = ast.get_docstring(part) if isinstance(part, (_Function, ast.ClassDef)) else None
        if not words or (docstring := part.body[0]).lineno in gone:  # type: ignore[attr-defined]  # it has a docstring
            continue
        text = words.partition("\n")[0]
        elsewhere = ":`" in text or _OURS in text
        text = f'"""{text}"""' if not elsewhere else "..." if len(part.body) == 1 else ""  # type: ignore[attr-defined]
        first_lines[docstring.lineno, docstring.end_lineno] = text and " " * docstring.col_offset + text
    return first_lines


@functools.cache
def _read(module: str) -> _Module:
    importlib.import_module(module)
    path = sys.modules[module].__file__ or ""
    text = Path(path).read_text(encoding="utf-8")
    defined: dict[str, ast.stmt] = {}
    imported: dict[str, Any] = {}
    for node in ast.parse(text).body:
        if isinstance(node, ast.ImportFrom) and node.module:
            imported |= {alias.asname or alias.name: (node.module, alias) for alias in node.names}
        elif isinstance(node, ast.Import):
            for alias in node.names:
                imported.setdefault(alias.asname or alias.name.partition(".")[0], []).append(ast.unparse(node))
        elif isinstance(node, (_Function, ast.ClassDef)):
            defined[node.name] = node
        elif isinstance(node, (ast.Assign, ast.AnnAssign)):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            defined |= {
                alias.id: node for target in targets for alias in ast.walk(target) if isinstance(alias, ast.Name)
            }
    return _Module(text.splitlines(), defined, imported)


def _first(node: ast.stmt) -> int:
    """First line of a statement with its decorators."""
    decorators: list[ast.expr] = getattr(node, "decorator_list", [])
    return min([node.lineno, *(decorator.lineno for decorator in decorators)])


def _optional(part: ast.stmt) -> str:
    """Name of a method or class variable that may be left out; empty: it stays."""
    if isinstance(part, _Function):
        # checks in __post_init__ have passed already for the values in the program
        return "" if part.name.startswith("__") and part.name != "__post_init__" else part.name
    declared = isinstance(part, ast.AnnAssign) and isinstance(part.target, ast.Name)
    if declared and ast.unparse(part.annotation).startswith("ClassVar"):  # type: ignore[attr-defined]  # it is an AnnAssign
        return str(part.target.id)  # type: ignore[attr-defined]
    return ""


def _asked(node: ast.AST, drops: Sequence[ast.AST]) -> tuple[list[str], set[str]]:
    """Names that a statement needs to be executed and called, and attributes that it uses."""
    names, attributes, bound = dict[str, None](), set[str](), set[str]()
    for part in _parts(node, drops):
        if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Load):
            names[part.id] = None
        elif isinstance(part, ast.Name):
            bound.add(part.id)
        elif isinstance(part, ast.arg):
            bound.add(part.arg)
        elif isinstance(part, ast.Attribute):
            attributes.add(part.attr)
        elif isinstance(part, ast.Constant) and isinstance(part.value, str) and part.value.isidentifier():
            attributes.add(part.value)
    # a local variable of a function may have the name of a definition; in a class body such a name is needed
    return [name for name in names if name not in bound or isinstance(node, ast.ClassDef)], attributes


def _parts(node: ast.AST, drops: Sequence[ast.AST]) -> Iterator[ast.AST]:
    """All nodes of a statement except annotations and the dropped ones."""
    yield node
    for field, value in ast.iter_fields(node):
        if field in {"annotation", "returns"}:
            continue
        for part in value if isinstance(value, list) else [value]:
            if isinstance(part, ast.AST) and part not in drops:
                yield from _parts(part, drops)
