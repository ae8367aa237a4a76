"""The report's tables as rows of cells, each with its verdict, its number and a link to its evidence."""

from __future__ import annotations

from typing import Any

from proofroll.core.certificate import Standing, not_reported
from proofroll.report.labels import (
    SYMBOLS,
    detail,
    error,
    names,
    number,
    setting,
    step,
    symbol,
    unit,
    verdict_text,
)


def anchor(comparison: int, row: int, point: int) -> str:
    """Id of the evidence of one row at one point."""
    return f"c{comparison}-r{row}-p{point}"


def observables(content: dict[str, Any]) -> list[dict[str, str]]:
    """The judged observables in the order of the first row that has them all."""
    units: dict[str, str] = {}
    for row in sorted(content["rows"], key=lambda row: -len(row["observables"])):
        for name, judgement in row["observables"].items():
            units.setdefault(name, judgement["unit"])
    return [{"name": name, "symbol": symbol(name), "unit": unit(text)} for name, text in units.items()]


def overview(content: dict[str, Any], comparison: int) -> dict[str, Any]:
    """The verdict matrix: the worst of every row over all points."""
    points = list(dict.fromkeys(run["point"] for run in content["runs"]))
    lines = []
    for index, row in enumerate(content["rows"]):
        runs = [run for run in content["runs"] if run["row"] == index]
        worst = next((run for run in runs if run["verdict"] == row["verdict"]), runs[0])
        lines.append(
            {
                **_head(row),
                "verdict": row["verdict"],
                "verdict_text": verdict_text(row),
                "detail": detail(row),
                "href": anchor(comparison, index, points.index(worst["point"])),
                "message": row["message"],
                "as_expected": row["as_expected"],
                "seconds": row["seconds_per_second"],
                "cost": next((cost_title(run["cost"]) for run in runs if _slowest(run, row)), ""),
                "judged": {
                    name: _cell(judgement, anchor(comparison, index, points.index(judgement["point"])))
                    for name, judgement in row["observables"].items()
                },
            }
        )
    return _matrix(content, lines)


def counted(content: dict[str, Any]) -> str:
    """How many settings have which verdict, in one line."""
    verdicts = [row["verdict"] for row in content["rows"]]
    said = ", ".join(f"{sign} {verdicts.count(word)} {word}" for word, sign in SYMBOLS.items() if word in verdicts)
    return f"{len(verdicts)} settings: {said}; " + ("as expected" if content["as_expected"] else "not as expected")


def at_point(content: dict[str, Any], comparison: int, point: int, name: str) -> dict[str, Any]:
    """The verdict matrix of one point of the parameters."""
    lines = []
    for run in content["runs"]:
        if run["point"] != name:
            continue
        href = anchor(comparison, run["row"], point)
        lines.append(
            {
                **_head(run),
                "verdict": run["verdict"],
                "verdict_text": run["verdict"],
                "detail": detail(run),
                "href": href,
                "message": run["message"] if run["status"] != "done" else "",
                "as_expected": not run["contradictions"],
                "seconds": run["seconds_per_second"],
                "cost": cost_title(run["cost"]) if run.get("cost") else "",
                "judged": {judgement["observable"]: _cell(judgement, href) for judgement in run["judgements"]},
            }
        )
    return _matrix(content, lines)


def expectations(content: dict[str, Any]) -> list[dict[str, Any]]:
    """What is expected, settings with the same expectation together; ``further``: claims besides the verdict."""
    groups: dict[tuple[Any, ...], list[str]] = {}
    for name, row in zip(names(content["rows"]), content["rows"], strict=True):
        text = " or ".join(row["expected"])
        for observable, verdicts in row["expected_for"].items():
            text += f"; {symbol(observable)}: {' or '.join(verdicts)}"
        further = tuple(_further(row.get("claims", {})))
        groups.setdefault((row["tolerance"], text, row["because"], further), []).append(name)
    return [
        {"names": found, "tolerance": tolerance, "expected": text, "because": because, "further": further}
        for (tolerance, text, because, further), found in groups.items()
    ]


def _further(claims: dict[str, Any]) -> list[str]:
    """A row's claims besides its verdict, as sentences without a full stop."""
    said = [f"{symbol(name)} within {unit(bound)}" for name, bound in claims.get("bound", {}).items()]
    said += [f"order of {symbol(name)} {low:g} to {high:g}" for name, (low, high) in claims.get("order", {}).items()]
    said += [f"limit of {symbol(name)} within {unit(bound)}" for name, bound in claims.get("limit", {}).items()]
    for item in claims.get("except_at", []):
        said.append(f"{' or '.join(item['expect'])} at {_where(item['where'])}")
    if claims.get("only"):
        said.append(f"run only at {_where(claims['only'])}")
    return said


def _where(values: dict[str, list[float]]) -> str:
    """Values of parameters: ``speed=2, mu_static=0.35 or 0.4``."""
    return ", ".join(f"{name}={' or '.join(number(v, 6) for v in found)}" for name, found in values.items())


