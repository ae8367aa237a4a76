"""Decisions of studies: regions of maps, regimes, terms that are needed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from proofroll.core.errors import InputError, require_known
from proofroll.files.toml import named_file, study_files, study_of
from proofroll.papers.blajer_2006.slip.regimes import load_regimes, regime_maps
from proofroll.report.ladder import ladder_content
from proofroll.running import idle_workers
from proofroll.running.case import Status
from proofroll.running.runner import Runner
from proofroll.studies.ladder.ladder import Ladder
from proofroll.studies.ladder.models import Need
from proofroll.studies.stability.axes import QUICK
from proofroll.studies.stability.claims import file_for
from proofroll.studies.stability.map import stability
from proofroll.studies.stability.records import BOUNDARIES
from proofroll.studies.stability.study import stability_study

# A ladder of models has no file: it is asked for by this word and a scene.
LADDER = "ladder:"
LADDERS = tuple(f"{LADDER}{scene}" for scene in ("sphere_in_cylinder", "double_pendulum"))
_PATIENCE = 10.0  # for arithmetic that is slow
_SHORT = 0.002  # s of each measurement of speed, on which nothing here hangs
_NOT_NEEDED = {Need.FREE, Need.NOT_NEEDED}  # which of them is told by a clock
_HELD = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)  # parts of the quantity's size


@dataclass
class Decided:
    """Decisions by what they are about; ``late``: those that a limit of time left open."""

    decisions: dict[str, dict[str, Any]] = field(default_factory=dict)
    late: list[str] = field(default_factory=list)

    def put(self, place: str, said: Mapping[str, Any], *, late: bool = False, missing: bool = False) -> None:
        """Adds a decision."""
        self.decisions[place] = {"status": Status.MISSING if missing else Status.DONE, **said}
        self.late += [place] * late


def study_names() -> list[str]:
    """All studies of this repository that can be compared: files, and ladders of models."""
    return [*(str(path) for kind in _KINDS for path, _ in study_files(kind)), *LADDERS]


def is_study(name: str) -> bool:
    """True if a name is that of a study. Raises InputError for a study that nothing here compares."""
    path = named_file(name)
    kind = study_of(path) if path else None
    if kind is not None:
        require_known("study", kind, _KINDS, "compared are")
    return kind is not None or name.startswith(LADDER)


def decided_by(name: str, runner: Runner) -> dict[str, Any]:
    """Decisions of a study, as the record of a comparison; brief where it can be."""
    idle_workers.SECONDS = _SHORT
    found = Decided()
    if name.startswith(LADDER):
        _ladder(name.removeprefix(LADDER), runner, found)
    elif (path := named_file(name)) is None:
        raise InputError("study", name, "there is no such file; give its path or its name")
    else:
        _KINDS[str(study_of(path))](path, runner, found)
    return {"decisions": found.decisions, "limits": {}, "truths": {}, "late": found.late}


def _stability(path: Path, runner: Runner, found: Decided) -> None:
    """Largest steps at which each engine is stable and right, and failures beyond."""
    asked = file_for(str(path))
    effort = replace(QUICK, limit=_PATIENCE * QUICK.limit)
    study = stability_study(stability(asked.scene, asked.axes, runner, effort=effort))
    for point in study.points:
        place = f"{point.curve} {point.axis} = {point.value:g}"
        said: dict[str, Any] = {"problem": bool(point.problem)}
        for name in BOUNDARIES:
            side = point.sides[name]
            largest = None if side.largest is None else f"{side.largest:.3g}"  # rungs are parts of a natural time
            said[name] = [largest, side.failure, side.silent]
        found.put(place, said, late=point.timed_out)
    found.put("claims", {"contradicted": len(asked.contradictions(study))}, late=bool(found.late))


def _regimes(path: Path, _: Runner, found: Decided) -> None:
    """Regime and number of slips at each place of each map."""
    for chart in regime_maps(load_regimes(str(path)).briefly(), 1):
        resistance = chart.attrs["rolling_resistance"]
        for speed in chart["speed"].to_numpy():
            along = chart.sel(speed=speed)
            said = {name: along[name].to_numpy().tolist() for name in ("regime", "slips")}
            found.put(f"resistance {resistance:g} m, speed {speed:g} m/s", said)


def _ladder(scene: str, runner: Runner, found: Decided) -> None:
    """Ends of models, and verdicts on their terms."""
    study = Ladder(scene, {}, runner, rounds=2)
    study.run()
    content = ladder_content(study)
    for rung in content.rungs:
        place = f"{rung.level} {rung.engine} {rung.formulation} {rung.variant}"
        late, missing = rung.ran.status == Status.TIMEOUT, rung.ran.status == Status.MISSING
        found.put(place, {"ends": rung.ran.status}, late=late, missing=missing)
    for term in content.terms:
        verdict = "not needed" if term.verdict in _NOT_NEEDED else term.verdict
        found.put(f"{term.engine} {term.formulation}: {term.term}", {"verdict": verdict})


_KINDS: dict[str, Callable[[Path, Runner, Decided], None]] = {
    "stability": _stability,
    "regimes": _regimes,
}
