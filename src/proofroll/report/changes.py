"""Changes since an earlier report: of verdicts, of errors beyond their bars, of costs beyond their intervals."""

from __future__ import annotations

import json
import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import Any, TypeGuard

from proofroll.core.errors import InputError
from proofroll.core.number_format import counted, error, number
from proofroll.files.atomic import ordinary_content
from proofroll.report.labels import INSTALLED, step
from proofroll.report.long_table import COLUMNS, TableLine

# Changes of an error that count as round-off of another build: relative to the quantity's size, and to the error.
_OF_SCALE, _OF_ERROR = 1e-9, 1e-3
# Costs whose intervals do not overlap are reported only if they also differ by this factor, for hundreds are compared
# and a machine's speed varies. The factor is larger where costs scatter: six median deviations, which are four standard
# deviations of a normal scatter; one cost in 20,000 exceeds them.
_COST, _SCATTERS = 1.5, 6.0
# Observed orders that differ by more belong to different methods; a ladder shows an order to a tenth or two.
_ANOTHER_ORDER = 0.5
# Digits for changed errors: the first that shows a difference is taken.
_DIGITS = (2, 4, 8, 17)
# Kinds of changes, the gravest first, with words for their number.
_KINDS = {
    "verdict": "verdicts", "value": "errors", "cost": "costs", "gone": "runs that are gone", "new": "new runs",
}  # fmt: skip
# Most rows of the table in a comment.
_MOST_ROWS = 40
# Least number of costs that show how much slower the machine was.
_ENOUGH = 5


@dataclass(frozen=True)
class RunChange:
    """One run that changed.

    Attributes:
        study, run, place: names of the study and the run, and parameters of the run in words.
        kind: the first of ``verdict``, ``value``, ``cost``, ``gone`` and ``new`` that applies.
        says: the changes as clauses.
    """

    study: str
    run: str
    place: str
    kind: str
    says: list[str]


@dataclass(frozen=True)
class Against:
    """Comparison of an earlier report with this one.

    Attributes:
        old: path of the earlier report.
        date: date of the earlier report.
        machines: both machines.
        versions: packages whose version changed: name -> both versions.
        costs: True if costs were compared, for both reports are of one machine.
        drift: median ratio of all costs: the machine's change, by which old costs are multiplied first.
        factor: least factor between costs that counts as a change; larger where costs scatter.
        compared: number of runs in both.
        changes: the runs that changed.
    """

    old: str
    date: str
    machines: tuple[str, str]
    versions: dict[str, tuple[str, str]]
    costs: bool
    drift: float
    factor: float
    compared: int
    changes: list[RunChange]

    @property
    def changed(self) -> bool:
        """True if a run of both reports changed or is gone; new runs do not count."""
        return any(item.kind != "new" for item in self.changes)

    @property
    def sentence(self) -> str:
        """Sentence with the number of changes of each kind."""
        kinds = [item.kind for item in self.changes]
        counts = ", ".join(f"{kinds.count(kind)} {text}" for kind, text in _KINDS.items() if kind in kinds)
        costs = f"; costs are {number(self.drift)} of the old ones throughout; this factor is left out"
        if not self.costs:
            ratio = f", {number(self.drift)} of the old ones in the middle" if self.drift != 1.0 else ""
            costs = f"; costs are of another machine{ratio}, and not compared one by one"
        elif 1 / _COST < self.drift < _COST:
            costs = ""
        if self.costs and self.factor > _COST:
            costs += f"; costs scatter, so that only those count that differ by a factor of {number(self.factor)}"
        return f"Of {counted(self.compared, 'runs')} in both reports, changed: {counts or 'nothing'}{costs}."

    @property
    def lines(self) -> list[str]:
        """Both reports, the sentence, what they were made with, and a line for all runs with the same change."""
        made_with = [f"{name} {old} → {new}" for name, (old, new) in self.versions.items()]
        lines = [f"Against {self.old} of {self.date[:10]}. {self.sentence}"]
        lines += [f"Other versions: {', '.join(made_with)}."] if made_with else []
        return lines + [f"!! {'; '.join(runs)}: {change}{_several(runs)}" for change, runs in self._runs.items()]

    @property
    def markdown(self) -> str:
        """The changes as a comment on a change of code, in Markdown: the sentence, versions, and a table."""
        made_with = ", ".join(f"{name} {old} → {new}" for name, (old, new) in self.versions.items())
        text = [f"**proofroll**, against the report of {self.date[:10]}: {self.sentence}"]
        text += [f"Other versions: {made_with}."] if made_with else []
        rows = list(self._runs.items())
        table = [f"| {_cell(change)} | {_cell(runs[0])}{_several(runs)} |" for change, runs in rows[:_MOST_ROWS]]
        if rows:
            text.append("\n".join(["| change | run |", "| --- | --- |", *table]))
        if len(rows) > _MOST_ROWS:
            text.append(f"… and {counted(len(rows) - _MOST_ROWS, 'changes')} more.")
        return "\n\n".join(text) + "\n"

    @property
    def _runs(self) -> dict[str, list[str]]:
        """Change in words -> the runs that have it."""
        runs: dict[str, list[str]] = defaultdict(list)
        for item in self.changes:
            place = f" at {item.place}" if item.place else ""
            runs["; ".join(item.says) or item.kind].append(f"{item.study}: {item.run}{place}")
        return runs


