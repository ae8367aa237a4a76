"""Sentences of an answer's records, the same on the page, on the terminal and in JSON."""

import math
from collections.abc import Iterator

from proofroll.core.number_format import number
from proofroll.core.plugins import parse_engine
from proofroll.files.scene_sources import command_line
from proofroll.report.labels import INSTALLED, engine_title, engine_words, step, symbol
from proofroll.report.labels import unit as shown_unit
from proofroll.report.run.last_values import FORCES
from proofroll.running.case import Status
from proofroll.studies.answer.records import (
    AllowedError,
    AnsweredScene,
    EngineAnswer,
    SceneAnswer,
    SettingTried,
    StepAnswer,
    StepTried,
)
from proofroll.studies.answer.setting_search import State

# State -> sign and short word.
SIGNS = {
    State.HOLDS: ("✓", "holds"),
    State.UNCONFIRMED: ("○", "holds, not confirmed"),
    State.FINER: ("·", "finer not run"),
    State.ELSEWHERE: ("✗", "leads elsewhere"),
    State.REFUSED: ("⊘", "refused"),
    State.CANNOT: ("—", "cannot"),
    State.SILENT: ("◐", "not reported"),
    State.NOT_RUN: ("·", "not run"),
}
_QUANTITIES = {"p_WB": "body positions"}
# Most changes that are told by their times.
_NAMED = 3
# Least ratio of two speeds that is told.
_FASTER = 1.1
_PREFIXES = {-3: "m", -6: "µ", -9: "n"}


def measure(value: float, of: str) -> str:
    """An error with its unit; lengths below a centimetre with a prefix: ``0.35 mm``."""
    if of != "m" or not 1e-10 <= value < 1e-2:
        return f"{number(value, none='∞')} {shown_unit(of)}".rstrip()
    power = next((power for power in _PREFIXES if value >= 0.1 * 10.0**power), -9)
    return f"{float(f'{value / 10.0**power:.2g}'):g} {_PREFIXES[power]}m"


def speed(cost: float | None) -> str:
    """Seconds of motion per second of computing: ``94×``; empty if it was not measured."""
    if not cost:
        return ""
    return f"{float(f'{1 / cost:.2g}'):g}×"


def error_words(bound: AllowedError, error: float) -> str:
    """An error beside what is allowed: ``0.12 mm of 1 mm``, or ``6e-5 of 1e-4`` as parts of the size."""
    if bound.relative and bound.size:
        return f"{number(error / bound.size)} of {number(bound.allowed / bound.size)}"
    return f"{measure(error, bound.unit)} of {measure(bound.allowed, bound.unit)}"


def quantity_words(name: str) -> str:
    """Name of a quantity for a reader."""
    return _QUANTITIES.get(name) or symbol(name)


def setting_words(item: EngineAnswer) -> str:
    """Engine, formulation, settings in two words and step of an answer for a reader.

    ``as installed`` is the preset ``default``; ``best`` the cheaper of ``matched`` and ``tuned`` that holds. Which
    options these are, the lines for a model tell.
    """
    words = preset_words(item.preset), step(item.resolution or None, item.step)
    return ", ".join(filter(None, (engine_words(item.engine, item.formulation), *words)))


def preset_words(preset: str) -> str:
    """Settings for a reader: ``as installed`` or ``best``; empty without a preset."""
    return {"default": INSTALLED, "": ""}.get(preset, "best")


def installed_words(item: EngineAnswer) -> str:
    """Clause on the settings as installed beside the best ones; empty if the answer is of these, or none was tried.

    A search that cannot be cheaper ends, so a step may not be confirmed; one with a finer step that fails is luck.
    """
    if not item.holds or item.preset == "default":
        return ""
    tried = [setting for setting in item.settings if parse_engine(setting.spec).options.get("preset") == "default"]
    held, failed = [], []
    for setting in tried:
        wrong = [run for run in setting.steps if run.of_allowed is not None and not run.holds]
        finest = min((run.step for run in wrong), default=math.inf)
        held += [(setting, run) for run in setting.steps if run.holds and run.seconds_per_second and run.step < finest]
        failed += [(setting, run) for run in wrong]
    if held:
        setting, run = min(held, key=lambda pair: pair[1].seconds_per_second or math.inf)
        unsure = "" if setting.state is State.HOLDS else ", not confirmed"
        return f"{INSTALLED}: {_at(item, setting, run)}: {speed(run.seconds_per_second)}{unsure}"
    if failed:
        setting, run = min(failed, key=lambda pair: pair[1].of_allowed or math.inf)
        told = f"{_at(item, setting, run)} is off by {number(run.of_allowed)} times what is allowed"
        return f"{INSTALLED}: dearer ({told})" if setting.state is State.DEARER else f"{INSTALLED}: {told}"
    return f"{INSTALLED}: refused, {tried[0].why}" if tried and tried[0].state is State.REFUSED else ""


