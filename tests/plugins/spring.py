"""The smallest kind of element: a point mass on a spring along x, with its truth and an engine."""

# ruff: noqa: ARG002, ARG004 -- the protocols' signatures

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import xarray as xr
from tiny import TinySettings

from proofroll.core.arrays import FloatArray
from proofroll.core.certificate import Line
from proofroll.core.columns import Columns, Variable
from proofroll.core.element import Element, FirstMotion, OptionalTerm, Sign, StepNumber
from proofroll.core.engine import Sample, whole_steps
from proofroll.core.engine_abilities import Level, Term
from proofroll.core.gravity import Gravity
from proofroll.core.observable import Observable, Role
from proofroll.core.parameters import Parameters
from proofroll.core.scene import Scene

SPRUNG = "a mass on a spring"


@dataclass(frozen=True)
class Spring:
    """Point mass on a spring: m ẍ = -k x, from x0 at rest."""

    name: str
    mass: float
    stiffness: float
    x0: float

    bodies = ("mass",)
    sample_type = Sample
    requires = frozenset({SPRUNG})
    observables = (
        Observable("x", "m", "elongation", Role.MOTION, floor=1e-9, headline=True, decides=True),
        Observable("pull", "N", "force of the spring", Role.REACTION, floor=1e-9, headline=True),
        Observable("energy_error", "J", "energy now minus energy at the start", Role.RESIDUAL, floor=1e-9),
    )
    askable: ClassVar[Mapping[str, str]] = {}
    failing_events: ClassVar[Mapping[str, str]] = {}
    failures: ClassVar[Mapping[str, str]] = {"far out": "the mass is ten times farther than at the start"}

    @property
    def rate(self) -> float:
        """Angular frequency ω [rad/s]."""
        return float(np.sqrt(self.stiffness / self.mass))

    @property
    def length(self) -> float:
        """Elongation at the start [m]."""
        return abs(self.x0)

    @property
    def natural_time(self) -> float:
        """Period of the oscillation [s]."""
        return 2 * np.pi / self.rate

    softened = frozenset[str]()

    @property
    def first_motion(self) -> FirstMotion:
        """Initial acceleration, towards x = 0, with its scale and a short time."""
        start = np.array([[-(self.rate**2) * self.x0, 0.0, 0.0]])
        return FirstMotion(start, np.zeros((1, 3)), self.rate**2 * abs(self.x0), 1e-3 / self.rate)

    def step_numbers(self, h: float, truth: xr.Dataset | None) -> Sequence[StepNumber]:
        """Angle of the oscillation in a step, ωh."""
        return (StepNumber("phase", "ωh", "angle of the oscillation in a step", self.rate * h),)

    def variables(self, times: FloatArray, samples: Sequence[Sample]) -> Columns:
        """Elongation, speed, pull and energy."""
        x, v = (np.array([getattr(s, key)[..., 0] for s in samples]).reshape(-1) for key in ("p_WB", "v_WB"))
        energy = 0.5 * self.mass * v**2 + 0.5 * self.stiffness * x**2
        columns = {"x": (x, "m"), "v": (v, "m/s"), "pull": (-self.stiffness * x, "N")}
        columns["energy_error"] = (energy - energy[0], "J")
        variables = {k: Variable(("time",), values, {"units": u, "long_name": k}) for k, (values, u) in columns.items()}
        return Columns(variables | {"time": Variable(("time",), times, {"units": "s"})})

    def lacks(self, samples: Sequence[Sample], asks: Sequence[str]) -> str | None:
        """None: samples have all that is needed."""
        return None

    def observe(self, dataset: xr.Dataset) -> dict[str, FloatArray]:
        """Observables as in the dataset; the pull without time 0."""
        found = {item.name: dataset[item.name].to_numpy() for item in self.observables}
        return found | {"pull": found["pull"][1:]}

    def scales(self, truth: xr.Dataset) -> dict[str, float]:
        """Scale of each observable, from the start."""
        pull = self.stiffness * abs(self.x0)
        return {"x": abs(self.x0), "pull": pull, "energy_error": 0.5 * pull * abs(self.x0)}

    def certify(self, built: Any, sample: Sample) -> list[Line]:
        """Lines of the certificate for the mass and the initial elongation."""
        pairs = {"mass": (self.mass, built["mass"], "kg"), "x": (self.x0, float(np.ravel(sample.p_WB)[0]), "m")}
        return [Line(k, u, (a,), (b,), abs(a - b) / abs(a), 1e-12) for k, (a, b, u) in pairs.items()]

    def signs(self, dataset: xr.Dataset, truth: xr.Dataset | None) -> list[Sign]:
        """Sign of failure: elongation above ten times the initial one."""
        return [Sign("far out", np.abs(dataset["x"].to_numpy()) > 10 * abs(self.x0))]

    def optional_terms(self, parameters: Mapping[str, float], truth: xr.Dataset) -> list[OptionalTerm]:
        """No optional terms."""
        return []


