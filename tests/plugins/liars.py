"""Lies around an honest engine: false samples, certificates, models or events.

The engine is the projection method, with cached samples: a test of a lie costs little more than its judges.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar, Self

from scipy.spatial.transform import Rotation

from proofroll.conformance.subject import truth_scenes
from proofroll.core.events import Event
from proofroll.core.plugins import load_engine
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.engines.projection.settings import ProjectionSettings
from proofroll.files.scene_file import load_scene

Projection = load_engine("projection")

EVERY = 0.01


def _driven() -> Scene:
    """A double pendulum with a drive at its shoulder and a damper at its elbow."""
    scene = load_scene("double_pendulum")
    (element,) = scene.elements
    shoulder, elbow = element.mechanism.joints  # type: ignore[attr-defined]  # a mechanism has joints
    joints = dataclasses.replace(shoulder, torque=3.0), dataclasses.replace(elbow, damping=0.2)
    return of_mechanism(scene, joints=joints)


def of_mechanism(scene: Scene, **parts: Any) -> Scene:
    """The scene with parts of its mechanism replaced."""
    (element,) = scene.elements
    assert isinstance(element, MechanismElement)
    mechanism = dataclasses.replace(element.mechanism, **parts)
    return dataclasses.replace(scene, elements=(dataclasses.replace(element, mechanism=mechanism),))


_SCENES: Mapping[str, tuple[Callable[[], Scene], float]] = {
    "rolls": (lambda: load_scene("sphere_in_cylinder", asks=("orientation",)), 0.2),
    "slips": (lambda: load_scene("sphere_in_cylinder", mu_static=0.15, mu_kinetic=0.1), 0.25),
    "tree": (lambda: load_scene("double_pendulum"), 0.12),
    "loop": (lambda: load_scene("slider_crank"), 0.12),
    "driven": (_driven, 0.12),
    "servo": (lambda: truth_scenes()["double_pendulum-limit"], 0.12),
    "sled": (lambda: load_scene("sled"), 0.12),
    "bounces": (lambda: load_scene("spinning_bounce", height=0.0545), 0.12),
    "stops": (lambda: load_scene("stop", height=0.01, restitution=0.5), 0.1),
    "rubs": (lambda: load_scene("spring_friction"), 0.12),
    "gears": (lambda: load_scene("gear_pair"), 0.12),
}
UNTIL = {name: until for name, (_, until) in _SCENES.items()}
BALLS, MECHANISMS = ("rolls",), ("tree", "loop", "driven", "servo")
ALL = (*BALLS, *MECHANISMS, "sled")


@cache
def scene_of(name: str) -> Scene:
    """Scene of a kind of motion, a key of ``UNTIL``."""
    return _SCENES[name][0]()


class _Kept:
    """An honest run with a cache of samples and events by time."""

    def __init__(self, scene: Scene, settings: Any) -> None:
        self.scene, self.settings = scene, settings
        self.engine = Projection.build(scene, settings)
        self.t, self.built = 0.0, self.engine.built()
        self.kept = {0.0: (self.engine.sample(), self._events())}

    def _events(self) -> list[Event]:
        return list(self.engine.events()) if hasattr(self.engine, "events") else []

    def at(self, t: float) -> tuple[Any, list[Event]]:
        """Sample at a time [s], and events until then."""
        if t not in self.kept:
            if t < self.t:
                self.engine = Projection.build(self.scene, self.settings)
            self.engine.advance(t)
            self.t, self.kept[t] = t, (self.engine.sample(), self._events())
        return self.kept[t]


_KEPT: dict[tuple[str, str, Any], _Kept] = {}


@dataclass(frozen=True)
class Moment:
    """Arguments from which a lie makes its sample.

    Attributes:
        t: time of the sample [s].
        right: honest sample at ``t``.
        at: time [s] -> honest sample.
        of: change of the scene -> honest sample of the changed scene at ``t``.
        scene, until: scene, and end of the run [s].
    """

    t: float
    right: Any
    at: Callable[[float], Any]
    of: Callable[[Callable[[Scene], Scene]], Any]
    scene: Scene
    until: float

    @property
    def turns(self) -> Rotation:
        """Orientations of the bodies."""
        return Rotation.from_quat(self.right.q_WB, scalar_first=True)

    @property
    def length(self) -> float:
        """Size of the element [m]."""
        return float(self.scene.elements[0].length)


@dataclass(frozen=True)
class Lie:
    """A lie of an engine about its motion, and the verdict that it needs.

    Attributes:
        name: the lie in a few words.
        scenes: kinds of motion to which it applies.
        said: texts; the verdict must contain one of them; empty: the lie is far below the tolerance and passes.
        sample: function to a false sample, or to the false fields of it by name.
        causes: texts; each named cause must contain one of them; empty: no cause may be named.
        begins: time of the first false sample [s]; by default after all samples that the certificate reads.
        model: change of the scene before it is built.
        built: (certificate data of the changed model, honest ones) -> reported ones.
        events: (honest events, end of the run [s]) -> reported events.
    """

    name: str
    scenes: tuple[str, ...]
    said: tuple[str, ...] = ()
    sample: Callable[[Moment], Any] | None = None
    causes: tuple[str, ...] = ()
    begins: float = 0.9 * EVERY
    model: Callable[[Scene], Scene] | None = None
    built: Callable[[Any, Any], Any] | None = None
    events: Callable[[list[Event], float], list[Event]] | None = None


AT_ONCE = 1e-12  # after the start


class Liar:
    """An engine that tells a lie; see :func:`liar`."""

    name: ClassVar[str] = "liar"
    provides: ClassVar[Mapping[str, frozenset[str]]] = Projection.provides
    settings: ClassVar[type[Any]] = ProjectionSettings
    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = Projection.presets
    lie: ClassVar[Lie]
    about: ClassVar[str]

    @staticmethod
    def version() -> str:
        """See :class:`proofroll.core.engine.Engine`."""
        return "1"

    @classmethod
    def build(cls, scene: Scene, settings: Any) -> Self:
        """See :class:`proofroll.core.engine.Engine`."""
        return cls(scene, settings)

    def __init__(self, scene: Scene, settings: Any) -> None:
        self.settings, self.t = settings, 0.0
        self.true = self._kept(None)
        self.moves = self.true if self.lie.model is None else _Kept(self.lie.model(scene), settings)

    def _kept(self, model: Callable[[Scene], Scene] | None) -> _Kept:
        """Honest run of the scene, or of a changed one, shared by all lies."""
        scene = scene_of(self.about)
        key = self.about, repr(self.settings), model
        if key not in _KEPT:
            _KEPT[key] = _Kept(model(scene) if model else scene, self.settings)
        return _KEPT[key]

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        self.t = t

    def sample(self) -> Any:
        """See :class:`proofroll.core.engine.Engine`."""
        right = self.moves.at(self.t)[0]
        if self.lie.sample is None or self.t < self.lie.begins:
            return right
        moment = Moment(
            self.t, right, lambda t: self.moves.at(t)[0], lambda model: self._kept(model).at(self.t)[0],
            scene_of(self.about), UNTIL[self.about],
        )  # fmt: skip
        said = self.lie.sample(moment)
        return dataclasses.replace(right, **said) if isinstance(said, dict) else said

    def events(self) -> list[Event]:
        """See :class:`proofroll.core.engine_abilities.LocatesEvents`."""
        right = self.moves.at(self.t)[1]
        return self.lie.events(right, UNTIL[self.about]) if self.lie.events else right

    def built(self) -> Any:
        """See :class:`proofroll.core.engine.Engine`."""
        return self.lie.built(self.moves.built, self.true.built) if self.lie.built else self.moves.built


def liar(about: str, lie: Lie) -> type[Liar]:
    """An engine that tells this lie about a scene."""
    return type("Liar", (Liar,), {"about": about, "lie": lie})