def _at(item: EngineAnswer, setting: SettingTried, run: StepTried) -> str:
    """Formulation of a setting, unless the answer has the same, and the step of a run."""
    formulation = str(parse_engine(setting.spec).options.get("formulation", ""))
    words = "" if formulation == item.formulation else formulation.replace("_", " ")
    return ", ".join(filter(None, (words, step(setting.resolution or None, run.step))))


def brought_words(item: EngineAnswer) -> str:
    """Clause on the part of the computation that is proofroll's; empty: none is."""
    return f"through proofroll's {item.brought}" if item.brought else ""


def sentence(item: EngineAnswer, until: float) -> str:
    """Answer of one engine over a time [s], in one sentence."""
    if not item.holds or item.bound is None or item.error is None:
        name = setting_words(item) if item.spec and item.state is not State.REFUSED else engine_title(item.engine)
        return f"{name}: {reason(item)}."
    told = f"{speed(item.seconds_per_second)} real time, {error_words(item.bound, item.error)}"
    told += f" in {quantity_words(item.bound.quantity)} over {until:g} s"
    told += f"; not confirmed: {item.why}" if item.state is State.UNCONFIRMED else ""
    brought = f" ({brought_words(item)})" if item.brought else ""
    installed = installed_words(item)
    return f"{setting_words(item)}{brought}: {told}{f'; {installed}' if installed else ''}."


def reason(item: EngineAnswer) -> str:
    """Clause on why an engine is not shown to hold a tolerance."""
    clauses = []
    if item.state in {State.FINER, State.ELSEWHERE} and item.bound is not None and item.error is not None:
        clauses.append(f"off by {error_words(item.bound, item.error)}")
    if item.needs_step and item.needs_seconds:
        needed = step(item.resolution, item.needs_step, 1)
        clauses.append(f"at best it needs {needed}, {item.needs_seconds:.0f} s of computing")
    elif item.why:
        clauses.append(item.why)
    if item.state in {State.FINER, State.ELSEWHERE} and item.held_until > 0:
        clauses.append(f"it holds until {number(item.held_until, 3)} s")
    return "; ".join([SIGNS[item.state][1], *clauses])


def coarser_words(item: EngineAnswer) -> str:
    """Clause on twice the step of an answer that holds; empty if it was not run."""
    tried = item.coarser
    if tried is None:
        return ""
    double = "twice the step" if item.resolution == "dt" else "ten times the tolerance"
    if tried.status == Status.TIMEOUT:
        return f"{double} takes too long"
    if tried.status != Status.DONE:
        return f"{double} ends at {number(tried.reached, 3)} s" if tried.reached else f"{double} gives no result"
    if tried.of_allowed is None or tried.of_allowed <= 1:
        return ""
    return f"{double} is off by {number(tried.of_allowed)} times what is allowed"


def taken_sentence(made: SceneAnswer) -> str:
    """First sentence of an answer: what to take, or that nothing was shown to hold the tolerance.

    A step that is not confirmed is not advised; where one may be faster than what is, another sentence says so.
    """
    if made.open:
        return f"Nothing can be advised for {made.tolerance}: {made.open}."
    asked = f"{tolerance_words(made)} over {made.until:g} s"
    if made.taken is None:
        return f"No engine is shown to hold {asked}."
    if made.confirmed is None:
        return f"No engine is confirmed to hold {asked}; the fastest that may: {sentence(made.taken, made.until)}"
    told = f"Take {sentence(made.confirmed, made.until)}"
    if (rival := made.perhaps_faster) is None:
        return told
    ratio = (made.confirmed.seconds_per_second or 0.0) / (rival.seconds_per_second or math.inf)
    return f"{told} {engine_words(rival.engine, rival.formulation)} may be {number(ratio)} times faster, not confirmed."


def tolerance_words(made: SceneAnswer) -> str:
    """The tolerance for a reader: a part is one of the path."""
    try:
        float(made.tolerance)
    except ValueError:
        return made.tolerance
    return f"{made.tolerance} of the path"


def parameter_words(made: SceneAnswer) -> list[str]:
    """Parameters of the scene that were given, for a reader: ``speed 4``."""
    return [f"{symbol(name)} {number(value)}" for name, value in made.parameters.items()]


def unaided(made: SceneAnswer) -> EngineAnswer | None:
    """The cheapest that holds without a part of proofroll, where the one to take has such a part; else None."""
    if made.taken is None or not made.taken.brought:
        return None
    return next((item for item in made.engines if item.holds and not item.brought), None)


def scope_sentence(made: AnsweredScene) -> str:
    """Sentence on what was judged, over which time, and that attitudes were not."""
    names = ", ".join(quantity_words(bound.quantity) for bound in made.bounds)
    loads = f", {_forces_words(made)}" if any(bound.unit in FORCES for bound in made.bounds) else ""
    unjudged = f" Not judged: {' and '.join(made.unjudged)}." if made.unjudged else ""
    beyond = f" No longer: {made.beyond}." if made.beyond else ""
    return f"Judged: {names}, every {made.every:g} s over {made.until:g} s{loads}.{beyond}{unjudged}"


