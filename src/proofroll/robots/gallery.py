"""Gallery: robots of installed packages, with the expected and actual outcome of each engine's importer.

``comparisons/robots.toml`` lists them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from functools import partial
from importlib.metadata import PackageNotFoundError, files
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from proofroll.core.errors import require_known
from proofroll.core.plugins import parse_engine
from proofroll.core.validation import strict, validated
from proofroll.files.data_folders import data_folder
from proofroll.files.toml import read_toml
from proofroll.robots import reading
from proofroll.robots.check import check
from proofroll.robots.hypotheses import hypotheses
from proofroll.robots.meaning import CheckSettings
from proofroll.robots.records import GalleryContent, GalleryReading, GalleryRow, ImporterRow
from proofroll.running.engine_questions import lent_workers

if TYPE_CHECKING:
    from proofroll.running.cluster import Cluster
    from proofroll.running.idle_workers import Workers

# Outcomes of an engine other than causes of its differences.
REFUSES, CRASHED, OPEN = "refuses", "crashed", "open"


@dataclasses.dataclass(frozen=True)
class Entry:
    """A robot of the gallery.

    Attributes:
        name: unique.
        package: distribution in which the file lies.
        file: end of its path there.
        engines: engine -> causes of its differences; ``refuses``; ``crashed``; ``open``, also beside causes: something
            stays unexplained.
        base: support of the root of a URDF.
    """

    name: str
    package: str
    file: str
    engines: dict[str, tuple[str, ...]]
    base: Literal["fixed", "free"] = "fixed"


@dataclasses.dataclass(frozen=True)
class _File:
    """Content of ``robots.toml``."""

    robots: list[Entry]
    title: str = ""
    study: str = ""


strict(_File, Entry)


def read_gallery(path: str | Path | None = None) -> list[Entry]:
    """Entries of the gallery's file. Raises InputError if it is invalid, or names an unknown cause."""
    path = Path(path or data_folder("comparisons") / "robots.toml")
    outcomes = sorted({REFUSES, CRASHED, OPEN, *(hypothesis.id for hypothesis in hypotheses())})
    entries = validated(_File, read_toml(path), path.name).robots
    for index, entry in enumerate(entries):
        for engine, causes in entry.engines.items():
            for cause in causes:
                require_known(f"{path.name}: robots.{index}.engines.{engine}", cause, outcomes)
    return entries


def locate(entry: Entry) -> Path | None:
    """Path of a robot's file; None if its package is not installed or has no such file."""
    try:
        inside = files(entry.package) or []
    except PackageNotFoundError:
        return None
    entry_file = next((item for item in inside if f"/{item}".endswith(f"/{entry.file}")), None)
    return None if entry_file is None else Path(str(entry_file.locate()))


def gallery(
    names: Sequence[str] = (),
    engines: Sequence[str] = (),
    progress: Callable[[str], None] | None = None,
    cluster: Cluster | None = None,
) -> GalleryContent:
    """Checks robots, each with the installed engines that its entry names; by default all robots and engines.

    ``progress`` is called with the name of each robot.

    Raises:
        InputError: there is no such robot or engine.
    """
    entries = read_gallery()
    for name in names:
        require_known("robot", name, [entry.name for entry in entries])
    for name in engines:
        reading.load_reader(parse_engine(name).name)
    rows = []
    chosen, row = [entry for entry in entries if not names or entry.name in names], partial(_row, tuple(engines))
    with lent_workers(None) as workers:  # each engine is started once for all robots
        for host, entry_row in cluster.map(row, chosen) if cluster else (("", row(entry, workers)) for entry in chosen):
            rows.append(dataclasses.replace(entry_row, ran_on=host))
            if progress is not None:
                progress(entry_row.name)
    return GalleryContent(rows)


def _row(engines: Sequence[str], entry: Entry, workers: Workers | None = None) -> GalleryRow:
    path = locate(entry)
    names = [name for name in entry.engines if parse_engine(name).name in reading.reader_names()]
    if engines:
        names = [name for name in names if name in engines or parse_engine(name).name in engines]
    if path is None or not names:
        return GalleryRow(entry.name, entry.package, None if path is None else str(path))
    readings, unexpected = [], []
    for item in check(path, names, CheckSettings(base=entry.base), workers=workers).engines:
        outcomes = outcome(item)
        readings.append(
            GalleryReading(
                engine=item.engine,
                version=item.version,
                status=item.status,
                causes=item.causes,
                message=item.message,
                outcome=outcomes,
            )
        )
        if item.status != "missing" and set(outcomes) != set(entry.engines[item.engine]):
            expected = ", ".join(entry.engines[item.engine]) or "to hold the file"
            unexpected.append(f"{item.named}: expected {expected}; found {', '.join(outcomes) or 'holds the file'}")
    return GalleryRow(name=entry.name, package=entry.package, file=str(path), engines=readings, unexpected=unexpected)


def outcome(row: ImporterRow) -> list[str]:
    """Outcome of an engine in the words of the gallery's file: causes, ``open``, ``refuses`` or a status."""
    if not row.layers:
        return [REFUSES] if row.status == "refused" else [row.status]
    return [*dict.fromkeys(cause.id for cause in row.causes), *([OPEN] if row.unexplained else [])]
