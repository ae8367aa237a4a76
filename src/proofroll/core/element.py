"""Protocols of the parts of a scene. Each kind of element is a plug-in, as engines are.

An element is a part of a scene that no force couples to the rest: a ball on a surface, a mechanism. It brings its data
with their bounds, the capabilities that a formulation needs to represent it, its observables with their scales, the
lines of its certificate and its signs of failure. The harness knows none of these, so a new kind changes no line there.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

import numpy as np
import numpy.typing as npt

from proofroll.core.arrays import FloatArray, read_only
from proofroll.core.columns import Columns
from proofroll.core.gravity import Gravity
from proofroll.core.observable import Observable
from proofroll.core.parameters import Parameters

if TYPE_CHECKING:
    import xarray as xr

    from proofroll.core.certificate import Line
    from proofroll.core.engine import Sample
    from proofroll.core.scene import Scene


@dataclass(frozen=True)
class Sign:
    """A sign of failure of a run, and the samples that show it.

    Attributes:
        name: as people and files write it, e.g. ``left the surface``.
        shown: True for each sample that shows it, shape (time,).
    """

    name: str
    shown: npt.NDArray[np.bool_]


@dataclass(frozen=True)
class StepNumber:
    """A dimensionless number of a step size that may explain where steps become too long.

    Attributes:
        name: as claims write it, ``turn``.
        symbol, meaning: for a person, ``Ωh``.
        value: None or 0 if it is unknown or does not exist.
    """

    name: str
    symbol: str
    meaning: str
    value: float | None


@dataclass(frozen=True)
class FirstMotion:
    """True initial accelerations of an element's bodies, compared with an engine's first steps.

    Attributes:
        acceleration: of the bodies at time 0 in the world [m/s²], shape (bodies, 3).
        angular_acceleration: of the bodies at time 0 in the world [rad/s²], shape (bodies, 3).
        scale: size that accelerations are relative to, never zero [m/s²].
        moment: short time after which an engine without a step is sampled first [s].
        pull: acceleration by the loads alone [m/s²], the unit of errors of short runs; None: ``scale``. Relative to the
            many times larger acceleration of a fast start an error of the loads would look small.
        lasts: no body comes to rest, nor a joint to its stop, before this time [s]; then the acceleration may change.
    """

    acceleration: FloatArray
    angular_acceleration: FloatArray
    scale: float
    moment: float
    pull: float | None = None
    lasts: float = math.inf

    def __post_init__(self) -> None:
        read_only(self)


@dataclass(frozen=True)
class OptionalTerm:
    """A part of the model that the scene can have or not, for the ladder of models.

    Attributes:
        name: for a person, e.g. ``rolling resistance``.
        because: purpose, or the numbers with which it is tried.
        put, taken: parameters of the scene that switch the term on and off.
        asks: results wanted with it, besides the motion.
        capability: name under which an engine declares that it cannot leave the term out
            (:class:`proofroll.core.engine_abilities.CannotLeaveOut`).
    """

    name: str
    because: str
    put: Mapping[str, float] = field(default_factory=dict)
    taken: Mapping[str, float] = field(default_factory=dict)
    asks: tuple[str, ...] = ()
    capability: str = ""


class Element(Protocol):
    """A part of a scene, as the harness sees it: a frozen dataclass that validates itself.

    Attributes:
        name: unique in the scene; it distinguishes the variables of several elements.
        bodies: names of its rigid bodies, in the order in which a sample holds them.
        sample_type: class of the sample that an engine returns for it.
    """

    @property
    def name(self) -> str: ...  # noqa: D102 -- see the class

    @property
    def bodies(self) -> tuple[str, ...]: ...  # noqa: D102 -- see the class

    @property
    def sample_type(self) -> type[Sample]: ...  # noqa: D102 -- see the class

    @property
    def requires(self) -> frozenset[str]:
        """Capabilities that a formulation must provide to represent this element; each is a text for a person."""

    @property
    def askable(self) -> Mapping[str, str]:
        """Results that a scene may ask for besides the motion -> the capability that each needs."""

    @property
    def observables(self) -> tuple[Observable, ...]:
        """Its table of observables, listed here alone."""

    @property
    def length(self) -> float:
        """Length scale by which positions are compared [m]; never zero."""

    @property
    def natural_time(self) -> float:
        """Period of its slowest motion [s], the unit in which lengths of runs and steps are chosen."""

    def step_numbers(self, h: float, truth: xr.Dataset | None) -> Sequence[StepNumber]:
        """Dimensionless numbers of a step ``h`` [s]; the names do not depend on the arguments."""

    @property
    def first_motion(self) -> FirstMotion | None:
        """Its initial accelerations; None if they have no direction yet."""

    @property
    def softened(self) -> frozenset[str]:
        """Quantities of the certificate whose softening excuses a difference in an engine's first steps."""

    def variables(self, times: FloatArray, samples: Sequence[Any]) -> Columns:
        """All variables of a run, with ``units`` and ``long_name``.

        Args:
            times: of the samples [s], shape (time,).
            samples: one per time, of its :attr:`sample_type`.
        """

    def lacks(self, samples: Sequence[Any], asks: Sequence[str]) -> str | None:
        """One sentence about a value that the scene requires and the samples lack, or None."""

    def observe(self, dataset: xr.Dataset) -> dict[str, FloatArray]:
        """Values of each observable that a run determines; a reaction without time 0.

        Observables of samples off the grid are ``between.<name>`` along ``between`` [s]. The harness computes those
        that are variables themselves; the element computes those that need several samples.
        """

    def scales(self, truth: xr.Dataset) -> dict[str, float]:
        """Size of each observable in the truth, to which a relative tolerance refers."""

    def certify(self, built: Any, sample: Any) -> list[Line]:
        """Lines of the certificate: the engine's model and its initial sample compared with the element."""

    @property
    def failures(self) -> Mapping[str, str]:
        """Names of its signs of failure, and of causes of errors -> meaning: threshold and reason."""

    @property
    def failing_events(self) -> Mapping[str, str]:
        """Kinds of events that end a run early -> the sign of failure that each stands for."""

    def signs(self, dataset: xr.Dataset, truth: xr.Dataset | None) -> list[Sign]:
        """Signs of failure other than a wrong path."""

    def optional_terms(self, parameters: Mapping[str, float], truth: xr.Dataset) -> list[OptionalTerm]:
        """Parts of the model that parameters of the scene switch on or off."""