class SpringKind:
    """Kind of element that is read from ``[[masses]]``."""

    name: ClassVar[str] = "spring"
    tables: ClassVar[tuple[str, ...]] = ("masses",)
    units: ClassVar[Mapping[str, str]] = {"mass": "kg", "stiffness": "N/m", "x0": "m"}

    @staticmethod
    def read(tables: Mapping[str, Any], gravity: Gravity, numbers: Parameters, where: str) -> Sequence[Spring]:
        """One element for each table."""
        return [Spring(**table) for table in numbers.filled(tables["masses"], where, SpringKind.units)]

    @staticmethod
    def conformance_scenes() -> Mapping[str, Scene]:
        """One scene with a spring."""
        return {"spring": Scene("spring", "", (Spring("m", 2.0, 50.0, 0.3),), {"mass": 2.0})}

    @staticmethod
    def truth_scenes() -> Mapping[str, Scene]:
        """The conformance scenes."""
        return SpringKind.conformance_scenes()


class SpringTruth:
    """Truth of a spring by two routes: a cosine, and the exponential of the system matrix."""

    @staticmethod
    def covers(element: Element) -> bool:
        """True for springs."""
        return isinstance(element, Spring)

    @staticmethod
    def truth(element: Spring, times: FloatArray, asks: Sequence[str]) -> xr.Dataset:
        """Dataset of the first route, with error bars from its difference to the second."""
        from scipy.linalg import expm

        w, A = element.rate, np.array([[0, 1], [-element.stiffness / element.mass, 0]])
        first = [(element.x0 * np.cos(w * t), -element.x0 * w * np.sin(w * t)) for t in times]
        second = [tuple(expm(A * t) @ [element.x0, 0.0]) for t in times]
        one, two = (element.variables(times, [at(*s) for s in states]).dataset() for states in (first, second))
        for name in one.data_vars:
            one[name].attrs["error_bar"] = 3 * float(np.max(np.abs(one[name] - two[name]))) + 1e-15
        return one.assign_attrs(route="cosine", second_route="exponential of the matrix")


def at(x: float, v: float) -> Sample:
    """The state as a sample."""
    return Sample(np.array([x, 0.0, 0.0]), np.array([v, 0.0, 0.0]), np.zeros(3))


class Sprung:
    """Engine for one spring: explicit midpoint rule."""

    name: ClassVar[str] = "sprung"
    provides: ClassVar[Mapping[str, frozenset[str]]] = {"midpoint": frozenset({SPRUNG})}
    settings: ClassVar[type[Any]] = TinySettings
    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {"midpoint": {"matched": TinySettings()}}
    levels: ClassVar[Mapping[str, Level]] = {"midpoint": Level.REDUCED}
    terms: ClassVar[Sequence[Term]] = ()

    @staticmethod
    def version() -> str:
        """See the protocol."""
        return "1.0"

    @classmethod
    def build(cls, scene: Scene, settings: Any) -> Sprung:
        """See the protocol."""
        return cls(scene, settings.dt)

    def __init__(self, scene: Scene, dt: float) -> None:
        (self.spring,) = scene.elements
        self.x, self.dt, self.t = np.array([self.spring.x0, 0.0]), dt, 0.0

    def advance(self, t: float) -> None:
        """See the protocol."""
        A = np.array([[0, 1], [-(self.spring.rate**2), 0]])
        for _ in range(whole_steps(self.t, t, self.dt)):
            self.x = self.x + self.dt * A @ (self.x + self.dt / 2 * A @ self.x)
        self.t = t

    def sample(self) -> Sample:
        """See the protocol."""
        return at(*self.x.tolist())

    def built(self) -> Mapping[str, float]:
        """See the protocol."""
        return {"mass": self.spring.mass}
