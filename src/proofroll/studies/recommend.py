"""The cheapest engine, formulation and step that holds a tolerance, from measured points alone."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from proofroll.core.comparison import Tolerance
from proofroll.core.engine_abilities import Level
from proofroll.core.errors import InputError
from proofroll.core.plugins import parse_engine
from proofroll.studies.pareto import tied

# How many times smaller than the tolerance an error must be, at the scene's own parameters, to pass with margin.
MARGIN = 2.0
# Rungs of the ladder that are worked out for a scene by hand rather than modelled in an engine.
_BY_HAND = frozenset({Level.CLOSED_FORM, Level.REDUCED, Level.PROJECTION})

_Point = Mapping[str, Any]


def by_hand(level: str | None) -> bool:
    """Whether a rung of the ladder solves equations derived for the scene, and is not an engine's model of it."""
    return level in set(_BY_HAND)


@dataclass(frozen=True)
class Wish:
    """What is asked for.

    Attributes:
        quantity: an observable.
        tolerance: largest error of it.
        budget: wall seconds per simulated second that may be spent, or None.
        engines: the engines among which to choose; every engine proper if empty.
        levels: the rungs among which to choose; all if empty.
    """

    quantity: str
    tolerance: Tolerance
    budget: float | None = None
    engines: tuple[str, ...] = ()
    levels: tuple[str, ...] = ()


def recommend(study: Mapping[str, Any], wish: Wish) -> dict[str, Any]:
    """The answer as plain data.

    ``choice``: the cheapest point that holds the tolerance with margin, and at every corner of the range;
    ``ties``: others that hold it and whose cost cannot be told from the choice's, for their intervals overlap;
    ``runner_up``: the cheapest of another engine or formulation; ``first_failure``: of all cheaper points, which fail,
    the most accurate; ``least_model``: the cheapest solution of the scene's own equations; each with
    engine, settings, error, seconds_per_second and reason, or None. ``checked``: the range; ``measured``: when, on
    which machine and with which versions.

    Raises:
        InputError: a quantity or an engine that was not measured, or a percentage of what has no size.
    """
    known = study["quantities"]
    absolute = _absolute(study, wish)
    timed = [p for p in study["points"] if p["seconds_per_second"] is not None and wish.quantity in p["envelope"]]
    timed.sort(key=lambda p: float(p["seconds_per_second"]))
    _require_measured(study, wish)

    def why_not(point: _Point) -> str | None:
        return _why_not(study, point, wish, absolute)

    asked = [p for p in timed if _asked(p, wish)]
    choice = next((p for p in asked if why_not(p) is None), None)
    affordable = choice is not None and (wish.budget is None or choice["seconds_per_second"] <= wish.budget)
    answer: dict[str, Any] = {
        "scene": study["scene"],
        "parameters": study["parameters"],
        "quantity": wish.quantity,
        "unit": known[wish.quantity]["unit"],
        "tolerance": absolute,
        "margin": MARGIN,
        "budget": wish.budget,
        "affordable": affordable,
        "choice": _told(choice, wish, _holds(study, choice, wish, absolute)),
        "ties": [],
        "runner_up": None,
        "first_failure": None,
        "least_model": None,
        "best_within_budget": None,
    }
    if choice is not None:
        equal = [p for p in asked if p["id"] != choice["id"] and tied(p["interval"], choice["interval"])]
        held = [p for p in equal if why_not(p) is None]
        answer["ties"] = [_told(p, wish, _holds(study, p, wish, absolute)) for p in held]
        other = _other(asked, choice, why_not)
        answer["runner_up"] = _told(other, wish, _holds(study, other, wish, absolute))
    answer["first_failure"] = _first_failure(asked, choice, wish, why_not)
    hand = next((p for p in timed if by_hand(p["level"]) and why_not(p) is None), None)
    if choice is None or hand is None or hand["id"] != choice["id"]:
        answer["least_model"] = _told(hand, wish, _holds(study, hand, wish, absolute))
    if not affordable and wish.budget is not None:
        within = [p for p in asked if p["seconds_per_second"] <= wish.budget]
        best = min(within, key=lambda p: _error(p, wish.quantity), default=None)
        answer["best_within_budget"] = _told(best, wish, "the most accurate within the budget")
    if choice is None:
        best = min(asked, key=lambda p: _error(p, wish.quantity), default=None)
        answer["closest"] = _told(best, wish, "the most accurate that was measured; nothing beyond is guessed")
    answer["checked"] = {
        "parameters": {name: [min(values), max(values)] for name, values in study["over"].items()},
        "corners": max((len(p["corners"]) for p in study["points"] if p["corners"] is not None), default=0),
        "until": study["until"],
    }
    answer["measured"] = study["measured"]
    return answer


