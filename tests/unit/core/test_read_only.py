"""Scenes and truths stay what they are, whatever an engine does to the one that it is given."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pytest
from tiny import Tiny

from proofroll.conformance.subject import scenes, truth_scenes
from proofroll.core.arrays import read_only
from proofroll.core.errors import Refused
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.mechanism.run.element import the_mechanism
from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.ball.as_body import RunOnBody, rolling_ball
from proofroll.running.simulation import simulate

SCENES = {**scenes(), **truth_scenes()}


def arrays(item: Any) -> Iterator[np.ndarray]:
    """All arrays that can be reached from an element by its public names."""
    if isinstance(item, np.ndarray):
        yield item
    elif isinstance(item, Mapping):
        yield from arrays(list(item.values()))
    elif isinstance(item, (tuple, list)):
        for part in item:
            yield from arrays(part)
    elif dataclasses.is_dataclass(item) and not isinstance(item, type):
        for name in {*(field.name for field in dataclasses.fields(item)), *vars(item)} | cached(type(item)):
            if not name.startswith("_"):
                yield from arrays(getattr(item, name))


def cached(kind: type) -> set[str]:
    """Names of what a class computes once and keeps."""
    return {name for base in kind.__mro__ for name, value in vars(base).items() if hasattr(value, "attrname")}


@pytest.mark.one_in(4)
@pytest.mark.parametrize("name", SCENES)
def test_arrays_of_scenes_are_read_only(name: str) -> None:
    """No array of a scene can be written, be it given or computed once; an engine's copy is no exception."""
    for scene in (SCENES[name], SCENES[name].for_an_engine):
        found = list(arrays(scene.elements))
        assert found
        assert not any(array.flags.writeable for array in found)


def test_what_a_ball_was_made_of_stays_its_owners() -> None:
    """Whoever gives an array to a ball may write to it later, and the ball stays as it is."""
    body, mine = rolling_ball(load_scene("sphere_in_cylinder")), np.array([1.0, 2.0, 3.0])
    other = dataclasses.replace(body, v0=mine)
    mine *= 2
    assert other.v0.tolist() == [1.0, 2.0, 3.0]


def test_read_only_at_any_depth() -> None:
    """Arrays in tuples, lists and mappings become read-only where they lie."""
    inside = np.zeros(2), np.ones(2)
    read_only({"a": [(inside[0],)], "b": inside[1]})
    assert not any(array.flags.writeable for array in inside)


@pytest.mark.drill
def test_truths_are_read_only() -> None:
    """No variable of a truth can be written; a deep copy can."""
    found = truth(load_scene("inclined_plane"), np.linspace(0, 0.1, 3))
    with pytest.raises(ValueError, match="read-only"):
        found["p_WB"].values[0] = 0.0
    found.copy(deep=True)["p_WB"].values[0] = 0.0


class Bending(Tiny):
    """Halves gravity in the scene that it is given, whatever stands in the way, and says that this is the scene."""

    @classmethod
    def build(cls, scene: Scene, settings: Any) -> RunOnBody:
        """Not the scene."""
        on_wall = the_mechanism(scene).on_wall
        assert on_wall is not None
        on_wall.gravity.flags.writeable = True
        on_wall.gravity[:] *= 0.5
        return super().build(scene, settings)


def test_an_engine_cannot_bend_the_scene() -> None:
    """An engine that writes to its scene changes neither the caller's nor what it is held against."""
    scene = load_scene("sphere_in_cylinder")
    before = rolling_ball(scene).gravity.copy()
    with pytest.raises(Refused, match="gravity"):
        simulate(scene, Bending, until=0.1)
    assert rolling_ball(scene).gravity.tolist() == before.tolist()
