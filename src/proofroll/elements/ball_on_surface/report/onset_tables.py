"""The tables of first slips and of events, with the sentences about how well the first slip is posed."""

from __future__ import annotations

import math
from typing import Any

from proofroll.elements.ball_on_surface.report.onsets import first_slip
from proofroll.report.labels import names, number
from proofroll.report.tables import anchor

# Events that the table shows; the page says how many more there are.
SHOWN = 4
# How the page paints a verdict on the onset, and the sign that goes with it: as the verdict of the same meaning.
PAINTED = {"agree": "agrees", "disagree": "differs", "ill-posed": "ill-posed", "refused": "failed", "failed": "failed"}


def conditioning(truth: dict[str, Any], until: float) -> list[tuple[str, str]]:
    """The truth's onset and how it hangs on the parameters, as names and texts."""
    onset = truth["onset"]
    known = f"{100 * onset['uncertainty']:.3g} %"
    facts = []
    if onset["time"] is None:
        facts.append(("First slip", f"none until {until:g} s"))
    else:
        text = f"{onset['time']:.9g} s"
        early, late = (_time(onset[key]) for key in ("earliest", "latest"))
        text += f"; {early} with μ smaller and f larger by {known}, {late} the other way round"
        facts.append(("First slip", text))
        facts.append(("d ln t / d ln μ", number(onset["by_mu"], 4)))
        facts.append(("d ln t / d ln f", number(onset["by_f"], 4)))
    edges = [(onset["edge_below"], "below"), (onset["edge_above"], "above")]
    said = [f"μ = {value:.6g} {side}" for value, side in edges if value is not None]
    if said and onset["distance"] is not None:
        said.append(f"the nearest {number(100 * onset['distance'], 3)} % from μ = {truth['mu_static']:.6g}")
    facts.append(("Stair edges", ", ".join(said) or f"none until {until:g} s"))
    return facts


def slip_table(content: dict[str, Any], comparison: int, point: int, truth: dict[str, Any]) -> dict[str, Any]:
    """First slips and the first events at one point: the truth on top, then one line for each run."""
    shown = names(content["rows"])
    runs = [run for run in content["runs"] if run["point"] == truth["point"]]
    longest = max(len(item["events"]) for item in (truth, *runs))
    columns = min(SHOWN, longest)
    lines = []
    for run in runs:
        first, true = first_slip(run["events"]), first_slip(truth["events"])
        verdict = run["onset_verdict"]
        failed = run["status"] != "done"
        lines.append(
            {
                "name": shown[run["row"]],
                "href": anchor(comparison, run["row"], point),
                "message": f"{run['status']}: {run['message']}" if failed else "",
                "first": first,
                "difference": signed(first["time"] - true["time"]) if first and true else "–",
                "verdict": "ill-posed here" if verdict == "ill-posed" else verdict,
                "painted": PAINTED.get(verdict, "failed"),
                "cells": [] if failed else [_cell(run["events"], truth["events"], index) for index in range(columns)],
                "count": len(run["events"]),
                "more": max(0, len(run["events"]) - columns),
                "in_order": [e["kind"] for e in run["events"]] == [e["kind"] for e in truth["events"]],
            }
        )
    return {
        "columns": columns,
        "wrong": "ill-posed" if truth["onset"]["verdict"] == "ill-posed" else "differs",
        "truth": {
            "first": first_slip(truth["events"]),
            "cells": [_cell(truth["events"], truth["events"], index, own=True) for index in range(columns)],
            "count": len(truth["events"]),
            "more": max(0, len(truth["events"]) - columns),
        },
        "lines": lines,
    }


def clock(event: dict[str, Any]) -> str:
    """The time of an event [s], to the digits that its bracket leaves."""
    return _to_digits(event["time"], event, most=9)


def between(event: dict[str, Any]) -> str:
    """The bracket of an event [s], to the digits of its width."""
    return " … ".join(_to_digits(event[key], event, most=12) for key in ("time_low", "time_high"))


def bracket(event: dict[str, Any]) -> str:
    """How far an event may be from its time [s]: ``±5e-4``, or ``-1e-3 +2e-9`` where the sides are unlike."""
    if any(event[key] is None for key in ("time", "time_low", "time_high")):
        return "no bracket"
    low, high = event["time"] - event["time_low"], event["time_high"] - event["time"]
    if abs(high - low) <= 0.1 * max(abs(high), abs(low)):
        return f"±{number(max(high, low), 1)}"
    return f"-{number(low, 1)} +{number(high, 1)}"


def signed(value: float) -> str:
    """A difference with its sign."""
    return f"+{number(value)}" if value > 0 else number(value)


def _cell(events: list[dict[str, Any]], true: list[dict[str, Any]], index: int, own: bool = False) -> dict[str, Any]:
    """One event beside the truth's event with the same number."""
    event = events[index] if index < len(events) else None
    twin = true[index] if index < len(true) else None
    like = event is not None and twin is not None and event["kind"] == twin["kind"]
    wrong = "" if like or event is twin else "missing" if event is None else "not in the truth"
    difference = ""
    if event is not None and twin is not None and not own and not wrong and None not in (event["time"], twin["time"]):
        difference = signed(event["time"] - twin["time"])
    return {"event": event, "difference": difference, "wrong": wrong}


def _time(value: float | None) -> str:
    return "none" if value is None else f"{value:.6g} s"


def _to_digits(value: float | None, event: dict[str, Any], most: int) -> str:
    """A time [s] with one digit more than the width of the event's bracket has."""
    if value is None:
        return "–"
    low, high = event["time_low"], event["time_high"]
    if low is None or high is None or high <= low:
        return f"{value:.9g}"
    # A width of 0.001 may be stored as a little less.
    return f"{value:.{min(most, max(3, 1 - math.floor(math.log10(high - low) + 1e-3)))}f}"
