"""The cheapest engine, formulation and step that holds a tolerance, from measured points alone."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from proofroll.core.engine_abilities import Level
from proofroll.core.errors import InputError
from proofroll.core.plugins import parse_engine
from proofroll.studies.pareto import tied
from proofroll.studies.wish import MARGIN, MeasuredPoint, Wish, absolute_tolerance, why_it_fails

# Rungs of the ladder that are worked out for a scene by hand rather than modelled in an engine.
_BY_HAND = frozenset({Level.CLOSED_FORM, Level.REDUCED, Level.PROJECTION})


def by_hand(level: str | None) -> bool:
    """Whether a rung of the ladder solves equations derived for the scene, and is not an engine's model of it."""
    return level in set(_BY_HAND)


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
    absolute = absolute_tolerance(study, wish)
    timed = [p for p in study["points"] if p["seconds_per_second"] is not None and wish.quantity in p["envelope"]]
    timed.sort(key=lambda p: float(p["seconds_per_second"]))
    _require_measured(study, wish)

    def why_not(point: MeasuredPoint) -> str | None:
        return why_it_fails(study, point, wish, absolute)

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


def holding(study: Mapping[str, Any], wish: Wish, *, here: bool = False) -> list[MeasuredPoint]:
    """Every point among those asked for that holds the tolerance with margin, the cheapest first, untimed ones last.

    Args:
        study: measured.
        wish: what is asked for.
        here: whether the scene's own parameters are enough, whatever happens at the corners of the range.
    """
    absolute = absolute_tolerance(study, wish)
    within = {**study, "over": {}} if here else study
    found = [p for p in study["points"] if _asked(p, wish) and why_it_fails(within, p, wish, absolute) is None]
    return sorted(found, key=lambda p: float("inf") if p["seconds_per_second"] is None else p["seconds_per_second"])


def _require_measured(study: Mapping[str, Any], wish: Wish) -> None:
    measured = list(dict.fromkeys(point["engine"] for point in study["points"]))
    for text in wish.engines:
        if parse_engine(text).name not in measured:
            absent = study["absent"].get(parse_engine(text).name)
            raise InputError("engine", text, absent or f"measured are {', '.join(measured)}")


def _asked(point: MeasuredPoint, wish: Wish) -> bool:
    if wish.levels and point["level"] not in wish.levels:
        return False
    if not wish.engines:
        return not by_hand(point["level"]) or bool(wish.levels)
    return any(fits(point, text) for text in wish.engines)


def fits(point: MeasuredPoint, text: str) -> bool:
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


def _holds(study: Mapping[str, Any], point: MeasuredPoint | None, wish: Wish, absolute: float) -> str:
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


def _other(
    asked: Iterable[MeasuredPoint], choice: MeasuredPoint, why_not: Callable[[MeasuredPoint], str | None]
) -> MeasuredPoint | None:
    """The cheapest that holds, of another engine or formulation."""
    mine = (choice["engine"], choice["settings"].get("formulation"))
    others = (p for p in asked if (p["engine"], p["settings"].get("formulation")) != mine)
    return next((p for p in others if why_not(p) is None), None)


def _first_failure(
    asked: list[MeasuredPoint], choice: MeasuredPoint | None, wish: Wish, why_not: Callable[[MeasuredPoint], str | None]
) -> dict[str, Any] | None:
    """The most accurate of all points cheaper than the choice; without a choice, of all."""
    cheaper = asked[: next(i for i, p in enumerate(asked) if p["id"] == choice["id"])] if choice else asked
    failing = [(point, reason) for point in cheaper if (reason := why_not(point)) is not None]
    if not failing:
        return None
    point, reason = min(failing, key=lambda item: _error(item[0], wish.quantity))
    return _told(point, wish, reason)


def _error(point: MeasuredPoint, quantity: str) -> float:
    held = point["envelope"].get(quantity)
    return float("inf") if held is None else float(held)


def _told(point: MeasuredPoint | None, wish: Wish, reason: str) -> dict[str, Any] | None:
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
