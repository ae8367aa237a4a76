"""Records of answers: one for each scene, engine and tolerance, by which every door speaks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from proofroll.core.validation import FloatOrInf
from proofroll.studies.answer.setting_search import State
from proofroll.studies.study_store import Measured

# States that a longer search leaves as they are.
_DECIDED = {State.HOLDS, State.DEARER, State.ELSEWHERE, State.REFUSED, State.CANNOT, State.SILENT}


@dataclass(frozen=True)
class AllowedError:
    """Largest allowed error of a quantity.

    Attributes:
        quantity, unit: observable, and its unit.
        allowed: largest error in that unit.
        size: of the quantity, to which a part refers; None: it has none.
        truth_bar: error bar of the truth.
        relative: True if the tolerance was given as a part of the size.
    """

    quantity: str
    unit: str
    allowed: float
    size: float | None
    truth_bar: float
    relative: bool


@dataclass(frozen=True)
class StepTried:
    """A step that was run.

    Attributes:
        step: step [s] or relative tolerance.
        status: of the run, ``done`` if it reached the end.
        of_allowed: largest error over what is allowed; None without a result.
        reached, held_until: time of the last sample, and up to which every error is within what is allowed [s].
        seconds_per_second: processor time per simulated second; None: nothing was advanced.
        message: sentence about the end of a run that failed; else empty.
    """

    step: float
    status: str
    of_allowed: float | None
    reached: float
    held_until: float
    seconds_per_second: float | None
    message: str = ""

    @property
    def holds(self) -> bool:
        """True if the run ended within what is allowed; the step may not be confirmed."""
        return self.of_allowed is not None and self.of_allowed <= 1


@dataclass(frozen=True)
class SettingTried:
    """Search along one setting.

    Attributes:
        spec: ``name[formulation=…,preset=…]``.
        state: result of the search.
        why: clause with the reason, or empty.
        steps: all runs, coarse first.
        resolution: ``dt``, ``rtol`` or empty.
    """

    spec: str
    state: State
    why: str
    steps: list[StepTried]
    resolution: str = ""


@dataclass(frozen=True)
class EngineAnswer:
    """The answer of one engine in one scene for one tolerance.

    Attributes:
        engine, title: name of the engine, and that for a reader.
        state: holds, or why not.
        why: clause with the reason where it does not hold, or is not confirmed; else empty.
        spec: setting with its step, ``name[key=value,…]``; that nearest to the tolerance where none holds, or empty.
        formulation, preset: of that setting.
        brought: part of the computation that proofroll's adapter brings, as ``integrator``; empty: none.
        caveat: clause on what of the setting is not the engine's own; empty: nothing.
        resolution: ``dt``, ``rtol`` or empty.
        step: step [s] or relative tolerance; None: it has none.
        seconds_per_second: computing time per simulated second; None: not measured.
        timed_alone: True if the speed was measured with no other run beside it.
        bound: quantity with the largest error over what is allowed; None: nothing was judged.
        error: of that quantity, in its unit; None without a result.
        held_until: time up to which the setting holds the tolerance [s].
        coarser, finer: twice the step, and half of it, as far as they were run.
        needs_step, needs_seconds: step that the tolerance needs at best [s], and the processor time of its run [s].
        spent: processor time of the search [s].
        settings: all that were searched.
    """

    engine: str
    title: str
    state: State
    why: str
    spec: str = ""
    formulation: str = ""
    preset: str = ""
    brought: str = ""
    caveat: str = ""
    resolution: str = ""
    step: float | None = None
    seconds_per_second: float | None = None
    timed_alone: bool = False
    bound: AllowedError | None = None
    error: float | None = None
    held_until: float = 0.0
    coarser: StepTried | None = None
    finer: StepTried | None = None
    needs_step: float | None = None
    needs_seconds: float | None = None
    spent: float = 0.0
    settings: list[SettingTried] = field(default_factory=list)

    @property
    def holds(self) -> bool:
        """True if a step holds the tolerance, confirmed by half of it or not."""
        return self.state in {State.HOLDS, State.UNCONFIRMED}


@dataclass(frozen=True)
class AnsweredScene:
    """Scene and tolerance of an answer.

    Attributes:
        scene, parameters: name of the scene, and its parameters that differ from the defaults.
        until, every: time over which every run is judged, and the sampling interval [s].
        tolerance: as it was given.
        bounds: of the judged quantities.
        unjudged: observables of orientation that the tolerance does not bound.
        changes: times at which forces may jump, as at a stick or an impact, beside which they are not judged [s].
        beyond: clause on why no longer run can be judged; empty: as long was asked for.
        open: why no engine can be judged here; empty: all are.
    """

    scene: str
    parameters: dict[str, FloatOrInf]
    until: float
    every: float
    tolerance: str
    bounds: list[AllowedError]
    unjudged: list[str]
    changes: list[float]
    beyond: str
    open: str

    @property
    def allowed(self) -> dict[str, float]:
        """Quantity -> its largest allowed error, in its unit."""
        return {bound.quantity: bound.allowed for bound in self.bounds}

    @property
    def sizes(self) -> dict[str, float]:
        """Quantity -> its size, or what is allowed of one without a size, in its unit."""
        return {bound.quantity: bound.size or bound.allowed for bound in self.bounds}


@dataclass(frozen=True)
class SceneAnswer(AnsweredScene):
    """Answers of all engines in one scene for one tolerance.

    Attributes:
        engines: the cheapest that holds first.
        spent: processor time, that of the truth included [s].
        measured: time, machine and versions.
        omitted: clauses on what the scene's file describes and the answer leaves out.
    """

    engines: list[EngineAnswer]
    spent: float
    measured: Measured
    omitted: list[str] = field(default_factory=list)

    @property
    def taken(self) -> EngineAnswer | None:
        """The cheapest confirmed engine, or else the cheapest that holds; None: none does."""
        best = next(iter(self.engines), None)
        return best if best is not None and best.holds else None

    @property
    def confirmed(self) -> EngineAnswer | None:
        """The cheapest with a confirmed step: what is advised; None: there is none."""
        best = self.taken
        return best if best is not None and best.state is State.HOLDS else None

    @property
    def perhaps_faster(self) -> EngineAnswer | None:
        """The cheapest that holds without confirmation, if it is cheaper than the confirmed one; else None."""
        rival = next((item for item in self.engines if item.state is State.UNCONFIRMED), None)
        cost = (self.confirmed and self.confirmed.seconds_per_second) or 0.0
        return rival if rival is not None and 0 < (rival.seconds_per_second or 0.0) < cost else None

    @property
    def is_cut_short(self) -> bool:
        """True if the search left something open that a longer one may decide."""
        states = {state for item in self.engines for state in (item.state, *(each.state for each in item.settings))}
        return not states <= _DECIDED

    @property
    def untried(self) -> bool:
        """True if no engine could be tried: each refuses, cannot, or was not run."""
        tried = [item for item in self.engines if item.state not in {State.REFUSED, State.CANNOT, State.NOT_RUN}]
        return bool(self.engines) and not tried


@dataclass(frozen=True)
class StepAnswer(AnsweredScene):
    """Answer for a person's own step: whether it is good enough, by how much, and which step would do.

    Attributes:
        spec: engine as it was given.
        resolution, step: ``dt`` or ``rtol``, and its value.
        holds: True if the step holds the tolerance and may be advised.
        luck: clause on why a step within the tolerance must not be advised; empty: it may.
        bound, error: quantity with the largest error over what is allowed, and that error in its unit.
        status, message: of the run with this step.
        reached, held_until: time of its last sample, and up to which every error is within what is allowed [s].
        seconds_per_second: processor time of it per simulated second.
        advised: answer of the engine with this setting at other steps.
        spent: processor time [s].
        measured: time, machine and versions.
    """

    spec: str
    resolution: str
    step: float
    holds: bool
    luck: str
    bound: AllowedError | None
    error: float | None
    status: str
    message: str
    reached: float
    held_until: float
    seconds_per_second: float | None
    advised: EngineAnswer
    spent: float
    measured: Measured

    @property
    def undecided(self) -> bool:
        """True if nothing could be judged, or if the step holds the tolerance and is not confirmed."""
        within = self.bound is not None and self.error is not None and self.error <= self.bound.allowed
        return bool(self.open) or (within and not self.holds and not self.luck)


def ranked(engines: Sequence[EngineAnswer]) -> list[EngineAnswer]:
    """Answers in the order of a reader: confirmed ones, then others that hold, each the cheapest first, then the rest.

    Of those that do not hold, the nearest to the tolerance comes first.
    """

    def key(item: EngineAnswer) -> tuple[int, float, str]:
        if item.holds:
            return int(item.state is not State.HOLDS), item.seconds_per_second or 0.0, item.engine
        off = item.error / item.bound.allowed if item.bound is not None and item.error is not None else float("inf")
        return 2, off, item.engine

    return sorted(engines, key=key)
