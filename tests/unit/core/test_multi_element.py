"""Scenes of several elements: every formulation runs them, each element in a model of its own."""

from __future__ import annotations

import dataclasses
import inspect
from enum import StrEnum
from typing import Any, cast

import numpy as np
import pytest
from placed_balls import placed, scene_with

from proofroll.core.controlled_engine import CommandedEngine, bare
from proofroll.core.dataset import observe
from proofroll.core.errors import Refused
from proofroll.core.events import Event
from proofroll.core.multi_element import events_of_engine, formulation_for
from proofroll.core.scene import Scene
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate


@pytest.fixture
def balls() -> Scene:
    """The paper's ball, and a slower one that is resisted."""
    scene, other = (
        load_scene("sphere_in_cylinder"),
        load_scene("sphere_in_cylinder", speed=2.0, rolling_resistance=5e-4),
    )
    (one,) = scene.elements
    (second,) = scene_with(other, ball=dataclasses.replace(placed(other).ball, name="second")).elements
    return dataclasses.replace(scene, elements=(one, second))


@pytest.mark.drill
@pytest.mark.one_in(4)
@pytest.mark.parametrize("engine", ["projection", "reduced", "exudyn", "pinocchio"])
def test_each_element_moves_as_it_does_alone(balls: Scene, engine: str) -> None:
    """In a scene of two elements each follows, digit for digit, the path of a scene that holds it alone."""
    both = observe(balls, simulate(balls, engine, until=0.1, every=0.01))
    for element in balls.elements:
        alone = dataclasses.replace(balls, elements=(element,))
        seen = observe(alone, simulate(alone, engine, until=0.1, every=0.01))
        for name in alone.observables:
            if name in seen:
                assert np.array_equal(both[balls.label(element, name)], seen[name]), name


@pytest.fixture
def mixed(balls: Scene) -> Scene:
    """The paper's ball beside a pendulum."""
    (pendulum,) = load_scene("pendulum").elements
    return dataclasses.replace(balls, elements=(balls.elements[0], pendulum))


@pytest.mark.drill
@pytest.mark.one_in(4)
@pytest.mark.parametrize(
    "engine",
    [
        pytest.param("projection[formulation=dependent]", marks=pytest.mark.drill),
        "exudyn[formulation=spheres]",
        "pinocchio[formulation=impulses]",
        "mujoco[formulation=geoms]",
    ],
)
def test_a_ball_beside_a_mechanism_moves_as_alone(mixed: Scene, engine: str) -> None:
    """One formulation serves both, and neither changes the other."""
    both = simulate(mixed, engine, until=0.1, every=0.01)
    alone = dataclasses.replace(mixed, elements=mixed.elements[:1])
    ball, seen = mixed.elements[0], observe(alone, simulate(alone, engine, until=0.1, every=0.01))
    found = observe(mixed, both)
    for name in alone.observables:
        if name in seen:
            assert np.array_equal(found[mixed.label(ball, name)], seen[name]), name


def test_a_formulation_that_is_for_none_of_the_elements_is_refused(balls: Scene) -> None:
    """Who asks for joints of balls gets no other model in their place."""
    with pytest.raises(Refused, match="needs contact between bodies"):
        simulate(balls, "exudyn[formulation=tree]", until=0.1, every=0.05)


def test_what_no_formulation_of_an_engine_has_is_still_refused(mixed: Scene) -> None:
    """Equations of a ball alone do not become those of a pendulum."""
    with pytest.raises(Refused, match=r"needs revolute joints"):
        simulate(mixed, "reduced", until=0.1, every=0.05)


class Provided(StrEnum):
    """What some kind of element may need."""

    ONE = "one"
    OTHER = "another"


@pytest.mark.parametrize(
    ("requires", "own", "expected"),
    [
        ({Provided.ONE}, "both", "both"),
        ({Provided.ONE, Provided.OTHER}, "one", None),
        ({Provided.ONE, Provided.OTHER}, "foreign", "both"),
        ({"a word"}, "one", "foreign"),
        ({"a word"}, "foreign", "foreign"),
        ({"nobody's"}, "one", None),
        (set(), "foreign", "foreign"),
    ],
)
def test_another_formulation_stands_in_for_foreign_elements_alone(
    requires: set[str], own: str, expected: str | None
) -> None:
    """A formulation that knows the kind of an element and lacks something of it is replaced by none."""
    provides = {"foreign": ["a word"], "one": ["one"], "both": ["one", "another"]}
    assert formulation_for(requires, own, provides) == expected


def test_what_an_engine_is_able_to_do_is_asked_of_it_alone() -> None:
    """Under a controller the engine itself is looked at, for static checks of protocols see no attribute handed on."""

    class Locating:
        """Engine that locates events."""

        def events(self) -> list[Event]:
            """No events."""
            return []

    engine = Locating()
    commanded_engine = CommandedEngine.__new__(CommandedEngine)
    commanded_engine.engine = engine
    assert bare(commanded_engine) is engine
    assert bare(engine) is engine
    assert inspect.getattr_static(commanded_engine, "events", None) is None
    assert events_of_engine(commanded_engine, cast("Any", None)) == []