def _several(runs: list[str]) -> str:
    """Number of runs in brackets, if there are several."""
    return f" ({len(runs)} runs)" if len(runs) > 1 else ""


def _cell(text: str) -> str:
    """Text as a cell of a table in Markdown."""
    return text.replace("|", "\\|").replace("\n", " ")


@dataclass(frozen=True)
class EarlierReport:
    """An earlier report, as far as it is used: date, machine, versions, long table; ``names``: engines for readers."""

    path: Path
    date: str
    machine: str
    versions: dict[str, str]
    lines: list[TableLine]
    names: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def read(cls, path: Path, option: str = "--against") -> EarlierReport:
        """Earlier report from its ``report.json`` or the folder with it, the value of the command's ``option``.

        Raises:
            InputError: the report cannot be read, or has no long table.
        """
        path = path / "report.json" if path.is_dir() else path
        try:
            content: dict[str, Any] = json.loads(ordinary_content(path))
            table, made = content["table"], content["environment"]
            rows = [dict(zip(table["columns"], row, strict=True)) for row in table["data"]]
            # Reports of format 1 have further lines, with a ``record``.
            lines = [TableLine(**{name: row[name] for name in COLUMNS}) for row in rows if not row.get("record")]
            return cls(path, content["date"], made["machine"], made["versions"], lines, content.get("names", {}))
        except OSError as problem:
            why = f"cannot be read: {problem.strerror or problem}; proofroll report writes one"
            raise InputError(option, path, why) from None
        except (KeyError, RecursionError, TypeError, ValueError):
            raise InputError(option, path, "is no report.json with a long table; proofroll report writes one") from None

    def against(self, old: EarlierReport) -> Against:
        """Changes from an earlier report to this one."""
        return against(old, self.lines, self.machine, self.versions)


def against(old: EarlierReport, lines: Iterable[TableLine], machine: str, versions: dict[str, str]) -> Against:
    """Changes from an earlier report to the lines of this one, in the studies that both have."""
    old_runs, new_runs = runs_of(old.lines), runs_of(lines)
    shared = {study for study, *_ in old_runs} & {study for study, *_ in new_runs}
    costs = old.machine == machine
    drift, factor = _noise((_first(old_runs[key]), _first(run)) for key, run in new_runs.items() if key in old_runs)
    changes = []
    for key in dict.fromkeys([*new_runs, *old_runs]):
        study, place, run, *_ = key
        if study not in shared:
            continue
        differences = list(_changes(old_runs.get(key), new_runs.get(key), (drift, factor) if costs else None))
        if differences:
            kind = min((kind for kind, _ in differences), key=list(_KINDS).index)
            says = [text for _, text in differences if text]
            changes.append(RunChange(study=study, run=run, place=place, kind=kind, says=says))
    others = {
        name: (version, versions[name])
        for name, version in old.versions.items()
        if name in versions and versions[name] != version
    }
    both = sum(key in old_runs for key in new_runs)
    return Against(
        old=str(old.path),
        date=old.date,
        machines=(old.machine, machine),
        versions=others,
        costs=costs,
        drift=drift,
        factor=factor,
        compared=both,
        changes=changes,
    )


def runs_of(lines: Iterable[TableLine]) -> dict[tuple[str, str, str, int], dict[str, TableLine]]:
    """Lines of each run, by quantity; the key is study, place, settings, and a number among runs of equal settings."""
    rows: dict[tuple[str, str, str], dict[int, dict[str, TableLine]]] = defaultdict(dict)
    for line in lines:
        size = step(line.resolution, line.step, 6)
        run = " ".join(filter(None, (line.engine, line.formulation, line.setting.replace("default", INSTALLED), size)))
        rows[line.study, line.place, run].setdefault(line.row, {})[line.quantity] = line
    return {(*key, number): run for key, of_row in rows.items() for number, run in enumerate(of_row.values())}