def costs(content: dict[str, Any]) -> list[dict[str, Any]]:
    """For each timed row its fastest and its slowest case, with intervals."""
    lines = []
    for index, name in enumerate(names(content["rows"])):
        timed = [run for run in content["runs"] if run["row"] == index and run.get("cost")]
        if timed:
            timed.sort(key=lambda run: run["cost"]["median"])
            lines.append({"name": name, "fastest": timed[0], "slowest": timed[-1], "cases": len(timed)})
    return lines


def cost_interval(cost: dict[str, Any] | None) -> str:
    """The interval of a cost: ``0.011 to 0.013``; a dash where it was measured once or never."""
    return "–" if not cost or cost["low"] is None else f"{number(cost['low'])} to {number(cost['high'])}"


def cost_title(cost: dict[str, Any] | None) -> str:
    """What a cost is, in a sentence."""
    if not cost:
        return "not timed"
    if cost["low"] is None:
        return "one clean run, so no interval is known"
    known = f"{100 * cost['confidence']:.3g} %"
    return f"median of {cost['runs']} clean runs; {cost_interval(cost)} s/s holds it with {known}"


def reasons(certificate: list[dict[str, Any]]) -> dict[str, list[str]]:
    """Why some quantities of a certificate may differ by more than round-off: reason -> quantities."""
    found: dict[str, list[str]] = {}
    for line in certificate:
        if line["because"]:
            found.setdefault(line["because"], []).append(line["quantity"])
    return found


def bounds(content: dict[str, Any], band: dict[str, Any]) -> list[str]:
    """The tolerances of a band, with symbols and units."""
    units = {column["name"]: column["unit"] for column in observables(content)}
    found = []
    for name, bound in band["bounds"].items():
        try:
            text = f"{number(float(bound))} {units.get(name, '')}"
        except ValueError:
            text = bound  # relative, and says so
        found.append(f"{symbol(name)} {text}".strip())
    return found


def belief(content: dict[str, Any]) -> list[dict[str, Any]]:
    """Why to believe it: for each row its certificates and its force audit, the worst over all points."""
    lines = []
    for index, name in enumerate(names(content["rows"])):
        runs = [run for run in content["runs"] if run["row"] == index]
        lines_of_all = [line for run in runs for line in run["certificate"]]
        certificate = [line for line in lines_of_all if line["standing"] != Standing.NOT_REPORTED]
        exact = [line["difference"] for line in certificate if not line["because"] and line["difference"] is not None]
        soft = list(dict.fromkeys(line["quantity"] for line in certificate if line["because"]))
        audit = content["rows"][index]["observables"].get("force_audit")
        lines.append(
            {
                "name": name,
                "held": sum(bool(line["holds"]) for line in certificate),
                "total": len(certificate),
                "difference": max(exact, default=None),
                "soft": soft,
                "silent": list(dict.fromkeys(not_reported(lines_of_all))),
                "audit": audit,
            }
        )
    return lines


def _slowest(run: dict[str, Any], row: dict[str, Any]) -> bool:
    return bool(run.get("cost")) and run["seconds_per_second"] == row["seconds_per_second"]


def _head(row: dict[str, Any]) -> dict[str, Any]:
    return {"engine": row["engine"], "name": row["name"], "setting": setting(row), "step": step(row)}


def causes(content: dict[str, Any]) -> list[tuple[str, str, str]]:
    """Name of each row with a proven cause of its difference, the cause, and what to do."""
    shown = zip(names(content["rows"]), content["rows"], strict=True)
    return [(name, cause["sentence"], cause["remedy"]) for name, row in shown for cause in row["diagnosis"]]


def remarks(content: dict[str, Any]) -> list[tuple[str, str]]:
    """What was remarked of each row, with its name."""
    shown = names(content["rows"])
    return [(name, text) for name, row in zip(shown, content["rows"], strict=True) for text in row["remarks"]]


def _limit(judgement: dict[str, Any]) -> str:
    """What the ladder of steps says, with its numbers; nothing where there is none."""
    if judgement["limit_error_bar"] is None:
        return ""
    off = f"{error(judgement['limit_error'])} ± {error(judgement['limit_error_bar'], 1)}"
    return f"; {judgement['limit']}: off by {off}, order {number(judgement['order'])}"


def _cell(judgement: dict[str, Any], href: str) -> dict[str, Any]:
    where = f" at {judgement['point']}" if judgement.get("point") else ""
    text = unit(judgement["unit"])
    return {
        "verdict": judgement["verdict"],
        "symbol": SYMBOLS[judgement["verdict"]],
        "text": error(judgement["error"]),
        "href": href,
        "title": f"{symbol(judgement['observable'])} {judgement['verdict']}: error {error(judgement['error'])} ± "
        f"{number(judgement['truth_error_bar'], 1)} {text}, tolerance {number(judgement['tolerance'])}{where}"
        f"{_limit(judgement)}",
    }


def _matrix(content: dict[str, Any], lines: list[dict[str, Any]]) -> dict[str, Any]:
    """Lines grouped by engine, cells in the order of the columns; None where an engine does not say."""
    columns = observables(content)
    groups: dict[str, list[dict[str, Any]]] = {}
    for line in lines:
        cells = [line["judged"].get(column["name"]) for column in columns]
        groups.setdefault(line["name"], []).append({**line, "symbol": SYMBOLS[line["verdict"]], "cells": cells})
    return {"columns": columns, "groups": groups}
