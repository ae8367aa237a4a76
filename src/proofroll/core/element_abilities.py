"""Optional protocols of an element."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

from proofroll.core.arrays import FloatArray
from proofroll.core.bounces import Bounce
from proofroll.core.columns import Columns
from proofroll.core.events import Event
from proofroll.core.program_text import FailedRun

if TYPE_CHECKING:
    import xarray as xr

    from proofroll.core.element import Element


@dataclass(frozen=True)
class SeenInRun:
    """Result of watching a run.

    Attributes:
        samples: number of samples before the run left the scene.
        events: in order; None: the watch does not look for events.
        ended: reason of an end without a failure, or None.
    """

    samples: int
    events: Sequence[Event] | None
    ended: str | None = None


@runtime_checkable
class TellsStart(Protocol):
    """Ability of an element that describes its start in words, for the author of a scene."""

    @property
    def start_facts(self) -> Sequence[str]:
        """Short sentences: its bodies' positions and velocities, what holds them, its degrees of freedom."""


@runtime_checkable
class DoubtsNumbers(Protocol):
    """Ability of an element that recognises numbers in a wrong unit, for the author of a scene."""

    @property
    def implausible(self) -> Sequence[str]:
        """Sentences on implausible numbers, each with the name of its part and the likely mistake."""


@runtime_checkable
class MovesFreely(Protocol):
    """Ability of an element that knows which of its tracked points no joint and no contact accelerates."""

    @property
    def free_points(self) -> Sequence[str]:
        """Names of tracked points of bodies that nothing holds or touches."""


@runtime_checkable
class BoundsSteps(Protocol):
    """Ability of an element whose laws bound the step of explicit schemes, known before any run.

    It may have the attribute ``longest_step`` [s], too, beyond which a ladder of steps shows nothing.
    """

    def step_bound(self, taken: Iterable[float]) -> str | None:
        """Clause on the longest stable step and on the steps that engines take [s]; None: nothing bounds it."""


def step_bound(elements: Iterable[object], taken: Iterable[float] = ()) -> str:
    """Clause on the longest stable step of a scene's elements (:class:`BoundsSteps`); empty: nothing bounds it."""
    steps = [*taken]
    bounds = (element.step_bound(steps) for element in elements if isinstance(element, BoundsSteps))
    return "; ".join(filter(None, bounds))


def longest_step(elements: Iterable[object]) -> float:
    """Longest stable step of explicit schemes [s], by ``longest_step`` of elements that bound it; inf: none does."""
    return min((float(getattr(element, "longest_step", math.inf)) for element in elements), default=math.inf)


class RunWatch(Protocol):
    """Watches one run for events and for its end."""

    def over(self, sample: Any) -> bool:
        """True if the run ends at this sample because it has left the scene's model."""

    def conclude(self, times: FloatArray, samples: Sequence[Any], located: Sequence[Event] | None) -> SeenInRun:
        """Result of the watch.

        Args:
            times: planned times of samples [s].
            samples: of the element; fewer than times if the run ended early.
            located: the engine's own events (:class:`proofroll.core.engine_abilities.LocatesEvents`), or None.
        """


@runtime_checkable
class TellsBounces(Protocol):
    """Ability of a watch over bodies that bounce."""

    def bounces(self, columns: Columns) -> Sequence[Bounce]:
        """Energy and height of each impact among the events of a run, from its samples.

        Args:
            columns: of the run, under the element's own names.
        """


@runtime_checkable
class WatchesRuns(Protocol):
    """Ability of an element that has events, or whose runs can leave the scene."""

    def watch(self, asks: Sequence[str]) -> RunWatch:
        """Watch over a run that is about to begin; ``asks`` are the results that the scene asks for."""

    def common_span(
        self, truth: xr.Dataset, runs: Mapping[Any, xr.Dataset]
    ) -> tuple[xr.Dataset, dict[Any, xr.Dataset]]:
        """Truth and runs cut to the time in which they are comparable."""


@runtime_checkable
class CountsTurns(Protocol):
    """Ability of an element whose angles exceed a full turn."""

    @property
    def turn_interval(self) -> float | None:
        """Longest sampling interval over which rates still count whole turns [s].

        None: the observable has no such angle.
        """


@runtime_checkable
class HasOptionalCapabilities(Protocol):
    """Ability of an element with capabilities that not every scene needs."""

    @property
    def optional(self) -> frozenset[str]:
        """Capabilities that an engine models only if :attr:`Element.requires` or a question names them."""


class HeldValues(Protocol):
    """Values of an element's held signals at the instants of one run."""

    def next_instant(self, t: float) -> float:
        """First instant after a time [s]; inf: there is none."""

    def values(self, t: float, sample: Any) -> FloatArray:
        """Values from the instant ``t`` [s] on; to be called at every instant in turn, 0 among them.

        Args:
            t: the instant.
            sample: of the element, then.
        """


@runtime_checkable
class HoldsTargets(Protocol):
    """Ability of an element with signals that hold from one instant to the next, as the targets of a controller."""

    def commands(self) -> HeldValues | None:
        """Values of its held signals for a run that is about to begin; None: it has none."""

    def along(self, run: xr.Dataset | None) -> Element | None:
        """The element with the held values that it had in a run, as functions of time; None: they are not known.

        Args:
            run: variables of the element; None: of a start without a run.
        """


@runtime_checkable
class BeginsAnywhere(Protocol):
    """Ability of an element that may begin with other coordinates and rates than its scene's."""

    def begun(self, values: Mapping[str, float]) -> Element | None:
        """The element that begins with these values; None: they are not all of its start, or it cannot begin so.

        Args:
            values: variables of the first row of a run, by name, in the truth's units.
        """


@runtime_checkable
class KnowsAnotherScene(Protocol):
    """Ability of an element that can tell when an engine built a different kind of model with admissible numbers."""

    def another_scene(self, lines: Sequence[Mapping[str, Any]], truth: xr.Dataset) -> str | None:
        """Reason why the engine's model represents another kind of scene than the one asked for; None: it does not.

        Args:
            lines: of a stored certificate (:meth:`proofroll.core.certificate.Line.as_dict`).
            truth: the true run.
        """


@runtime_checkable
class ExplainsErrors(Protocol):
    """Ability of an element that can explain a bounded error of the path."""

    def cause(self, dataset: xr.Dataset, error: float) -> str | None:
        """Cause of an error of the path at the end of a run: a name in :attr:`Element.failures`, or None if unknown.

        Args:
            dataset: the run.
            error: of the deciding observable, in its unit.
        """


@runtime_checkable
class WritesPrograms(Protocol):
    """Ability of an element that can write a program to show the failure of a run."""

    def failure_program(self, failed: FailedRun, engine: str | None) -> str:
        """Source of the program, which exits with 1 if the failure shows.

        Args:
            failed: the run.
            engine: the engine's part of the program (:class:`proofroll.core.engine_abilities.Reproduces`); None: the
                program runs the engine by proofroll.
        """
