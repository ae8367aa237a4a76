"""How far each row of a comparison is from the truth over all cases, and which one to use at each accuracy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from proofroll.report.labels import headlines, names

DECADES = range(1, 14)


@dataclass(frozen=True)
class Score:
    """A row over all points of the parameters.

    Attributes:
        index: of the row.
        name: of the row.
        motion: largest error of any coordinate with the truth's error bar, over its range; None if a run is missing or
            not finite.
        forces: largest error of any reaction, over the largest normal force; None likewise.
        seconds: wall seconds per simulated second, the slowest case; None if not measured.
    """

    index: int
    name: str
    motion: float | None
    forces: float | None
    seconds: float | None

    @property
    def worst(self) -> float | None:
        """The larger of both errors."""
        return None if self.motion is None or self.forces is None else max(self.motion, self.forces)


def scores(content: dict[str, Any]) -> list[Score]:
    """One score per row of the comparison."""
    judged = _judged(content)
    coordinates, forces_of = (
        [name for name in headlines(content, role) if name in judged] for role in ("motion", "reaction")
    )
    points = {run["point"] for run in content["runs"]}
    found = []
    for index, (name, row) in enumerate(zip(names(content["rows"]), content["rows"], strict=True)):
        runs = [run for run in content["runs"] if run["row"] == index]
        everywhere = {run["point"] for run in runs} == points
        motion, forces = (_relative(runs, group) if everywhere else None for group in (coordinates, forces_of))
        found.append(Score(index, name, motion, forces, row["seconds_per_second"]))
    return found


def recommendation(found: list[Score]) -> list[dict[str, Any]]:
    """For each decade of relative error the cheapest row that stays within it at every point.

    Decades with the same answer are one entry: ``within`` is the loosest, ``down_to`` the tightest of them.
    """
    entries: list[dict[str, Any]] = []
    for decade in DECADES:
        entry = {
            "motion": cheapest(found, "motion", 10.0**-decade),
            "motion_and_forces": cheapest(found, "worst", 10.0**-decade),
        }
        if not any(entry.values()):
            break
        if entries and all(entries[-1][key] == entry[key] for key in entry):
            entries[-1]["down_to"] = 10.0**-decade
        else:
            entries.append({"within": 10.0**-decade, "down_to": 10.0**-decade, **entry})
    return entries


def cheapest(found: list[Score], key: str, bound: float) -> dict[str, Any] | None:
    """The cheapest timed row whose ``key`` (``motion``, ``forces`` or ``worst``) is within the bound, or None."""
    good = [score for score in found if score.seconds is not None and _at_most(getattr(score, key), bound)]
    if not good:
        return None
    best = min(good, key=lambda score: score.seconds or 0.0)
    return {
        "row": best.index,
        "name": best.name,
        "error": getattr(best, key),
        "seconds_per_second": best.seconds,
    }


def _at_most(value: float | None, bound: float) -> bool:
    return value is not None and value <= bound


def _judged(content: dict[str, Any]) -> list[str]:
    return list(dict.fromkeys(name for row in content["rows"] for name in row["observables"]))


def _relative(runs: list[dict[str, Any]], group: Any) -> float | None:
    """Largest error with the truth's error bar, over its scale; None where something is missing.

    What cannot be judged, because the question is ill-posed, is left out.
    """
    sizes: list[float] = []
    for run in runs:
        chosen = [judgement for judgement in run["judgements"] if judgement["observable"] in group]
        if run["status"] != "done" or not chosen:
            return None
        chosen = [judgement for judgement in chosen if judgement["verdict"] != "ill-posed"]
        if any(judgement["error"] is None for judgement in chosen):
            return None
        # What the truth does not know it cannot vouch for.
        sizes += [(judgement["error"] + judgement["truth_error_bar"]) / judgement["scale"] for judgement in chosen]
    return max(sizes, default=None)