def holding(study: Mapping[str, Any], wish: Wish, *, here: bool = False) -> list[_Point]:
    """Every point among those asked for that holds the tolerance with margin, the cheapest first, untimed ones last.

    Args:
        study: measured.
        wish: what is asked for.
        here: whether the scene's own parameters are enough, whatever happens at the corners of the range.
    """
    absolute = _absolute(study, wish)
    within = {**study, "over": {}} if here else study
    found = [p for p in study["points"] if _asked(p, wish) and _why_not(within, p, wish, absolute) is None]
    return sorted(found, key=lambda p: float("inf") if p["seconds_per_second"] is None else p["seconds_per_second"])


def _absolute(study: Mapping[str, Any], wish: Wish) -> float:
    """The tolerance in the quantity's unit."""
    known = study["quantities"]
    if wish.quantity not in known:
        raise InputError("quantity", wish.quantity, f"measured are {', '.join(known)}")
    scale = known[wish.quantity]["scale"]
    if wish.tolerance.relative and scale is None:
        advice = f"{wish.quantity} has no size here; give it in {known[wish.quantity]['unit']}"
        raise InputError("tolerance", f"{100 * wish.tolerance.value:.3g} %", advice)
    return wish.tolerance.absolute(scale or 1.0)


def _require_measured(study: Mapping[str, Any], wish: Wish) -> None:
    measured = list(dict.fromkeys(point["engine"] for point in study["points"]))
    for text in wish.engines:
        if parse_engine(text).name not in measured:
            absent = study["absent"].get(parse_engine(text).name)
            raise InputError("engine", text, absent or f"measured are {', '.join(measured)}")


def _asked(point: _Point, wish: Wish) -> bool:
    if wish.levels and point["level"] not in wish.levels:
        return False
    if not wish.engines:
        return not by_hand(point["level"]) or bool(wish.levels)
    return any(fits(point, text) for text in wish.engines)


def fits(point: _Point, text: str) -> bool:
    """Whether a point is of the engine, and has the settings, of ``name[key=value,…]``."""
    spec = parse_engine(text)
    if point["engine"] != spec.name:
        return False
    return all(_same(point["settings"].get(key), value) for key, value in spec.options.items())


def covers(measured: Sequence[str], asked: Sequence[str]) -> bool:
    """Whether a study restricted to some engines (to none: of all) can answer about those that are asked for."""
    if not measured or not asked:
        return not measured
    whole = {spec.name for spec in map(parse_engine, measured) if not spec.options}
    return all(text in measured or parse_engine(text).name in whole for text in asked)


def _same(value: object, text: str) -> bool:
    try:
        return float(value) == float(text)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return str(value).lower() == text.lower()


def _why_not(study: Mapping[str, Any], point: _Point, wish: Wish, absolute: float) -> str | None:
    """Why a point does not hold the tolerance, in one sentence; None if it does."""
    sparse = point.get("sparse")
    lives = _lives_on_the_grid(study, sparse, wish.quantity, absolute) if sparse else None
    return (
        lives
        or _why_not_here(study, point, wish.quantity, absolute)
        or (_why_not_there(study, point, wish, absolute) if study["over"] else None)
    )


def _why_not_here(study: Mapping[str, Any], point: _Point, name: str, absolute: float) -> str | None:
    """Why it does not hold it with margin at the scene's own parameters."""
    unit = study["quantities"][name]["unit"]
    error, held = point["error"].get(name), point["envelope"].get(name)
    if error is None or held is None:
        return f"{name} has no finite error: {point['message']}"
    if error > absolute:
        return f"{name} is off by {error:.2g} {unit}; {_blame(study, point, name, absolute)}"
    if held > absolute:
        return f"its error of {error:.2g} {unit} is luck: finer steps of the same model are off by {held:.2g} {unit}"
    if held * MARGIN > absolute:
        return f"{name} is off by {held:.2g} {unit}, which leaves less than a factor of {MARGIN:g} to the tolerance"
    bar = study["quantities"][name]["truth_error_bar"] or 0.0
    if bar * MARGIN > absolute:
        return f"the truth itself is known only to {bar:.2g} {unit}, so nothing can be seen to hold it"
    return None


