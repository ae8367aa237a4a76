"""Cache of slow studies; valid while its inputs are unchanged.

Inputs other than the question are found without importing any engine.
"""

import datetime
import hashlib
import json
from dataclasses import dataclass
from importlib.metadata import requires
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar

import proofroll
from proofroll.core.entry_points import announced
from proofroll.core.plugins import ELEMENTS, GROUP, distribution_of
from proofroll.core.source_code import hash_of
from proofroll.core.truth import TRUTHS
from proofroll.files.atomic import ordinary_content
from proofroll.files.json_data import plain, record
from proofroll.running.environments import remembered
from proofroll.running.identity import ASIDE, versions_of
from proofroll.running.store import seal, write_text
from proofroll.running.timing import machine

_Study = TypeVar("_Study")
# Folders of the package whose code decides no result.
_ASIDE = frozenset({"cli", "conformance", "report"})


def versions() -> dict[str, str]:
    """Versions of proofroll, of its requirements, of packages that announce engines, and of environments.

    For an environment ``NAME@LABEL`` it is a hash of all its packages. Packages that announce engines, truths or kinds
    of elements have a further entry with a hash of their code.
    """
    plug_ins = [point for group in (GROUP, ELEMENTS, TRUTHS) for point in announced(group) if point.dist is not None]
    names = _required() | {point.dist.name for point in plug_ins if point.dist is not None}
    packages = versions_of(sorted(names, key=str.lower))
    for top in sorted({point.module.partition(".")[0] for point in plug_ins} - {"proofroll"}):
        packages[f"code of {top}"] = _code_of(top)
    for item in remembered():
        content = "\n".join([item.version, item.interpreter, *item.packages])
        packages[f"{item.name}@{item.label}"] = hashlib.sha256(content.encode()).hexdigest()[:12]
    return packages


def _code_of(top: str) -> str:
    """Hash of a top-level package or module, which is not imported; empty if it has no single place."""
    spec = find_spec(top)
    if spec is None or spec.origin is None:
        return ""
    file = Path(spec.origin)
    return hash_of([file.parent if spec.submodule_search_locations else file], ASIDE)


def _required() -> set[str]:
    """Names of proofroll and of its requirements, those of all extras included."""
    return {"proofroll", *map(distribution_of, requires("proofroll") or [])}


def code() -> str:
    """Hash of all code in proofroll that may decide a result."""
    root = Path(proofroll.__file__).parent
    content = hashlib.sha256()
    for file in sorted(root.rglob("*.py")):
        if file.relative_to(root).parts[0] not in _ASIDE:
            content.update(file.read_bytes())
    return content.hexdigest()[:16]


@dataclass(frozen=True)
class Measured:
    """Time, machine, versions and code of a study."""

    when: str
    machine: dict[str, str]
    versions: dict[str, str]
    code: str


def conditions_now() -> Measured:
    """Time, machine, versions and code at this moment."""
    return Measured(datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"), machine(), versions(), code())


def changes(measured: Measured) -> list[str]:
    """Inputs that changed since the study was measured, as short texts; empty if it is still valid here."""
    differences = []
    then, now = measured.machine, machine()
    differences += [f"{key} {then.get(key)} then, {value} now" for key, value in now.items() if then.get(key) != value]
    then, now = measured.versions, versions()
    required = _required()
    for name in sorted(then.keys() | now.keys(), key=str.lower):
        if name not in then and name not in required:
            continue  # a new engine does not affect the measured ones
        if "@" in name and name not in now:
            continue  # a removed environment does not affect the measured results
        if then.get(name) != now.get(name):
            differences.append(f"{name} {then.get(name, 'absent')} then, {now.get(name, 'absent')} now")
    if measured.code != code():
        differences.append("proofroll's own code has changed")
    return differences


def valid_study(path: Path, kind: type[_Study]) -> tuple[_Study | None, list[str]]:
    """Stored study if it is still valid here.

    Returns:
        The study or None, and if it is invalid the changes that made it so; no changes if there is no such file.
    """
    try:
        content = json.loads(ordinary_content(path))
        if content.pop("seal") != seal(content):
            return None, ["the stored data differ from those that were written"]
        reasons = changes(record(Measured, content["measured"]))
        return (None, reasons) if reasons else (record(kind, content), [])
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):  # absent, truncated or not ours
        return None, []


def keep_study(study: Any, path: Path) -> None:
    """Stores a study for :func:`valid_study`. Raises ProofrollError if the folder cannot be written."""
    content = plain(study)
    write_text(path, json.dumps({**content, "seal": seal(content)}))
