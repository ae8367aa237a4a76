"""Formulations that packages add to an engine of another package, under the entry point of its name."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib.metadata import EntryPoint
from typing import Any

from proofroll.core.engine_abilities import Level, Steps, Term, require_provided
from proofroll.core.entry_points import announced, loaded
from proofroll.core.scene import Scene

FORMULATIONS = "proofroll.formulations"
# What an engine says of each formulation, as its attribute -> as one of :class:`Formulation`.
_SAID = {"provides": "provides", "presets": "presets", "levels": "level", "lacking": "lacking", "inherent": "inherent"}
_SAID |= {"references": "reference"}


@dataclasses.dataclass(frozen=True)
class Formulation:
    """A formulation that a package adds to an engine.

    Attributes:
        presets: preset -> complete settings, of a class of their own if it has settings that the engine lacks.
        provides: capabilities that it represents honestly.
        level: its rung on the ladder of models.
        build: scene and settings -> run, see :class:`proofroll.core.engine.Engine`. The scene requires no more than it
            provides.
        lacking: see :class:`proofroll.core.engine_abilities.SaysWhyNot`.
        inherent: see :class:`proofroll.core.engine_abilities.CannotLeaveOut`.
        reference: claim that its runs lead to the true motion, see
            :class:`proofroll.core.engine_abilities.ServesAsReference`; None: it makes none.
        terms: parts of its model that a setting switches; of a part that the engine has already, the name alone.
    """

    presets: Mapping[str, Any]
    provides: frozenset[str]
    level: Level
    build: Callable[[Scene, Any], Any]
    lacking: Mapping[str, str] = dataclasses.field(default_factory=dict)
    inherent: Mapping[str, str] = dataclasses.field(default_factory=dict)
    reference: Steps | None = None
    terms: Sequence[Term | str] = ()


def extended(engine: Any) -> Any:
    """Class of an engine with the formulations that packages add to it, or the class itself if there are none.

    They come before its own: as they are for fewer scenes, one of them is the choice where it can be.
    """
    points = tuple(point for point in announced(FORMULATIONS) if point.name == engine.name)
    return _extended(engine, points) if points else engine


def added_by(engine: Any, formulation: str) -> Formulation | None:
    """The formulation of an extended engine that a package added; None: it is the engine's own."""
    return getattr(engine, "added", {}).get(formulation)


@cache
def _extended(engine: Any, points: tuple[EntryPoint, ...]) -> Any:
    named = (items for point, items in loaded(FORMULATIONS, of=Mapping, name=engine.name) if point in points)
    added = {name: item for items in named for name, item in items.items() if name not in engine.presets}

    def build(cls: Any, scene: Scene, settings: Any) -> Any:
        formulation = added_by(cls, settings.formulation)
        if formulation is None:
            return super(kind, cls).build(scene, settings)
        require_provided(cls, settings.formulation, scene)
        return formulation.build(scene, settings)

    members: dict[str, Any] = {"__module__": engine.__module__, "__doc__": engine.__doc__, "added": added}
    members |= {"build": classmethod(build), "terms": _terms(added, getattr(engine, "terms", ()))}
    for there, here in _SAID.items():
        said = {name: getattr(item, here) for name, item in added.items() if getattr(item, here)}
        members[there] = {**said, **getattr(engine, there, {})}
    kind: type[Any] = type(engine.__name__, (engine,), members)
    return kind


def _terms(added: Mapping[str, Formulation], own: Sequence[Term]) -> tuple[Term, ...]:
    """Parts of models that settings switch: those of the added formulations, and the engine's own."""
    sharing = {term.name: tuple(name for name, item in added.items() if term.name in item.terms) for term in own}
    return (
        *(term for item in added.values() for term in item.terms if isinstance(term, Term)),
        *(dataclasses.replace(term, formulations=(*sharing[term.name], *term.formulations)) for term in own),
    )
