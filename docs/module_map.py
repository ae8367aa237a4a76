"""Prints or writes the map of modules: the first docstring line of each module, by folder."""

from __future__ import annotations

import ast
import sys
import tokenize
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "src" / "proofroll"
FILE = ROOT / "docs" / "maintain" / "map.md"
_INTRODUCTION = """# Map of modules

Each module of `src/proofroll/` and the first line of its docstring. `docs/module_map.py WORD` prints some of them.
"""


def modules(source: Path = SOURCE) -> dict[str, str]:
    """First docstring line of each module, by its path below ``source``; empty for a module without a docstring."""
    paths = sorted(source.rglob("*.py"), key=lambda path: (path.parent.parts, path.name))
    lines = {}
    for path in paths:
        lines[path.relative_to(source).as_posix()] = _docstring(path).partition("\n")[0]
    return lines


def _docstring(path: Path) -> str:
    """Docstring of a module, read without the rest of it."""
    with path.open(encoding="utf-8") as file:
        for token in tokenize.generate_tokens(file.readline):
            if token.type == tokenize.STRING:
                return str(ast.literal_eval(token.string))
            if token.type not in {tokenize.COMMENT, tokenize.NL}:
                break
    return ""


def document(source: Path = SOURCE) -> str:
    """The map as a page: a section for each folder, a row for each module."""
    parts, section = [_INTRODUCTION], None
    for path, line in modules(source).items():
        folder, _, name = path.rpartition("/")
        if folder != section:
            parts.append(f"\n## `{folder or '.'}/`\n\n| module | content |\n|---|---|\n")
            section = folder
        parts.append(f"| `{name}` | {line.replace('|', '/')} |\n")
    return "".join(parts)


def main(words: list[str]) -> None:
    """Prints the modules whose path or first line holds every word; without words, all."""
    for path, line in modules().items():
        if all(word.lower() in f"{path} {line}".lower() for word in words):
            sys.stdout.write(f"{path}: {line}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
