"""Long table of a report: a line for each quantity of each run, in JSON and CSV."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

from proofroll.files.json_data import plain
from proofroll.report.labels import setting_words
from proofroll.running.environments import shown_name

if TYPE_CHECKING:
    from proofroll.running.case import EngineFacts
    from proofroll.studies.swept_settings import SweptSetting


@dataclass(frozen=True, kw_only=True)
class TableLine:
    """One quantity of one run, or a run without quantities.

    Attributes:
        study: name of the file that asked for the run.
        group: group of the scene.
        scene: name of the scene.
        place: parameters of the run in words; empty: the scene's own.
        case: all parameters of the scene in words, defaults included.
        own_case: True if all of them are the scene's own.
        until: length of the run [s].
        row: number of the run's row in its study.
        engine, version, formulation, preset, setting, precision: of the run; ``setting`` has preset and further
        options.
        own_equations: the run solves equations derived for the scene, as its truth does.
        resolution, step: setting that trades speed for accuracy, and its value.
        status, message: end of the run.
        verdict: of the quantity, or of a run without quantities; empty: none was given.
        limit: result of a ladder of steps for the quantity.
        limit_error: distance of the limit of small steps from the truth; None: there is none.
        limit_error_bar: of that distance, from the scatter of the ladder.
        limit_doubt: uncertainty of that distance; round-off, steps beside events and chance in the order included.
        floor: clause about the error floor of single precision that ends the refinement; empty: there is none.
        quantity, unit, role: the measured quantity and its role (:class:`proofroll.core.observable.Role`).
        headline: summaries show it.
        error: largest distance of this run from the truth; None: not finite, or there is none.
        truth_error_bar: of the truth, in the same unit.
        tolerance: largest error that counts as agreement; None: not given.
        scale: size of the quantity.
        order: observed order of the time step.
        cost: wall seconds per simulated second.
        cost_low, cost_high: its interval; None: it was measured once.
        clean: True if clean runs of their own measured the cost; else it is that of the sampled run, during which other
            processes ran, by processor time where that is less.
    """

    study: str
    group: str
    scene: str
    place: str
    case: str
    own_case: bool
    until: float
    row: int
    engine: str
    version: str
    formulation: str
    preset: str
    setting: str
    precision: str
    own_equations: bool
    resolution: str
    step: float | None
    status: str
    message: str
    verdict: str
    limit: str = ""
    limit_error: float | None = None
    limit_error_bar: float | None = None
    limit_doubt: float | None = None
    floor: str = ""
    quantity: str = ""
    unit: str = ""
    role: str = ""
    headline: bool = False
    error: float | None = None
    truth_error_bar: float | None = None
    tolerance: float | None = None
    scale: float | None = None
    order: float | None = None
    cost: float | None
    cost_low: float | None
    cost_high: float | None
    clean: bool

    @property
    def relative(self) -> float:
        """Error plus the truth's error bar, relative to the quantity's size; inf without either."""
        if self.error is None or not self.scale:
            return math.inf
        return (self.error + (self.truth_error_bar or 0.0)) / self.scale


def case_words(parameters: Mapping[str, float]) -> str:
    """Parameters of a scene, defaults included, in words."""
    return ", ".join(f"{name}={value:.12g}" for name, value in sorted(parameters.items()))


def setting_columns(name: str, engine: str, facts: EngineFacts | SweptSetting) -> dict[str, Any]:
    """Columns of a line about an engine's setting.

    Args:
        name: of the engine.
        engine: the same as ``name[key=value,…]``, with the options that a file or user set.
        facts: complete settings, their resolution and precision.
    """
    settings = facts.settings
    return {
        "engine": shown_name(name),
        "formulation": settings.get("formulation") or "",
        "preset": settings.get("preset") or "",
        "setting": setting_words(engine, facts),
        "precision": facts.precision,
        "resolution": facts.resolution or "",
        "step": settings.get(facts.resolution or ""),
    }


COLUMNS = tuple(item.name for item in fields(TableLine))


@dataclass(frozen=True)
class LongTable:
    """Lines of a report, as JSON and CSV."""

    lines: Sequence[TableLine]

    def as_dict(self) -> dict[str, Any]:
        """Names of columns, and the values of each line, for JSON; ``pandas.DataFrame(**table)`` reads it."""
        return {"columns": COLUMNS, "data": [[getattr(line, name) for name in COLUMNS] for line in self.lines]}

    @property
    def csv(self) -> str:
        """Lines as CSV; a value that is missing or not finite is an empty field."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows(plain(self)["data"])
        return text.getvalue()
