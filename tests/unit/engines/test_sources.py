"""What the sources of the adapters may not hold."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest
from source_code import nodes

import proofroll.engines
from proofroll.elements.balls.surfaces import surface_kinds
from proofroll.files.scene_file import scene_names

ENGINES = Path(proofroll.engines.__path__[0])


def without_docstrings(module: list[ast.AST]) -> list[ast.AST]:
    """The nodes of a module but for its sentences about itself."""
    sentences = {
        id(node.body[0].value)
        for node in module
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef))
        and node.body
        and isinstance(node.body[0], ast.Expr)
    }
    return [node for node in module if id(node) not in sentences]


def setting(node: ast.expr) -> bool:
    """True of an attribute of ``self``: the adapter's own option, whose values are its own words."""
    return isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "self"


@pytest.mark.drill
@pytest.mark.parametrize("engine", sorted(path.name for path in ENGINES.iterdir() if path.is_dir()))
def test_no_adapter_knows_a_scene_or_a_surface(engine: str) -> None:
    """No adapter names a scene, or a class or kind of surface: what it asks, it asks of any."""
    classes, kinds = {kind.__name__ for kind in surface_kinds()}, {kind.kind for kind in surface_kinds()}
    # One word alone may mean anything else, as MuJoCo's cone of friction; compared with something it does not.
    scene = re.compile(rf"\b({'|'.join(name for name in scene_names() if '_' in name)})\b")
    for path in sorted((ENGINES / engine).rglob("*.py")):
        for node in without_docstrings(nodes(path)):
            where = f"{path.name}:{getattr(node, 'lineno', 0)}"
            if isinstance(node, (ast.Name, ast.Attribute, ast.alias)):
                name = next(getattr(node, key) for key in ("id", "attr", "name") if hasattr(node, key))
                assert name.rpartition(".")[2] not in classes, where
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                assert not scene.search(node.value), where
            elif isinstance(node, ast.Compare):
                sides = (node.left, *node.comparators)
                compared = {x.value for x in sides if isinstance(x, ast.Constant) and not any(map(setting, sides))}
                assert not compared & (kinds | set(scene_names())), where
