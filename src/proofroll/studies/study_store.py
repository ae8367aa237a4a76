"""Studies that take minutes, made and kept as files, and believed while what they hang on is what it was."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from proofroll.files.atomic import ordinary_content
from proofroll.files.json_data import plain, record
from proofroll.running.store import write_text
from proofroll.studies import study_identity
from proofroll.studies.study_identity import Measured

if TYPE_CHECKING:
    from proofroll.running.runner import Runner
    from proofroll.studies.axes import Axis
    from proofroll.studies.claims import TradeoffClaims
    from proofroll.studies.curve import Question
    from proofroll.studies.stability_claims import StabilityFile
    from proofroll.studies.stability_places import Effort
    from proofroll.studies.stability_records import StabilityStudy
    from proofroll.studies.tradeoff_records import TradeoffStudy

_Study = TypeVar("_Study")


def kept(path: Path, kind: type[_Study]) -> tuple[_Study | None, list[str]]:
    """A kept study if it still holds here.

    Returns:
        the study, or None and why there is none: what has changed since, or nothing if there is no such file.
    """
    try:
        content = json.loads(ordinary_content(path))
        if content["seal"] != _seal(content):
            return None, ["what is stored is not what had been put there"]
        reasons = study_identity.changes(record(Measured, content["measured"]))
        return (None, reasons) if reasons else (record(kind, content), [])
    except (OSError, ValueError, KeyError, TypeError, RecursionError):  # absent, half written, or something else
        return None, []


def _seal(study: Mapping[str, Any]) -> str:
    """Hash of all that a kept study holds besides it: a file that was cut or changed does not have it."""
    content = {key: value for key, value in study.items() if key != "seal"}
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def keep(study: Any, path: Path) -> None:
    """Writes a study as :func:`kept` reads it.

    Raises:
        ProofrollError: the folder cannot be written.
    """
    content = plain(study)
    write_text(path, json.dumps({**content, "seal": _seal(content)}))


def make_tradeoff(
    question: Question,
    runner: Runner,
    folder: Path,
    *,
    engines: Sequence[str] = (),
    over: Mapping[str, Sequence[float]] | None = None,
    claims: TradeoffClaims | None = None,
    brief: bool = False,
    progress: Callable[[str], None] | None = None,
) -> tuple[TradeoffStudy, Path]:
    """Measures a trade-off, and keeps it with all its timings in pyperf's form.

    Args:
        question: what is swept.
        runner: where the cases run.
        folder: of all results.
        engines: to which it is restricted.
        over: parameter -> values; the range over which the best points are checked.
        claims: what is claimed of it; nothing where it is restricted to some engines.
        brief: measure speeds less often.
        progress: called with a short text after every run and every measurement.

    Returns:
        the study with ``claims``, and its file.

    Raises:
        InputError: something that does not exist.
        ProofrollError: there is no truth, or the folder cannot be written.
    """
    from proofroll.running.timing import write_benchmarks
    from proofroll.studies.tradeoff import stored, tradeoff
    from proofroll.studies.tradeoff_content import tradeoff_study
    from proofroll.studies.tradeoff_records import TradeoffJudged

    found = tradeoff(question, runner, engines=engines, over=over, brief=brief, progress=progress)
    study = tradeoff_study(found)
    judged = claims if not engines else None
    held = TradeoffJudged(
        claims.name if claims else None,
        judged.contradictions(study) if judged else [],
        judged.undecided(study) if judged else [],
    )
    study = dataclasses.replace(study, engines=sorted(engines), claims=held)
    path = stored(folder, question, engines, brief=brief)
    keep(study, path)
    names = {
        point.case.key: f"{curve.engine} {point.step or ''}".strip() for curve in found.curves for point in curve.points
    }
    write_benchmarks({names[key]: timing for key, timing in found.timings.items()}, path.with_suffix(".pyperf.json"))
    return study, path


def make_stability(
    asked: StabilityFile,
    axes: Sequence[Axis],
    runner: Runner,
    folder: Path,
    *,
    engines: Sequence[str] = (),
    effort: Effort,
    progress: Callable[[str, int], None] | None = None,
) -> tuple[StabilityStudy, Path]:
    """Maps the boundaries of a scene, and keeps the map with a program for each boundary.

    Args:
        asked: the file about the scene.
        axes: those that are mapped.
        runner: where the cases run.
        folder: of all results.
        engines: to which it is restricted.
        effort: how much it may cost.
        progress: called with a short text and the number of points finished since the last call.

    Returns:
        the study with ``claims``, and its file.

    Raises:
        InputError: something that does not exist.
        ProofrollError: the folder cannot be written.
    """
    from proofroll.studies.stability import stability
    from proofroll.studies.stability_content import stability_study
    from proofroll.studies.stability_records import MapClaims
    from proofroll.studies.stability_reproducers import with_programs

    found = stability(asked.scene, axes, runner, engines=engines, effort=effort, progress=progress)
    path = stability_path(folder, asked, axes, engines, effort)
    study = with_programs(found, stability_study(found), path.with_suffix(""), runner.workers)
    study = dataclasses.replace(study, claims=MapClaims(asked.name, asked.contradictions(study)))
    keep(study, path)
    return study, path


def stability_path(
    folder: Path, asked: StabilityFile, axes: Sequence[Axis], engines: Sequence[str], effort: Effort
) -> Path:
    """Where a map is kept: a file for each scene, axes with their values, engines and effort."""
    from proofroll.files.scene_file import load_scene

    identity = [load_scene(asked.scene).digest, [dataclasses.asdict(axis) for axis in axes], sorted(engines)]
    digest = hashlib.sha256(json.dumps([*identity, repr(effort)]).encode()).hexdigest()[:10]
    return folder / "stability" / f"{Path(asked.scene).name}-{digest}.json"
