"""Kinds of joints and of events have one list each, which the rest of the code names."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest
from source_code import PACKAGES, nodes

from proofroll.core.events import EventKind
from proofroll.elements.mechanism.scene.joint_kinds import FACTS, JointKind

ROOT = Path(__file__).resolve().parents[2]
FILES = [file for folder in ("src", *PACKAGES) for file in (ROOT / folder).rglob("*.py")]
# Modes of contacts and their guards have the names of some events.
EVENTS = frozenset(EventKind) - {EventKind.SLIP, EventKind.STICK, EventKind.TURN}


def written_kinds(module: list[ast.AST]) -> Iterator[str]:
    """Kinds written as texts: compared with an attribute ``kind``, or given to an event."""
    for node in module:
        if isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            if any(isinstance(side, ast.Attribute) and side.attr == "kind" for side in sides):
                texts = {item.value for side in sides for item in ast.walk(side) if isinstance(item, ast.Constant)}
                yield from texts & (EVENTS | frozenset(JointKind))
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Event" and node.args:
            kind = node.args[0]
            if isinstance(kind, ast.Constant):
                yield str(kind.value)


def test_no_module_writes_a_kind_of_joint_or_event_as_a_text() -> None:
    """A renamed kind is one change: no comparison and no event here has its text."""
    written = {str(path.relative_to(ROOT)): kinds for path in FILES if (kinds := sorted(written_kinds(nodes(path))))}
    assert written == {}


def test_each_kind_of_joint_has_its_facts() -> None:
    """The table of facts has the kinds of the list, and no other."""
    assert list(FACTS) == list(JointKind)


@pytest.mark.parametrize(
    ("source", "kinds"),
    [
        ("joint.kind == 'revolute'", ["revolute"]),
        ("joint.kind in {'free', 'urdf'}", ["free"]),
        ("Event('slip', 0.0, 0.0, 0.0)", ["slip"]),
        ("file.kind == 'urdf'", []),
        ("joint.kind == JointKind.REVOLUTE", []),
    ],
)
def test_a_written_kind_is_seen(source: str, kinds: list[str]) -> None:
    """Comparisons with an attribute kind and arguments of events are looked at."""
    assert list(written_kinds(list(ast.walk(ast.parse(source))))) == kinds
