"""The tables of the further studies as rows of a page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from proofroll.report.labels import error, number, symbol, unit
from proofroll.report.tradeoff_tables import cost_of, name_of, step_of

if TYPE_CHECKING:
    from proofroll.report.tradeoff_part import TradeoffEntry


def advice(entry: TradeoffEntry) -> list[dict[str, Any]]:
    """What to use: one line for each tolerance, grouped by the quantity."""
    groups: dict[str, dict[str, Any]] = {}
    for answer in entry.advice:
        of = unit(answer["unit"])
        group = groups.setdefault(answer["quantity"], {"symbol": symbol(answer["quantity"]), "said": "", "lines": []})
        relative = answer["relative"]
        wanted = f"{number(answer['tolerance'])} {of}".strip()
        group["lines"].append(
            {
                "wanted": f"{number(100 * relative)} %, {wanted}" if relative is not None else wanted,
                "choice": _told(answer["choice"] or answer.get("closest"), of),
                "holds": answer["choice"] is not None,
                "ties": [_told(point, of) for point in answer.get("ties", [])],
                **{key: _told(answer[key], of) for key in ("runner_up", "first_failure", "least_model")},
            }
        )
    for group in groups.values():
        names = dict.fromkeys(line["choice"]["name"] for line in group["lines"] if line["holds"])
        group["said"] = ", then ".join(names) or "nothing holds it"
    return list(groups.values())


def front(entry: TradeoffEntry, key: str = "pareto_engines") -> list[dict[str, Any]]:
    """The points that nothing beats for the study's own quantity: cost, and the error of every shown quantity."""
    study = entry.study
    by_id = {point["id"]: point for point in study["points"]}
    return [
        {
            "name": name_of(point),
            "step": step_of(point),
            "cost": cost_of(point),
            "errors": [error(point["error"].get(name)) if name in point["error"] else "–" for name in entry.shown],
        }
        for point in (by_id[number] for number in study[key].get(study["quantity"], []))
    ]


def budgets(entry: TradeoffEntry, quantity: str) -> list[dict[str, Any]]:
    """What the error of a quantity consists of along each curve."""
    study = entry.study
    first = {point["curve"]: point for point in study["points"]}
    return [
        {
            "name": name_of(first[item["curve"]]) if item["curve"] in first else item["curve"],
            "order": _order(item),
            "declared": item["declared"],
            "contradicts": item["contradicts_declaration"],
            "model_form": number(item["model_form"]),
            "model_form_bar": number(item["model_form_bar"], 1),
            "floor": number(item["floor"], 1),
            "truth": number(item["truth"], 1),
            "sentence": item["sentence"],
        }
        for item in study["budgets"]
        if item["quantity"] == quantity
    ]


def quantities(entry: TradeoffEntry) -> list[dict[str, str]]:
    """The shown quantities with symbol and unit."""
    known = entry.study["quantities"]
    return [
        {"name": name, "symbol": symbol(name), "unit": unit(known.get(name, {}).get("unit", ""))}
        for name in entry.shown
    ]


def effort(study: Mapping[str, Any]) -> str:
    """How well speeds are known and where the choices hold, in a sentence or two."""
    said = ""
    if study.get("brief"):
        said = (
            "Speeds were measured briefly, twice at most and those of long runs once, and the finest steps were "
            "left out: they contradict no claim. "
        )
    over = ", ".join(f"{name} {min(values):g} to {max(values):g}" for name, values in study["over"].items())
    at = ", ".join(f"{name} = {value:g}" for name, value in study["parameters"].items()) or "the default parameters"
    where = f"at {at} over {study['until']:g} s"
    if over:
        return f"{said}Every choice holds {where}, and at the corners of {over}; nothing is known beyond."
    return f"{said}Every choice holds {where}; it was not checked over ranges of the parameters."


def _order(item: Mapping[str, Any]) -> str:
    if item["order"] is None:
        return "–"
    if item["order_low"] is None or item["order_high"] is None:
        return f"{item['order']:.2f}"
    return f"{item['order']:.2f} ± {(item['order_high'] - item['order_low']) / 2:.2f}"


def _told(point: Mapping[str, Any] | None, of: str) -> dict[str, str] | None:
    if point is None:
        return None
    return {
        "name": name_of(point),
        "caveat": point.get("caveat", ""),
        "step": step_of(point),
        "cost": cost_of(point),
        "error": f"{error(point['error'])} {of}".strip(),
        "reason": point["reason"],
    }