def _lives_on_the_grid(study: Mapping[str, Any], sparse: Mapping[str, Any], name: str, absolute: float) -> str | None:
    """Why a tolerance holds only because a step ends at each of many samples; None if that is not why."""
    dense, rare, unit = sparse["dense_error"].get(name), sparse["error"].get(name), study["quantities"][name]["unit"]
    if dense is None or dense * MARGIN > absolute or (rare is not None and rare * MARGIN <= absolute):
        return None
    seen = f"{name} is off by {rare:.2g} {unit}" if rare is not None else f"there is no {name}: {sparse['message']}"
    return (
        f"it holds only because its steps end at every sample: sampled every {sparse['every']:g} s instead of "
        f"{study['every']:g} s, {seen}"
    )


def _why_not_there(study: Mapping[str, Any], point: _Point, wish: Wish, absolute: float) -> str | None:
    """Why it does not hold it at some corner of the range."""
    name, unit = wish.quantity, study["quantities"][wish.quantity]["unit"]
    if point["corners"] is None:
        return "it was not checked over the range of the parameters"
    key, allowed = ("relative", wish.tolerance.value) if wish.tolerance.relative else ("errors", absolute)
    for corner in point["corners"]:
        where = ", ".join(f"{parameter} = {value:g}" for parameter, value in corner["parameters"].items())
        there = corner[key].get(name)
        if there is None:
            return f"at {where} there is no {name}: {corner['message']}"
        if there > allowed:
            return f"at {where} {name} is off by {corner['errors'][name]:.2g} {unit}"
    return None


def _blame(study: Mapping[str, Any], point: _Point, quantity: str, absolute: float) -> str:
    """Whether a finer step could help."""
    budget = next((b for b in study["budgets"] if b["curve"] == point["curve"] and b["quantity"] == quantity), None)
    if budget is None or budget["model_form"] is None:
        return "too few finer runs reached the end to say whether a finer step would do"
    if budget["model_form"] - (budget["model_form_bar"] or 0.0) > absolute:
        return f"no step would do, for {budget['model_form']:.2g} remain in the limit of small steps"
    return "the step is too coarse"


def _holds(study: Mapping[str, Any], point: _Point | None, wish: Wish, absolute: float) -> str:
    if point is None:
        return ""
    held, bar = point["envelope"][wish.quantity], study["quantities"][wish.quantity]["truth_error_bar"] or 0.0
    if not max(held, bar):
        return "no error is seen"
    # Of an error below the truth's error bar no more is known than that.
    said = f"{'at least ' if held < bar else ''}{absolute / max(held, bar):.3g} times better than asked"
    if point["corners"]:
        key = "relative" if wish.tolerance.relative else "errors"
        worst = max(corner[key][wish.quantity] for corner in point["corners"])
        there = wish.tolerance.value if wish.tolerance.relative else absolute
        said += f", and {there / worst:.3g} times at the worst of {len(point['corners'])} corners" if worst else ""
    return said


def _other(asked: Iterable[_Point], choice: _Point, why_not: Callable[[_Point], str | None]) -> _Point | None:
    """The cheapest that holds, of another engine or formulation."""
    mine = (choice["engine"], choice["settings"].get("formulation"))
    others = (p for p in asked if (p["engine"], p["settings"].get("formulation")) != mine)
    return next((p for p in others if why_not(p) is None), None)


def _first_failure(
    asked: list[_Point], choice: _Point | None, wish: Wish, why_not: Callable[[_Point], str | None]
) -> dict[str, Any] | None:
    """The most accurate of all points cheaper than the choice; without a choice, of all."""
    cheaper = asked[: next(i for i, p in enumerate(asked) if p["id"] == choice["id"])] if choice else asked
    failing = [(point, reason) for point in cheaper if (reason := why_not(point)) is not None]
    if not failing:
        return None
    point, reason = min(failing, key=lambda item: _error(item[0], wish.quantity))
    return _told(point, wish, reason)


def _error(point: _Point, quantity: str) -> float:
    held = point["envelope"].get(quantity)
    return float("inf") if held is None else float(held)


def _told(point: _Point | None, wish: Wish, reason: str) -> dict[str, Any] | None:
    if point is None:
        return None
    return {
        "engine": point["engine"],
        "settings": point["settings"],
        "resolution": point["resolution"],
        "step": point["step"],
        "level": point["level"],
        "caveat": point.get("caveat", ""),
        "error": point["error"].get(wish.quantity),
        "seconds_per_second": point["seconds_per_second"],
        "interval": point["interval"],
        "confidence": point.get("confidence"),
        "measurements": point.get("measurements"),
        "reason": reason,
    }
