"""Commands of proofroll: those that a text names, and where the package proposes one."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from source_code import nodes
from typer.core import TyperGroup
from typer.main import get_command

from proofroll.cli import app

SOURCE = Path(__file__).parents[2] / "src" / "proofroll"
_SCOPES = (ast.Module, ast.ClassDef, ast.FunctionDef)


@cache
def program() -> TyperGroup:
    """The whole command line."""
    made = get_command(app)
    assert isinstance(made, TyperGroup)
    return made


def unknown_words(text: str) -> list[str]:
    """Commands of proofroll that prose names in code and that are not there, and options that their command lacks."""
    unknown = []
    for name, rest in re.findall(r"`proofroll ([a-z]\w*)([^`\n]*)", text):
        command = program().commands.get(name)
        if command is None:
            unknown.append(name)
            continue
        parts = [command, *(command.commands.values() if isinstance(command, TyperGroup) else ())]
        known = {option for part in parts for item in part.params for option in (*item.opts, *item.secondary_opts)}
        named = re.findall(r"(?<![\w-])--[a-z][\w-]*", rest)
        unknown += [f"{name} {option}" for option in named if option not in known | {"--help"}]
    return unknown


def proposed() -> Iterator[str]:
    """Each command in a text of the package, and each that it makes of words: ``file: command``.

    What stands in braces of a text is ``{}``; docstrings propose nothing.
    Words given to ``command_line`` are a command, too.
    """
    command = re.compile(rf"proofroll (?:(?:{'|'.join(program().commands)})\b|self)(?:(?!proofroll )[^;`\n])*")
    for path in sorted(SOURCE.rglob("*")):
        place = path.relative_to(SOURCE).as_posix()
        if path.suffix == ".py":
            for text in _texts(nodes(path)):
                yield from (f"{place}: {line.strip()}" for line in command.findall(text))
        elif path.suffix in {".html", ".md", ".toml", ".txt"}:
            text = re.sub(r"{{.*?}}|{%.*?%}", "{}", path.read_text(encoding="utf-8"))
            yield from (f"{place}: {re.split('<|  #', line)[0].strip()}" for line in command.findall(text))


def _texts(found: list[ast.AST]) -> Iterator[str]:
    """Texts of a module but docstrings, and the first words of commands that it makes."""
    bodies = [node.body[0] for node in found if isinstance(node, _SCOPES) and node.body]
    known = {id(item.value) for item in bodies if isinstance(item, ast.Expr)}
    for node in found:
        if isinstance(node, ast.JoinedStr):
            known |= {id(value) for value in node.values}
            yield "".join(str(part.value) if isinstance(part, ast.Constant) else "{}" for part in node.values)
        elif isinstance(node, ast.Call) and ast.unparse(node.func) == "command_line" and node.args:
            yield f"proofroll {ast.unparse(node.args[0]).lstrip('*(').split(',')[0].strip(chr(39))}"
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in known:
            yield node.value
