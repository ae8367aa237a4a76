"""Comparison of two versions of an engine's importer on a robot file."""

from dataclasses import dataclass
from pathlib import Path

from proofroll.core.plugins import plain_name
from proofroll.robots.check.check import check
from proofroll.robots.check.records import ImporterRow
from proofroll.robots.check.terminal import amount
from proofroll.running.engine_questions import describe
from proofroll.studies.versions.versions import EngineVersion, VersionsStudy


@dataclass(frozen=True)
class LayerVersions:
    """Result at a layer in both versions (None: not offered); ``changed``: True if one holds and the other does not."""

    layer: str
    old: str | None
    new: str | None
    changed: bool


@dataclass(frozen=True)
class RobotVersions:
    """Results for a robot file in both versions, by layer, and the rows of both checks."""

    file: str
    layers: list[LayerVersions]
    old: ImporterRow
    new: ImporterRow


def robot_versions(file: str, old: str, new: str) -> VersionsStudy:
    """Content of `proofroll diff` for a robot file: two versions, given as ``NAME`` or ``NAME@PLACE``.

    Raises:
        InputError, Missing: see :func:`proofroll.robots.check.check.check`.
    """
    rows = check(Path(file), [old, new]).engines
    layers, changes = [], []
    for layer in dict.fromkeys(name for row in rows for name in row.layers):
        both_layers = [row.layers.get(layer) for row in rows]
        holds = [None if item is None else item.holds for item in both_layers]
        shown = [None if item is None else "holds" if item.holds else amount(item.difference) for item in both_layers]
        layers.append(LayerVersions(layer, shown[0], shown[1], holds[0] != holds[1]))
        if holds[0] != holds[1]:
            changes.append(f"{layer}: {shown[0] or 'not offered'} → {shown[1] or 'not offered'}")
    if rows[0].status != rows[1].status:
        changes.insert(0, f"the robot: {_does(rows[0])} → {_does(rows[1])}")
    elif _causes(rows[0]) != _causes(rows[1]):
        changes.insert(0, f"causes: {_causes(rows[0]) or 'none'} → {_causes(rows[1]) or 'none'}")
    return VersionsStudy(
        engine=plain_name(old),
        old=_side(old, rows[0]),
        new=_side(new, rows[1]),
        comparisons=[Path(file).name],
        robot=RobotVersions(file, layers, *rows),
        changed=changes,
        lost=[f"{row.engine}: {row.message}" for row in rows if row.status == "missing"],
    )


def _side(name: str, row: ImporterRow) -> EngineVersion:
    return EngineVersion(name, row.version or "", describe(name).interpreter)


def _causes(row: ImporterRow) -> str:
    return "; ".join(f"{cause.name} ({cause.layer})" for cause in row.causes)


def _does(row: ImporterRow) -> str:
    by = f" by: {_causes(row)}" if row.causes else ""
    return f"{row.status}{by}" + (f": {row.message}" if row.message else "")
