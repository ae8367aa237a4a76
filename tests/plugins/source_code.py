"""Syntax trees of modules, parsed once in a process for all tests that read them."""

from __future__ import annotations

import ast
import gc
from collections.abc import Callable, Iterator
from functools import cache, wraps
from pathlib import Path
from typing import TypeVar

Made = TypeVar("Made")
# Folders of packages beside src that bring commands or options, each with the package proofroll_<folder>.
PACKAGES = ("balance", "cluster", "fuzz", "throughput")


def _kept(make: Callable[[Path], Made]) -> Callable[[Path], Made]:
    """Keeps what a function makes of a file, out of sight of the collector, which would triple the time to make it."""

    @cache
    @wraps(make)
    def keep(path: Path) -> Made:
        collecting = gc.isenabled()
        gc.disable()
        result = make(path)
        gc.freeze()
        if collecting:
            gc.enable()
        return result

    return keep


@_kept
def tree(path: Path) -> ast.Module:
    """Syntax tree of a module, which no test changes."""
    return ast.parse(path.read_text(encoding="utf-8"))


@_kept
def nodes(path: Path) -> list[ast.AST]:
    """All nodes of a module, its own the first."""
    return list(ast.walk(tree(path)))


def statements(node: ast.AST, left_out: Callable[[ast.AST], bool] = lambda _: False) -> Iterator[ast.AST]:
    """A module or a statement with all statements in it, without expressions, which are most of a tree."""
    yield node
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.stmt | ast.ExceptHandler | ast.match_case) and not left_out(child):
            yield from statements(child, left_out)