class ElementKind(Protocol):
    """A kind of element: how a scene file describes it, and on which scenes engines are checked.

    Attributes:
        name: of the entry point.
        tables: names of the tables of a scene file that it reads. Of a table that another kind reads, too, it gets the
            rows that refer to things in its own tables.
        units: unit of each number in them, by its key.
    """

    name: ClassVar[str]
    tables: ClassVar[tuple[str, ...]]
    units: ClassVar[Mapping[str, str]]

    @staticmethod
    def read(tables: Mapping[str, Any], gravity: Gravity, numbers: Parameters, place: str) -> Sequence[Element]:
        """The elements in the tables of a scene file.

        Args:
            tables: the file's tables of this kind.
            gravity: of the scene.
            numbers: parameters with which formulas in the tables are evaluated.
            place: the file, for messages.

        Raises:
            InputError: the first mistake, with its location.
        """

    @staticmethod
    def conformance_scenes() -> Mapping[str, Scene]:
        """Scenes on which every engine is checked, by name; the most demanding first."""

    @staticmethod
    def truth_scenes() -> Mapping[str, Scene]:
        """Short scenes that are compared with the truth and reveal confused reference frames."""


def described_by(element: Element) -> str:
    """Name of the class that declares the fields of an element; a subclass that adds none describes nothing else."""
    names = [item.name for item in fields(element)]  # type: ignore[arg-type]  # a protocol of dataclasses
    bases = [base for base in type(element).__mro__ if is_dataclass(base)]
    return next(base.__name__ for base in reversed(bases) if [item.name for item in fields(base)] == names)
