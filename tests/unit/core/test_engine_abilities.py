"""Abilities of engines: how a refusal says what is missing, and where it is."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from proofroll.core.engine_abilities import needed, require_provided
from proofroll.core.errors import Refused


def engine(**provides: set[str]) -> Any:
    """An engine with these formulations."""
    return SimpleNamespace(name="own", provides={name: frozenset(each) for name, each in provides.items()})


def test_missing_capabilities_of_one_reason_are_told_together() -> None:
    """A reason stands once, behind all that it explains; what has none stands before."""
    reasons = {"boxes": "it has spheres", "discs": "it has spheres"}
    assert needed(["boxes", "loops", "discs"], reasons) == "needs loops, boxes, discs, and it has spheres"


@pytest.mark.parametrize(
    ("provides", "said"),
    [
        ({"one": {"a"}}, "needs b; no formulation of own's adapter has that"),
        ({"one": set()}, "needs a, b; no formulation of own's adapter has all of that"),
        ({"one": {"a"}, "two": {"b"}}, "needs b; no formulation of own's adapter has all that the scene needs"),
        ({"one": {"a"}, "two": {"a", "b"}}, "needs b; choose formulation=two"),
    ],
)
def test_where_what_is_missing_is(provides: dict[str, set[str]], said: str) -> None:
    """A refusal names a formulation that is able; none is told to lack what only another one has."""
    scene: Any = SimpleNamespace(requires=frozenset({"a", "b"}))
    with pytest.raises(Refused) as refusal:
        require_provided(engine(**provides), "one", scene)
    assert str(refusal.value) == said
