"""What decides the numbers of a stored study besides its question: told without importing a single engine."""

from __future__ import annotations

import datetime
import hashlib
import re
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path

import proofroll
from proofroll.core.announced import announced
from proofroll.core.plugins import GROUP
from proofroll.running.environments import remembered
from proofroll.running.timing import machine

# Folders of the package on which no result hangs.
_ASIDE = frozenset({"cli", "conformance", "report"})


def versions() -> dict[str, str]:
    """Versions of proofroll, of what it can use, of packages that announce engines, and of remembered environments.

    An environment ``NAME@LABEL`` has the hash of all that is installed in it for its version.
    """
    names = _required() | {point.dist.name for point in announced(GROUP) if point.dist is not None}
    found = {}
    for name in sorted(names, key=str.lower):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    for item in remembered():
        content = "\n".join([item.version, item.interpreter, *item.packages])
        found[f"{item.name}@{item.label}"] = hashlib.sha256(content.encode()).hexdigest()[:12]
    return found


def _required() -> set[str]:
    """Names of proofroll and of all that it can use: requirements of all extras count."""
    return {"proofroll"} | {re.split(r"[\s;<>=!~\[(]", text, maxsplit=1)[0] for text in requires("proofroll") or []}


def code() -> str:
    """Hash of everything in proofroll on which a result may hang."""
    root = Path(proofroll.__file__).parent
    content = hashlib.sha256()
    for file in sorted(root.rglob("*.py")):
        if file.relative_to(root).parts[0] not in _ASIDE:
            content.update(file.read_bytes())
    return content.hexdigest()[:16]


@dataclass(frozen=True)
class Measured:
    """When, on which machine and with which versions and code a study was made."""

    when: str
    machine: dict[str, str]
    versions: dict[str, str]
    code: str


def measured() -> Measured:
    """Of a study that is being made."""
    return Measured(datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"), machine(), versions(), code())


def changes(measured: Measured) -> list[str]:
    """What is another than when a study was measured, as short texts; empty if it still holds here."""
    found = []
    then, now = measured.machine, machine()
    found += [f"{key} {then.get(key)} then, {value} now" for key, value in now.items() if then.get(key) != value]
    then, now = measured.versions, versions()
    own = _required()
    for name in sorted(then.keys() | now.keys(), key=str.lower):
        if name not in then and name not in own:
            continue  # a further engine, which was not measured and changes nothing of what was
        if "@" in name and name not in now:
            continue  # an environment that is gone was not made anew with something else
        if then.get(name) != now.get(name):
            found.append(f"{name} {then.get(name, 'absent')} then, {now.get(name, 'absent')} now")
    if measured.code != code():
        found.append("proofroll's own code has changed")
    return found