def _forces_words(made: AnsweredScene) -> str:
    """Clause on the times at which forces are judged and claimed: not at the start, nor beside a change.

    A claim keeps twice the distance, so that the first judged sample behind a change is no later than the claim.
    """
    times = list(dict.fromkeys(f"{number(time, 3)} s" for time in made.changes))
    told = f"{len(times)} times from {times[0]} to {times[-1]}" if len(times) > _NAMED else " and ".join(times)
    beside = f", judged {made.every:g} s or more and claimed {2 * made.every:g} s or more from a jump (at {told})"
    return f"forces from {made.every:g} s on{beside if times else ''}"


def answer_lines(made: SceneAnswer) -> Iterator[str]:
    """An answer in lines: what to take, with or without a part of proofroll, every engine, and what was judged."""
    yield taken_sentence(made)
    taken, alone = made.taken, unaided(made)
    if taken is not None and taken.brought:
        told = sentence(alone, made.until) if alone else "none is shown to hold it."
        yield f"Without a part of proofroll: {told}"
    for item in made.engines:
        if item not in (taken, alone):
            yield f"{SIGNS[item.state][0]} {sentence(item, made.until)}"
    if taken is not None and (text := coarser_words(taken)):
        yield f"Not good enough: {text}."
    yield scope_sentence(made)
    if made.omitted:
        yield f"Not in the answer: {', '.join(made.omitted)}."


def command_of(made: SceneAnswer, item: EngineAnswer) -> str:
    """Command that asks whether a setting holds the tolerance, with all that the answer was given."""
    return command_line("compare", made.scene, engine=item.spec, **_given(made))


def plot_command(made: SceneAnswer) -> str:
    """Command that draws error against cost, with all that the answer was given."""
    return command_line("recommend", made.scene, **_given(made), plot="cost.svg")


def lines_command(made: StepAnswer, engine: str) -> str:
    """Command that prints the lines of an engine's own model that hold the tolerance of an answer."""
    return command_line("recommend", made.scene, "--lines", engine=engine, **_given(made))


def _given(made: SceneAnswer | StepAnswer) -> dict[str, object]:
    """Options of a command that ask the question of an answer."""
    parameters = [f"{name}={value!r}" for name, value in made.parameters.items()]
    return {"tolerance": made.tolerance.split(", "), "set": parameters, "until": repr(made.until)}


def step_sentence(made: StepAnswer) -> str:
    """Answer for a person's own step in one sentence: yes, no or perhaps, by how much, and which step would do."""
    if made.open:
        return f"Not judged: {made.open}."
    item, size = made.advised, step(made.resolution, made.step)
    if made.bound is None or made.status != Status.DONE or made.error is None:
        ended = made.message or item.why
        until = f", it holds until {number(made.held_until, 3)} s" if made.held_until else ""
        return f"No: {ended}{until}{_would_do(made)}."
    error = f"{error_words(made.bound, made.error)} over {made.until:g} s"
    if made.undecided:
        why = item.why or "no finer step was run"
        return f"Perhaps: {error} ({size}, {speed(made.seconds_per_second)} real time); not confirmed: {why}."
    if not made.holds:
        luck = f" is luck: {made.luck}" if made.luck else ""
        until = f"; it holds until {number(made.held_until, 3)} s" if made.held_until and not made.luck else ""
        return f"No: {error}{luck}{until}{_would_do(made)}."
    told = f"Yes: {error} ({size}, {speed(made.seconds_per_second)} real time)"
    if item.step is not None and item.step > made.step * (1 + 1e-9):
        ratio = (made.seconds_per_second or 0.0) / (item.seconds_per_second or math.inf)
        faster = f", {number(ratio)} times faster" if ratio > _FASTER else ""
        return f"{told}; {step(item.resolution, item.step)} would do{faster}."
    double = "twice the step" if made.resolution == "dt" else "ten times the tolerance"
    fault = "was not run" if item.coarser is None else "does not do"
    if item.coarser is not None and (item.coarser.holds or item.coarser.status == Status.TIMEOUT):
        fault = "is within it, but not confirmed" if item.coarser.holds else "takes too long"
    return f"{told}; {double} {fault}."


def _would_do(made: StepAnswer) -> str:
    """Clause on the step of the same setting that holds, or on why none was found."""
    item = made.advised
    if item.holds and item.step is not None and item.bound is not None and item.error is not None:
        off = error_words(item.bound, item.error).partition(" of ")[0]
        sure = "" if item.state is State.HOLDS else ", not confirmed"
        return (
            f"; {step(item.resolution, item.step)} would do ({off}{sure}), {speed(item.seconds_per_second)} real time"
        )
    if item.state is State.FINER and item.needs_step and item.needs_seconds:
        needed = step(item.resolution, item.needs_step, 1)
        return f"; at best it needs {needed}, {item.needs_seconds:.0f} s of computing, which was not run"
    return f"; {item.state}: {item.why}" if item.why and item.why != made.message else ""
