"""The search along one setting of an engine: which step to run next, until it is decided whether one may be advised."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import NamedTuple

from proofroll.core.number_format import number
from proofroll.running.case import EngineFacts, Status
from proofroll.studies.answer.judged_run import REFUSALS, JudgedRun, least_of_limit


class State(StrEnum):
    """Result of a search for a setting, or for an engine."""

    HOLDS = "holds"
    UNCONFIRMED = "holds, not confirmed"  # one step holds; half of it, or another check, is not affordable
    FINER = "finer steps than affordable"
    ELSEWHERE = "leads elsewhere"  # shown by three halvings
    REFUSED = "refused"
    CANNOT = "cannot"  # no formulation has what the scene requires
    SILENT = "not reported"  # it reports no forces
    NOT_RUN = "not run"  # missing, or the search ended before
    DEARER = "dearer"  # of a setting only: whatever step it needs costs more than the engine's choice
    OPEN = "open"  # of a setting only: the search goes on


class SearchCaps(NamedTuple):
    """Processor time of one run, and of the search of one engine in one scene [s]."""

    run: float = 8.0
    engine: float = 30.0


WHOLE = SearchCaps()
# Of the many searches of a report; for the longest `recommend` is there.
BRIEF = SearchCaps(4.0, 12.0)
UNSEARCHED = SearchCaps(0.0, 0.0)  # of a question about one given step
# Loosest relative tolerance of a scheme that adapts its steps; number of tighter ones, and the factor between two.
LOOSEST, _TIGHTEST, _DECADE = 1e-3, 10, 10
# Most halvings of the sampling interval.
_FINEST = 40
# Factor by which a tenth of a relative tolerance is assumed to cost more.
_TIGHTER = 1.5
# Errors that do not fall by this factor from a step to its half may be small by luck; they must leave this margin.
_REGULAR, _MARGIN = 1.5, 2.0
# A coarser step is sound up to this part of the size of a quantity, or this many times what is allowed.
_SOUND, _TIMES = 0.05, 30.0
# A limit of small steps leads elsewhere if it is off by this many times what is allowed.
_ELSEWHERE = 1.05
# Three halvings of the step that leave this part of the error come no nearer.
_STAYS = 0.7
# A run that confirms a step is made though nothing is left, if it takes at most this part of an engine's time.
_CONFIRMS = 1 / 12
# Errors at several relative tolerances are the same from this ratio on.
_ALIKE = 0.99
# Most halvings at once; most refusals and most runs without an end before a setting is given up.
_JUMP, _REFUSALS, _BROKEN = 4, 3, 6


@dataclass
class SettingSearch:
    """State of the search along one engine, formulation and preset.

    A step is the first one over a whole number, the divisor: powers of two, and for checks three or five times one. A
    relative tolerance is the loosest one over a power of ten.

    Attributes:
        spec: ``name[formulation=…,preset=…]``.
        facts: with the preset's own step or tolerance.
        first: coarsest step of the search [s], or loosest relative tolerance.
        until: length of the runs [s].
        allowed: observable -> largest error.
        sizes: observable -> size.
        start: halvings of the first step at which the search begins.
        given: step or relative tolerance that a person gave, the only one that is run; None: it is searched.
        runs: divisor -> run.
        unsafe: halvings whose step holds and must not be advised.
        state, why: result of the search, and a clause with its reason.
        level: halvings of the advised step, or of the one that holds and is not confirmed.
        needs: step that the tolerance needs at best, and the processor time of its run [s].
        caps: of the search.
    """

    spec: str
    facts: EngineFacts
    first: float
    until: float
    allowed: Mapping[str, float]
    sizes: Mapping[str, float]
    start: int = 0
    given: float | None = None
    caps: SearchCaps = WHOLE
    runs: dict[int, JudgedRun] = field(default_factory=dict)
    unsafe: dict[int, str] = field(default_factory=dict)
    state: State = State.OPEN
    why: str = ""
    level: int | None = None
    needs: tuple[float, float] | None = None

    @property
    def fixed_step(self) -> bool:
        """True if the search is over steps; False: over relative tolerances, or there is one run only."""
        return self.facts.resolution == "dt"

    @property
    def base(self) -> int:
        """Factor between the divisors of two levels."""
        return 2 if self.fixed_step else _DECADE

    @property
    def order(self) -> int:
        """Declared order of convergence, 1 if there is none."""
        return self.facts.order or 1

    @property
    def _growth(self) -> float:
        """Factor on the cost from one level to the next."""
        return 2.0 if self.fixed_step else _TIGHTER

    @property
    def _last(self) -> int:
        if self.facts.resolution is None or self.given is not None:
            return 0
        return _FINEST if self.fixed_step else _TIGHTEST

    def divisor(self, level: int) -> int:
        """Divisor of a level."""
        return int(self.base**level)

    def step(self, divisor: int) -> float:
        """Step [s] or relative tolerance of a divisor."""
        if self.facts.resolution is None or self.given is not None:
            return self.given or 0.0
        return float(f"{self.first / divisor:.12g}") if self.fixed_step else float(f"{self.first / divisor:.6g}")

    @property
    def levels(self) -> dict[int, JudgedRun]:
        """Halvings of the first step, or tenths of the loosest tolerance -> run; checks are left out."""
        levels = ((round(math.log(divisor, self.base)), divisor) for divisor in sorted(self.runs))
        return {n: self.runs[divisor] for n, divisor in levels if self.divisor(n) == divisor}

    @property
    def chosen(self) -> JudgedRun | None:
        """Run of the advised step, or of the one that holds and is not confirmed."""
        return None if self.level is None else self.runs[self.divisor(self.level)]

    def size(self, divisor: int) -> float:
        """Largest error over what is allowed of a run that was made."""
        size = self.runs[divisor].of_allowed(self.allowed)
        return math.inf if size is None else size

    @property
    def least(self) -> float:
        """Least cost that an advised step can still have [s/s]: a bound, by the better of declared and seen order."""
        levels = self.levels
        if not levels:
            return 0.0
        good, bad = self._bracket()
        if good is not None:
            return levels[good].cost / self._growth ** (good - bad - 1)
        finest = max(levels)
        run = levels[finest]
        if run.status in REFUSALS or not math.isfinite(run.cost):
            return 0.0
        return run.cost if run.status is not Status.DONE else run.cost * self._growth ** self._fewest(finest)

    def decide(self, state: State, why: str = "") -> None:
        """Ends the search of this setting."""
        self.state, self.why = state, why

    def next_divisor(self, left: float) -> int | None:
        """Divisor of the step to run next; None: the setting is decided.

        ``left``: processor time that the engine's search may still take [s].
        """
        levels = self.levels
        if not levels:
            return self.divisor(self.start)
        if self.state is not State.OPEN or self._given_up(levels):
            return None
        good, bad = self._bracket()
        if good is None:
            return self._finer(levels, left)
        if good - bad > 1:
            return self.divisor(self._coarser(good, bad))
        is_confirmed = good == self._last or good + 1 in levels
        return self._checked(good, left) if is_confirmed else self._affordable(good + 1, left, held=good)

    def _bracket(self) -> tuple[int | None, int]:
        """Coarsest level that holds with all finer ones, and the level that fails before it; -1: none fails."""
        sizes = {n: self.size(self.divisor(n)) for n in self.levels}
        bad = max((n for n, size in sizes.items() if size > 1 or n in self.unsafe), default=-1)
        return min((n for n in sizes if n > bad), default=None), bad

    def _given_up(self, levels: Mapping[int, JudgedRun]) -> bool:
        """True if the setting is decided without an error: refused, missing, silent, or never at its end."""
        runs = list(levels.values())
        latest = runs[-1]
        refused = [run for run in runs if run.status in REFUSALS]
        if any(run.of_allowed(self.allowed) is None for run in runs):
            self.decide(State.SILENT, "it does not report all that is asked for")
        elif latest.status is Status.MISSING:
            self.decide(State.NOT_RUN, latest.message)
        elif latest.status is Status.ANOTHER_SCENE:
            self.decide(State.REFUSED, latest.message)
        elif len(refused) == len(runs) and (len(runs) >= _REFUSALS or not self.fixed_step):
            self.decide(State.REFUSED, latest.message)  # one refusal may be that of a step
        elif all(run.status is Status.CRASHED for run in runs) and len(runs) > 1:
            self.decide(State.NOT_RUN, latest.message)
        elif all(run.status is Status.TIMEOUT for run in runs) and (len(runs) > 1 or not self.fixed_step):
            self.decide(State.FINER, f"no run ended within {latest.spent:.0f} s")
        return self.state is not State.OPEN

    def _coarser(self, good: int, bad: int) -> int:
        """Level between one that fails and one that holds, where by the order of the scheme the tolerance is met."""
        size = max(self.size(self.divisor(good)), 1e-12)
        levels = math.log2(1 / size) / self.order if self.fixed_step else math.log10(1 / size)
        return max(bad + 1, good - max(1, min(_JUMP, int(levels))))

    def _finer(self, levels: Mapping[int, JudgedRun], left: float) -> int | None:
        """Divisor of a finer level, where no step holds yet; None: the setting is decided."""
        finest = max(levels)
        run, size = levels[finest], self.size(self.divisor(finest))
        done = [n for n, item in levels.items() if item.status is Status.DONE]
        if finest >= self._last:
            worst = run.worst(self.allowed)
            told = f"{worst} is off by {number(size)} times what is allowed" if worst else run.message
            tightest = run.status is Status.DONE and self.given is None
            self.decide(State.ELSEWHERE if tightest else State.FINER, f"{told} at {self._at(finest)}")
        elif run.status in REFUSALS:
            return self.divisor(finest + 2)
        elif run.status is Status.TIMEOUT and done:
            self.decide(State.FINER, f"no result within {run.spent:.0f} s at {self._at(finest)}")
        elif not done and len(levels) >= _BROKEN:
            self.decide(State.FINER, f"{run.message} at {self._at(finest)}, as at {len(levels) - 1} coarser steps")
        elif self.fixed_step and done[-3:] == [finest - 2, finest - 1, finest]:
            three = levels[finest - 2], levels[finest - 1], run
            if (least := least_of_limit(three, self.allowed)) > _ELSEWHERE:
                self.decide(State.ELSEWHERE, f"its limit of small steps is off by {number(least)} times or more")
            elif done[-4:-3] == [finest - 3] and size > _STAYS * self.size(self.divisor(finest - 3)):
                self.decide(State.FINER, "three halvings of the step came no nearer")
        elif len(done) > 2 and self._relative(finest) <= _SOUND and self._stays(done[-3:]):
            self.decide(State.ELSEWHERE, f"off by {number(size)} times what is allowed at three tolerances")
        if self.state is not State.OPEN:
            return None
        return self._affordable(finest + self._jump(levels, finest), left)

    def _stays(self, levels: Sequence[int]) -> bool:
        """True if errors at relative tolerances are the same, so that something else than the tolerance makes them."""
        sizes = [self.size(self.divisor(n)) for n in levels]
        return not self.fixed_step and min(sizes) > _ALIKE * max(sizes)

    def _jump(self, levels: Mapping[int, JudgedRun], finest: int) -> int:
        """Number of halvings to the next step: more than one where the error is far too large and falls."""
        size = self.size(self.divisor(finest))
        level = self._before(finest)
        falls = level is None or self._relative(level) > _SOUND
        falls = falls or size <= self.size(self.divisor(level or 0)) * 2.0 ** (-0.5 * (finest - (level or 0)))
        if not (self.fixed_step and falls and math.isfinite(size) and levels[finest].status is Status.DONE):
            return 1
        return max(1, min(_JUMP, int(math.log2(size) / (max(self.order, 2) + 2))))

    def _before(self, finest: int) -> int | None:
        """Next coarser level than the finest with a run that ended."""
        return max((n for n, run in self.levels.items() if n < finest and run.status is Status.DONE), default=None)

    def _relative(self, level: int) -> float:
        """Largest error of a level's run over the size of its quantity."""
        run = self.runs[self.divisor(level)]
        if run.status is not Status.DONE:
            return math.inf
        parts = (run.errors[name] / self.sizes[name] for name in self.allowed if self.sizes.get(name))
        return max(parts, default=0.0)

    def _rate(self, finest: int) -> float | None:
        """Power of the step with which the errors of the last two runs fall; None: they are no such pair."""
        level = self._before(finest)
        if level is None or not self.fixed_step or self._relative(level) >= _SOUND:
            return None
        ratio = self.size(self.divisor(level)) / max(self.size(self.divisor(finest)), 1e-300)
        return math.log2(ratio) / (finest - level) if ratio > 1 else None

    def _fewest(self, finest: int) -> float:
        """Fewest further halvings after which the tolerance can be held."""
        size = self.size(self.divisor(finest))
        if not self.fixed_step or not math.isfinite(size):
            return 1.0
        rate = self._rate(finest)
        return max(1.0, math.log2(size) / (self.order + 2 if rate is None else max(rate, self.order)))

    def _seconds(self, level: int) -> float:
        """Predicted processor time of a run [s], from the nearest coarser one that was made, or else a finer one."""
        ended = {n: run for n, run in self.levels.items() if math.isfinite(run.cost)}
        if not ended:
            return 0.0
        nearest = max((n for n in ended if n <= level), default=min(ended))
        seconds = ended[nearest].cost * self.until * self._growth ** max(0, level - nearest)
        # a scheme that fails may take longer than at a finer step
        return seconds if ended[nearest].status is Status.DONE else min(seconds, self.caps.run)

    def _affordable(self, level: int, left: float, held: int | None = None) -> int | None:
        """Divisor of a level if its run is affordable; None: the setting is decided.

        ``held``: level that holds and would be confirmed.
        """
        seconds, finest = self._seconds(level), max(self.levels)
        if held is None and self._rate(finest) is not None:
            halvings = self._fewest(finest)
            needed = self.levels[finest].cost * self.until * 2.0**halvings
            if needed > 2 * self.caps.run:
                self.needs = self.step(self.divisor(finest)) / 2.0**halvings, needed
                self.decide(State.FINER, f"a run of more than {self.caps.run:g} s of processor time")
                return None
        spent = self.levels[finest].status is Status.TIMEOUT
        is_left = left > 0 or (held is not None and self._confirms(seconds))
        if seconds <= self.caps.run and is_left and not (spent and held is not None):
            return self.divisor(level)
        if held is not None:
            check, fault = self._uneven_check(held)
            if fault:
                self.unsafe[held] = fault
                return self.next_divisor(left)
            if check is not None and left > 0 and self._seconds(held) * 1.5 <= self.caps.run:
                return check
        reason = (
            f"the next step takes {seconds:.0f} s of processor time, and a run may take {self.caps.run:g}"
            if seconds > self.caps.run
            else f"the search of this engine has used its {self.caps.engine:g} s of processor time"
        )
        self.level = held
        self.decide(State.FINER if held is None else State.UNCONFIRMED, reason)
        return None

    def _confirms(self, seconds: float) -> bool:
        """True if a run is short enough to confirm a step beyond the engine's time."""
        return seconds <= _CONFIRMS * self.caps.engine

    def _checked(self, good: int, left: float) -> int | None:
        """Divisor of a check of a step that holds, as its half does; None: the setting is decided.

        Where errors do not fall in order, or leave little room, a step that is no half has to hold, too; where twice
        the step breaks, a third more than the step must not.
        """
        check, fault = self._next_check(good)
        if check is not None:
            is_left = left > 0 or self._confirms(self._seconds(good))
            return check if is_left else self._affordable(good, left, held=good)
        if fault:
            self.unsafe[good] = fault
            return self.next_divisor(left)
        self.level = good
        if self.given is None:
            self.decide(State.HOLDS)
        else:
            self.decide(State.UNCONFIRMED, "no other step was asked for")
        return None

    def _next_check(self, good: int) -> tuple[int | None, str]:
        """Divisor of a check that is still to be made of a level that holds, or the fault that its checks show."""
        if self.given is not None or good == self._last:
            return None, ""
        check, fault = self._order_check(good)
        return (check, fault) if check is not None or fault or not self.fixed_step else self._breakdown_check(good)

    def _order_check(self, good: int) -> tuple[int | None, str]:
        """Check of a step that is no half, where errors do not fall in order; see :meth:`_next_check`."""
        divisor = self.divisor(good)
        sizes = [self.size(divisor), self.size(self.base * divisor)]
        irregular = sizes[0] < _REGULAR * sizes[1] or bool(self.unsafe)
        if not irregular and (sizes[0] <= 1 / _MARGIN or self.order > 1):
            return None, ""
        uneven, fault = self._uneven_check(good)
        if uneven is not None or fault:
            return uneven, fault
        if self.fixed_step:
            sizes.append(self.size(self._uneven(good)))
        stays = self.fixed_step and max(sizes) + _MARGIN * (max(sizes) - min(sizes)) <= 1  # as of a soft contact
        if irregular and max(sizes) > 1 / _MARGIN and not stays:
            fault = f"from {self._at(good)} on errors do not fall in order, with less than a factor of {_MARGIN:g}"
        return None, fault

    def _uneven(self, good: int) -> int:
        """Divisor of a step between a level and the next one."""
        return 5 * self.divisor(good) // 4 if good >= 2 else 3

    def _uneven_check(self, good: int) -> tuple[int | None, str]:
        """Check of a step that is no half of any other, or the fault that it shows; see :meth:`_next_check`."""
        uneven = self._uneven(good)
        if not self.fixed_step or self.given is not None:
            return None, ""
        if uneven not in self.runs:
            return uneven, ""
        if (between := self.size(uneven)) <= 1 or self.runs[uneven].status is Status.TIMEOUT:
            return None, ""
        lucky, off = number(self.step(self.divisor(good)), 3), number(self.step(uneven), 3)
        return None, f"dt {lucky} s holds by luck: dt {off} s is off by {number(between)} times what is allowed"

    def _breakdown_check(self, good: int) -> tuple[int | None, str]:
        """Check of a third more than the step, where twice of it breaks down; see :meth:`_next_check`."""
        divisor = self.divisor(good)
        if good - 1 not in self.levels or self._sound(divisor // 2):
            return None, ""
        if good < 2:
            fault = "takes too long" if self.runs[divisor // 2].status is Status.TIMEOUT else "breaks down"
            return None, f"twice dt {number(self.step(divisor), 3)} s {fault}"
        third = 3 * divisor // 4
        if third not in self.runs:
            return third, ""
        steps = f"dt {number(self.step(divisor), 3)} s is too near to dt {number(self.step(third), 3)} s"
        return None, "" if self._sound(third) else f"{steps}, which breaks down"

    def _sound(self, divisor: int) -> bool:
        """True if a run ended near the truth: it did not break down, though it may not hold the tolerance."""
        run = self.runs[divisor]
        if run.status is not Status.DONE:
            return False
        relative = (run.errors[name] / self.sizes[name] for name in self.allowed if self.sizes.get(name))
        return max(relative, default=0.0) <= _SOUND or self.size(divisor) <= _TIMES

    def _at(self, level: int) -> str:
        return f"{self.facts.resolution} {number(self.step(self.divisor(level)), 3)}{' s' if self.fixed_step else ''}"