def _changes(
    old_lines: dict[str, TableLine] | None, new_lines: dict[str, TableLine] | None, noise: tuple[float, float] | None
) -> Iterator[tuple[str, str]]:
    """(kind, clause) of each change of a run; None: only the other report has it, which needs no clause."""
    if old_lines is None or new_lines is None:
        yield "new" if old_lines is None else "gone", ""
        return
    old_line, new_line = _first(old_lines), _first(new_lines)
    if old_line.status != new_line.status:
        old_end = f"{old_line.status} ({old_line.message})" if old_line.message else old_line.status
        yield "verdict", f"{old_end} → {new_line.status}: {new_line.message}".removesuffix(": ")
        return
    values = []
    for name, new in new_lines.items():
        old = old_lines.get(name)
        if old is None:
            yield "verdict", f"{name} is new"
            continue
        if old.verdict != new.verdict:
            yield "verdict", f"{name or 'run'} {old.verdict or 'without verdict'} → {new.verdict or 'without verdict'}"
        if old.order and new.order and abs(old.order - new.order) > _ANOTHER_ORDER:
            yield "value", f"observed order of {name} {old.order:.2f} → {new.order:.2f}"
        if (size := _beyond(old, new)) > 0:
            digits = next(count for count in _DIGITS if error(old.error, count) != error(new.error, count))
            change = f"{error(old.error, digits)} → {error(new.error, digits)}"
            values.append((size, f"error of {name} {change} {new.unit}".removesuffix(" 1")))
    if values:
        more = f", and of {len(values) - 1} more" if len(values) > 1 else ""
        yield "value", f"{max(values)[1]}{more}"
    for name in old_lines.keys() - new_lines.keys():
        yield "verdict", f"{name} is gone"
    if noise is not None and (text := _cost(old_line, new_line, *noise)):
        yield "cost", text


def _beyond(old: TableLine, new: TableLine) -> float:
    """Change of an error beyond both error bars and round-off, relative to the quantity's size; 0 without one."""
    if not (_finite(old.error) and _finite(new.error)):
        return float(_finite(old.error) != _finite(new.error))
    scale = new.scale or max(old.error, new.error) or 1.0
    bar = (old.truth_error_bar or 0.0) + (new.truth_error_bar or 0.0)
    allowed = bar + _OF_SCALE * scale + _OF_ERROR * max(old.error, new.error)
    return max(0.0, abs(new.error - old.error) - allowed) / scale


def _finite(value: float | None) -> TypeGuard[float]:
    """True if the value is finite; None stands for an error that is not."""
    return value is not None and math.isfinite(value)


def _first(run: dict[str, TableLine]) -> TableLine:
    """Any line of a run, for fields that all its lines share."""
    return next(iter(run.values()))


def _interval(line: TableLine) -> tuple[float, float, float] | None:
    """(lowest, median, highest) cost; None if the cost has no interval."""
    if line.cost is None or line.cost_low is None or line.cost_high is None:
        return None
    return line.cost_low, line.cost, line.cost_high


def _noise(pairs: Iterable[tuple[TableLine, TableLine]]) -> tuple[float, float]:
    """Median ratio of new to old costs, and the factor beyond it that counts as a change; defaults for few costs.

    Those of clean runs, without an interval, too; where these are few, of sampled runs as well: all show the machine.
    """
    timed = [(old, new) for old, new in pairs if old.cost and new.cost]
    clean = [(old, new) for old, new in timed if old.clean and new.clean]
    both = clean if len(clean) >= _ENOUGH else timed
    ratios = [math.log(new.cost / old.cost) for old, new in both if old.cost and new.cost]
    if len(ratios) < _ENOUGH:
        return 1.0, _COST
    drift = median(ratios)
    scatter = median(abs(ratio - drift) for ratio in ratios)
    return math.exp(drift), max(_COST, math.exp(_SCATTERS * scatter))


def _cost(old: TableLine, new: TableLine, drift: float, factor: float) -> str:
    """Clause on a cost whose intervals do not overlap; empty without such a change, or without intervals."""
    old_interval, new_interval = _interval(old), _interval(new)
    if old_interval is None or new_interval is None:
        return ""
    low, high = sorted(([drift * value for value in old_interval], list(new_interval)), key=lambda item: item[1])
    if high[0] <= low[2] or high[1] < factor * low[1]:
        return ""
    between = [f"{number(line.cost)} ({number(line.cost_low)} to {number(line.cost_high)})" for line in (old, new)]
    return f"cost {between[0]} → {between[1]} s/s"
