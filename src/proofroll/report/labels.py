"""Labels in the report: rows, symbols of quantities, steps."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError
from typing import TYPE_CHECKING, Any

from proofroll.core.engine_abilities import title_of
from proofroll.core.errors import InputError, ProofrollError
from proofroll.core.number_format import number
from proofroll.core.plugins import KNOWN_TITLES, load_engine, parse_engine

if TYPE_CHECKING:
    from proofroll.core.comparison import Tolerance
    from proofroll.core.verdict import Judgement
    from proofroll.report.comparison.records import ReportedComparison, ReportedRow, ReportedRun, Setting
    from proofroll.running.case import EngineFacts
    from proofroll.studies.swept_settings import SweptSetting

SYMBOLS = {
    "agrees": "✓", "unconfirmed": "○", "incomplete": "◐", "converges": "↘", "ill-posed": "?", "not-judged": "□",
    "another-scene": "◇", "refused": "⊘", "differs": "✗", "failed": "!",
}  # fmt: skip
INSTALLED = "as installed"
MEANINGS = {
    "agrees": "within tolerance at this step; where there is a ladder of steps, so is its limit",
    "unconfirmed": "agrees at this step, limit not confirmed: the ladder of steps is not accurate enough",
    "incomplete": "agrees in all that it reports, but does not report all that is judged",
    "converges": "not within tolerance yet, but the limit of small steps is: right physics, step too coarse",
    "ill-posed": "here the answer depends on less than the precision of the parameters: no engine is judged by it",
    "another-scene": "the model is of another kind than the scene: it is shown, and not judged",
    "not-judged": "there is no truth here, or its own error bar exceeds the tolerance: no engine is judged by it",
    "refused": "the engine says that it cannot represent the scene, or run it with these settings: it has not failed",
    "differs": "not within tolerance: another limit, no limit shown, or one step only; each says which",
    "failed": "there is no result; the row says why. “missing”: the engine is not installed",
}


@cache
def engine_title(engine: str, title: str = "") -> str:
    """Name of an engine for readers, with the place or options that it has; its code name if it is not installed.

    Args:
        engine: code name, with a place or options or without.
        title: its own title; empty: that of its process or, loaded here, of the engine, which may take half a second.
    """
    code = re.split(r"[\[@]", engine, maxsplit=1)[0]
    try:
        title = title or KNOWN_TITLES.get(code) or title_of(load_engine(code))
    except (ProofrollError, PackageNotFoundError):
        title = code
    return title + engine[len(code) :]


def engine_words(engine: str, formulation: str | None = None, own_title: str = "") -> str:
    """Engine and formulation for readers; an engine whose name ends with its formulation says it once."""
    title, words = engine_title(engine, own_title), (formulation or "").replace("_", " ")
    return title if not words or title.endswith(f" {words}") else f"{title} {words}"


def precision_words(precision: str) -> tuple[str, ...]:
    """Label of a precision beside an engine's settings; empty for double."""
    return ("f32",) if precision == "single" else ()


def unjudged(content: ReportedComparison) -> int:
    """Count of runs that could not be judged, though their rows expect a verdict: without a truth or their engine."""
    from proofroll.running.case import Status
    from proofroll.studies.comparison.expectations import NOBODY

    open_runs = [run for run in content.runs if run.verdict in NOBODY or run.status == Status.MISSING]
    return sum(run.verdict not in content.rows[run.row].claim.expect for run in open_runs)


def verdict_text(row: ReportedRow, runs: Sequence[ReportedRun] = ()) -> str:
    """Verdict of a row with its runs, with the counts of its cases if their verdicts differ: ``failed 1/11 ✗2 ✓8``.

    A star refers to a remark below the table; ``missing``: none of the runs that failed has its engine.
    """
    from proofroll.running.case import Status

    failed = [run.status for run in runs if run.verdict == "failed"]
    missing = row.verdict == "failed" and set(failed) == {Status.MISSING}
    words = ["missing" if missing else str(row.verdict)]
    counts = {word: row.verdicts[word] for word in SYMBOLS if row.verdicts.get(word)}
    if not counts.keys() <= {row.verdict}:
        others = [f"{SYMBOLS[word]}{count}" for word, count in reversed(counts.items()) if word != row.verdict]
        words += [f"{counts[row.verdict]}/{sum(counts.values())}", *others]
    return " ".join(words) + ("*" if row.remarks else "")


def detail(entry: ReportedRow | ReportedRun | Judgement) -> str:
    """Short detail beside the verdict of a row, a run or a judgement; empty for most verdicts."""
    match entry.verdict:
        case "differs":
            return {"no ladder": "one step only"}.get(entry.limit, str(entry.limit))
        case "unconfirmed":
            return "limit not confirmed"
        case "incomplete":
            return f"does not report {', '.join(symbol(name) for name in getattr(entry, 'missing', ()))}"
        case _:
            return ""


def unit(text: str) -> str:
    """Unit as shown to readers; empty for a number without unit."""
    return "" if text == "1" else text.replace("^2", "²").replace("^3", "³")


def bound_words(bound: Tolerance) -> str:
    """A tolerance with its unit: ``1e-3 m``, ``0.1 % of its scale``."""
    if bound.relative:
        return f"{100 * bound.value:g} % of its scale"
    return f"{number(bound.value, 6)} {unit(bound.unit)}".strip()


