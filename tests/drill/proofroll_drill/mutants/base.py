"""Engines with one fault each: the projection method behind the public protocol, and what goes wrong in between.

A mutant does not tell on itself: it says that it built what the scene says, as an author believes who made the mistake.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, ClassVar

from proofroll.core.events import Event
from proofroll.core.plugins import load_engine
from proofroll.core.scene import Scene
from proofroll.engines.projection.settings import ProjectionSettings
from proofroll.papers.blajer_2006.ball.as_body import RunOnBody, on_body
from proofroll.papers.blajer_2006.ball.sampling import BallBuilt

Projection = load_engine("projection")

STEP = 2e-3


def own(run: Any) -> Any:
    """The run itself, of a ball's the one in its own terms."""
    return run.own if isinstance(run, RunOnBody) else run


class Mutant:
    """Base of mutants: the scene in the projection method, misread.

    Attributes:
        fault: planted fault, in a few words.
        scene: on which it is tried, with its parameters.
        named: the cause in plain words; the diagnosis must have one of these words.
        until, every, step: length of the run, interval of its samples, and step [s].
        asks: results wanted besides the motion.
    """

    name: ClassVar[str] = "mutant"
    formulation: ClassVar[str] = "rotating_frame"
    provides: ClassVar[Mapping[str, frozenset[str]]] = Projection.provides
    settings: ClassVar[type[Any]] = ProjectionSettings
    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = Projection.presets
    fault: ClassVar[str] = ""
    scene: ClassVar[tuple[str, Mapping[str, float]]] = ("sphere_in_cylinder", {})
    named: ClassVar[tuple[str, ...]] = ()
    until: ClassVar[float] = 0.3
    every: ClassVar[float] = 0.01
    step: ClassVar[float] = STEP
    asks: ClassVar[tuple[str, ...]] = ()
    of_ball = False

    @staticmethod
    def version() -> str:
        """See :class:`proofroll.core.engine.Engine`."""
        return "1.0"

    @classmethod
    def build(cls, scene: Scene, settings: Any) -> Any:
        """See :class:`proofroll.core.engine.Engine`."""
        made = cls(scene, settings)
        return on_body(made, scene) if made.of_ball else made

    def __init__(self, scene: Scene, settings: Any) -> None:
        self.element: Any = scene.elements[0]
        claimed = Projection.build(scene, settings)
        self.of_ball = isinstance(claimed, RunOnBody)
        self.claimed: Any = own(claimed)
        self.inner: Any = own(Projection.build(self.misread(scene), settings))
        self.t = 0.0

    def misread(self, scene: Scene) -> Scene:
        """The scene that it builds."""
        return scene

    def misreport(self, sample: Any) -> Any:
        """Report of its state."""
        return sample

    def clock(self, t: float) -> float:
        """Time of its model when ``t`` is asked for [s]."""
        return t

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        self.t = t
        self.inner.advance(max(self.clock(t), 0.0))

    def sample(self) -> Any:
        """See :class:`proofroll.core.engine.Engine`; at time 0 as the scene says, which is what it was given."""
        return self.misreport(self.inner.sample())

    def events(self) -> list[Event]:
        """See :class:`proofroll.core.engine_abilities.LocatesEvents`."""
        return list(self.inner.events()) if hasattr(self.inner, "events") else []

    def built(self) -> BallBuilt | Any:
        """Model as given by the scene; its start is read back."""
        found = self.inner.built()
        moves = {name: getattr(found, name) for name in ("acceleration", "angular_acceleration")}
        return dataclasses.replace(self.claimed.built(), **moves)


def planted(base: type[Mutant], name: str, fault: str, named: str | tuple[str, ...], **fields: Any) -> type[Mutant]:
    """Mutant of a base: its fault, words of the cause that has to be named, and what makes it faulty.

    Args:
        base: the engine without the fault.
        name: name of the class.
        fault: planted fault, in a few words.
        named: words of the cause; one of them suffices.
        fields: attributes and methods of the class.
    """
    words = (named,) if isinstance(named, str) else named
    return type(name, (base,), {"__doc__": fault, "fault": fault, "named": words, **fields})


class Honest(Mutant):
    """Base of mutants with an honest certificate, which shows the fault."""

    def built(self) -> BallBuilt | Any:
        """Read back."""
        return self.inner.built()


class OneStepBehind(Mutant):
    """Base of mutants with a second model, one step behind.

    Attributes:
        behind: the second model.
    """

    def __init__(self, scene: Scene, settings: Any) -> None:
        super().__init__(scene, settings)
        self.behind: Any = own(Projection.build(scene, settings))

    def advance(self, t: float) -> None:
        """Both."""
        super().advance(t)
        self.behind.advance(t - STEP)
