"""Optional protocols of an element."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

from proofroll.core.arrays import FloatArray
from proofroll.core.events import Event
from proofroll.core.program_text import FailedRun

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class SeenInRun:
    """Result of a watch over a run.

    Attributes:
        samples: number of samples that belong to the scene.
        events: in order; None: it has nothing to say of events.
        ended: reason of an end without a failure, or None.
    """

    samples: int
    events: Sequence[Event] | None
    ended: str | None = None


@runtime_checkable
class TellsStart(Protocol):
    """Optional ability of an element: tells in words how it starts, for a person who wrote a scene."""

    @property
    def start_facts(self) -> Sequence[str]:
        """Short sentences: where its bodies are, how they move, what holds them, how many ways they can move."""


class RunWatch(Protocol):
    """Follows one run."""

    def over(self, sample: Any) -> bool:
        """True if the model is no longer that of the scene, so that the run ends here."""

    def conclude(self, times: FloatArray, samples: Sequence[Any], located: Sequence[Event] | None) -> SeenInRun:
        """Result of the watch.

        Args:
            times: of the samples [s]; there may be fewer samples.
            samples: of the element.
            located: the engine's own events (:class:`proofroll.core.engine_abilities.LocatesEvents`), or None.
        """


@runtime_checkable
class WatchesRuns(Protocol):
    """Ability of an element that has events, or whose runs can leave the scene."""

    def watch(self, asks: Sequence[str]) -> RunWatch:
        """A watch over a run that is about to begin."""

    def common_span(
        self, truth: xr.Dataset, runs: Mapping[Any, xr.Dataset]
    ) -> tuple[xr.Dataset, dict[Any, xr.Dataset]]:
        """The truth and runs of it as far as they are comparable."""


@runtime_checkable
class CountsTurns(Protocol):
    """Ability of an element whose angles go on beyond a turn."""

    @property
    def turn_interval(self) -> float | None:
        """Longest sampling interval over which rates still count whole turns [s].

        None: it has no such angle.
        """


@runtime_checkable
class HasOptionalCapabilities(Protocol):
    """Ability of an element whose scenes may do without some capability of a formulation."""

    @property
    def optional(self) -> frozenset[str]:
        """Capabilities that are in an engine's model only where :attr:`Element.requires` or a question names them."""


@runtime_checkable
class KnowsAnotherScene(Protocol):
    """Ability of an element whose model can be of another kind though each of its numbers is allowed."""

    def another_scene(self, lines: Sequence[Mapping[str, Any]], truth: xr.Dataset) -> str | None:
        """Reason that the model is of another kind, as one clause; None: it is of the same.

        Args:
            lines: of a stored certificate (:meth:`proofroll.core.certificate.Line.as_dict`).
            truth: the true run.
        """


@runtime_checkable
class ExplainsErrors(Protocol):
    """Ability of an element that can explain a bounded error of the path."""

    def cause(self, dataset: xr.Dataset, error: float) -> str | None:
        """Cause of an ``error`` of the deciding observable, in its unit, at the end of a run.

        A name that ``meanings`` has; None: nothing that the element knows of.
        """


@runtime_checkable
class WritesPrograms(Protocol):
    """Ability of an element that can write a program to show the failure of a run."""

    def failure_program(self, failed: FailedRun, engine: str | None) -> str:
        """Source of the program, which exits with 1 if the failure shows.

        Args:
            failed: the run.
            engine: its part (:class:`proofroll.core.engine_abilities.Reproduces`); None: the program asks proofroll.
        """