def symbol(name: str) -> str:
    """Symbol of a quantity: a Greek letter for its name, with a number after it (γ, ω1); else its name with spaces."""
    letters = name.rstrip("0123456789")
    try:
        return unicodedata.lookup(f"GREEK SMALL LETTER {letters.upper()}") + name[len(letters) :]
    except KeyError:
        return name.replace("_", " ")


def off_by(judgement: Judgement) -> str:
    """An error in its unit: ``off by 0.1 rad in γ``."""
    size = f"{number(judgement.error)} {unit(judgement.unit)}".rstrip()
    return f"off by {size} in {symbol(judgement.observable)}"


def step(resolution: str | None, value: float | None, digits: int | None = None) -> str:
    """Text of the setting that trades speed for accuracy: ``dt 2.5e-3 s``, ``rtol 2.2e-14``; empty without one."""
    if not resolution or value is None:
        return ""
    return f"dt {number(value, digits or 3)} s" if resolution == "dt" else f"{resolution} {number(value, digits or 2)}"


def scene_words(name: str) -> str:
    """Name of a scene for a reader."""
    return name.rpartition("/")[2].replace("_", " ").capitalize()


def speed(cost: float, clean: bool, *, at_least: bool = False) -> str:
    """Seconds of motion per second of computing, as ``90×``; rough ones are marked and rounded to coarse steps.

    ``at_least``: no coarser step was seen to fail; ``≥`` stands before the speed.
    """
    if cost <= 0:
        return "not timed"
    power = 10.0 ** math.floor(math.log10(1 / cost))
    leading = 1 / cost / power
    coarseness = 0.1 if clean or leading < 2 else 0.5 if leading < 5 else 1.0
    rounded = float(f"{round(leading / coarseness) * coarseness * power:.2g}")
    sign = "≥ " if at_least else "" if clean else "≈ "
    return f"{sign}{rounded:.0f}×" if rounded >= 10 else f"{sign}{rounded:g}×"


def setting(row: Setting) -> str:
    """Formulation and preset of a row, or else its text in the comparison file."""
    formulation = engine_words(row.name, row.formulation).removeprefix(engine_title(row.name)).strip()
    return " ".join(filter(None, (formulation, row.setting))) or str(row.engine)


def row_words(row: Setting) -> list[str]:
    """Engine with formulation, setting and step of a row, each if there is one."""
    words = engine_words(row.name, row.formulation), row.setting, step(row.resolution, row.resolution_value)
    return [word for word in words if word]


def names(rows: Sequence[Setting]) -> list[str]:
    """Unique name of each row, as ``MuJoCo joints, matched, dt 1e-3 s``; its text in the file if names coincide."""
    short = [", ".join(row_words(row)) for row in rows]
    return [name if short.count(name) == 1 else str(row.engine) for name, row in zip(short, rows, strict=True)]


def preset_name(preset: str | None) -> str:
    """Preset of a run for a reader: ``as installed`` for ``default``; empty without one."""
    return INSTALLED if preset == "default" else preset or ""


def setting_words(engine: str, facts: EngineFacts | SweptSetting) -> str:
    """Preset, further options that a file or user set (``cone=pyramidal``), and ``f32`` for single precision.

    Args:
        engine: ``name[key=value,…]`` with these options.
        facts: complete settings, their resolution and precision.
    """
    usual, preset = {"formulation", "preset", facts.resolution}, facts.settings.get("preset")
    chosen: list[str] = []
    with suppress(InputError):  # a stored study may have any text
        chosen = [f"{key}={value}" for key, value in parse_engine(engine).options.items() if key not in usual]
    shown = [] if preset is None or (chosen and preset == "matched") else [preset_name(preset)]
    return " ".join([*shown, *chosen, *precision_words(facts.precision)])


def name_of(point: SweptSetting) -> str:
    """Engine, formulation and setting of a point of a study."""
    words = engine_words(point.engine, point.settings.get("formulation")), setting_words(point.curve, point)
    return ", ".join(filter(None, words))


def curve_names(points: Iterable[SweptSetting]) -> dict[str, str]:
    """Engine, formulation and setting of each curve of a study, for readers."""
    return {point.curve: name_of(point) for point in points}


def listed(parameters: Mapping[str, float]) -> str:
    """Parameters with their values: ``speed = 2, mass = 0.5``."""
    return ", ".join(f"{name} = {value:g}" for name, value in parameters.items())


def with_caveat(name: str, caveat: str) -> str:
    """A name with its caveat in brackets: the part that is not the engine's own."""
    return f"{name} ({caveat})" if caveat else name


def family_and_caveat(point: SweptSetting) -> str:
    """Family and caveat of a measured point, in one clause; empty without either."""
    return "; ".join(filter(None, (point.family, point.caveat)))


def settings_text(settings: dict[str, Any]) -> str:
    """Settings in one line, without those left to the engine (None)."""
    return ", ".join(f"{key}={value}" for key, value in settings.items() if value is not None)


def omitted_lines(clauses: Sequence[str]) -> list[str]:
    """Line on what the file of a scene describes and the answer leaves out; none without clauses."""
    return [f"Not in the answer: {', '.join(clauses)}."] if clauses else []


def values(numbers: list[float | None]) -> str:
    """A number, or the components of a vector, as text."""
    return ", ".join(number(value, 8, none="not finite") for value in numbers)
