"""Robot files of other packages, checked one after another: what differs, is refused, or breaks the check."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from rich.table import Table

from proofroll.core.errors import InputError
from proofroll.robots.check.check import check
from proofroll.robots.check.records import RobotCheck
from proofroll.robots.files.meaning import CheckSettings
from proofroll.running.engine_questions import lent_workers
from proofroll.running.idle_workers import Workers

# Worst first.
OUTCOMES = ("traceback", "unexplained", "refused", "known causes", "clean", "part of a file")
# Of a file that only others include.
_PARTS = ("nothing in it moves", "it has no links", "'mujocoinclude'")


@dataclasses.dataclass(frozen=True)
class FileOutcome:
    """A file, one of :data:`OUTCOMES`, and why, an item for each engine."""

    file: str
    outcome: str
    why: Sequence[str] = ()


def robot_files(folder: Path) -> list[Path]:
    """URDF and MJCF files in a folder and below."""
    found = (path for ending in ("urdf", "xml") for path in folder.rglob(f"*.{ending}"))
    return sorted(path for path in found if path.suffix == ".urdf" or b"<mujoco" in path.read_bytes()[:20_000])


def checked_files(
    folders: Sequence[Path], every: int, states: int, progress: Callable[[str], None]
) -> Iterator[FileOutcome]:
    """Checks every n-th file of the folders; each folder holds all that its files name."""
    with lent_workers(None) as workers:
        for folder in folders:
            for path in robot_files(folder)[::every]:
                found = checked(path, folder, states, workers)
                progress(found.outcome)
                yield found


def checked(path: Path, folder: Path, states: int, workers: Workers) -> FileOutcome:
    """A file with a fixed base, or with a free one where nothing moves else."""
    name = str(path.relative_to(folder.parent))
    try:
        settings = CheckSettings(root=folder, states=states, time_limit=60)
        try:
            found = check(path, (), settings, workers=workers)
        except InputError as error:
            if "try --base free" not in str(error):
                raise
            found = check(path, (), dataclasses.replace(settings, base="free"), workers=workers)
    except InputError as error:
        part = any(words in str(error) for words in _PARTS)
        return FileOutcome(name, "part of a file" if part else "refused", [f"the file: {error.advice}"])
    except Exception as error:  # what this looks for
        return FileOutcome(name, "traceback", [f"{type(error).__name__}: {error}"])
    return FileOutcome(name, *_outcome(found))


def _outcome(found: RobotCheck) -> tuple[str, list[str]]:
    kinds = {
        "holds": "clean",
        "explained": "known causes",
        "missing": "clean",
        "refused": "refused",
        "differs": "unexplained",
    }
    outcomes, why = [], []
    for row in found.engines:
        outcomes.append(kinds.get(row.status, "traceback"))
        said = ", ".join(cause.id for cause in row.causes)
        why += [f"{row.engine}: {row.unexplained}"] if row.unexplained else []
        why += [f"{row.engine}: {row.message or said}"] if row.message or said else []
        if row.as_written not in {None, "read"}:
            why.append(f"{row.engine} as it is: {row.as_written}")
    return min(outcomes, key=OUTCOMES.index), why


def outcome_table(found: Sequence[FileOutcome]) -> Table:
    """A row for each package, a column for each outcome."""
    table = Table(box=None, padding=(0, 1, 0, 0))
    table.add_column("folder", no_wrap=True)
    for outcome in OUTCOMES:
        table.add_column(outcome, justify="right")
    folders = dict.fromkeys(item.file.partition("/")[0] for item in found)
    for folder in (*folders, None):
        counts = Counter(item.outcome for item in found if folder is None or item.file.startswith(f"{folder}/"))
        table.add_row(folder or "all", *(str(counts[outcome]) for outcome in OUTCOMES))
    return table


def lines(found: Sequence[FileOutcome]) -> Iterator[str]:
    """A line for each file that is neither clean nor differs by known causes alone."""
    for outcome in OUTCOMES[:3]:
        for item in found:
            if item.outcome == outcome:
                yield f"{outcome}: {item.file}: {'; '.join(item.why)}"
