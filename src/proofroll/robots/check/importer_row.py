"""Row of an engine's importer: its differences, their causes, and the joints whose bodies differ."""

import contextlib
import dataclasses
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import TypeVar
from xml.etree.ElementTree import Element, fromstring, tostring

import numpy as np

from proofroll.core.errors import InputError
from proofroll.core.limits import TIME_LIMIT
from proofroll.core.number_format import counted
from proofroll.core.plugins import EngineSpec, plain_name
from proofroll.robots.check.explain import Search
from proofroll.robots.check.layers import LAYERS, TOLERANCE, RobotTruth, differences, first_failing, worst_place
from proofroll.robots.check.records import HeldLayer, ImporterRow
from proofroll.robots.files import reading
from proofroll.robots.files.meaning import meaning
from proofroll.robots.files.robot_file import RobotFile
from proofroll.robots.protocol import Reading, Whole
from proofroll.running.idle_workers import Workers
from proofroll.running.process import WorkerDied

# The two formulations must agree to a tenth of any tolerance; else their difference raises it.
_MARGIN = 10.0


def importer_row(
    file: RobotFile,
    truth: RobotTruth,
    bar: float,
    spec: EngineSpec,
    answer: reading.ReaderAnswer,
    workers: Workers | None = None,
    ask: Callable[[Path], reading.ReaderAnswer] | None = None,
) -> ImporterRow:
    """Row of an engine that answered.

    Args:
        file: the file.
        truth: the file's meaning at random states.
        bar: relative difference of the truth's two formulations.
        spec: engine with options.
        answer: the engine's answer.
        workers: processes that compile edited files.
        ask: path of an edited file -> the engine's answer; None: it cannot be asked again.
    """
    row = ImporterRow(
        engine=str(spec), status="refused", version=answer.version, message=answer.refused, says=answer.says
    )
    if answer.reading is None:
        return row
    tolerances = {layer: max(answer.tolerances.get(layer, TOLERANCE), _MARGIN * bar) for layer in LAYERS}
    tolerances["joints"] = 0.0
    off = differences(truth, answer.reading)
    layers = {
        layer: HeldLayer(value, tolerances[layer], bool(value <= tolerances[layer])) for layer, value in off.items()
    }
    recompiled = _of_changed(file, lambda other_file, written: meaning(other_file, written, TIME_LIMIT, workers)[0])
    search = Search(
        file=file,
        reading=answer.reading,
        engine=plain_name(spec.name),
        tolerances=tolerances,
        recompiled=recompiled if file.kind == "mjcf" else Search.recompiled,
        reread=Search.reread if ask is None else _of_changed(file, lambda _, written: ask(written).reading),
    )
    causes, unexplained = search.causes(truth)
    holds = all(layer.holds for layer in layers.values())
    return dataclasses.replace(
        row,
        status="holds" if holds else ("differs" if unexplained else "explained"),
        message=None,
        remarks=answer.reading.remarks,
        layers=layers,
        causes=causes,
        fed=answer.fed,
        where=None if holds else worst_place(truth, answer.reading, str(first_failing(off, tolerances))),
        unexplained=unexplained,
        held=Whole(sum(answer.reading.dofs), sum(answer.reading.mass.values())),
        offending=_offending(truth, answer.reading),
    )


# Relative tolerance of the mass: a file that MuJoCo wrote out has six digits.
_SAME_MASS = 1e-4


def row_with_copy(as_written: reading.AsWritten, row: ImporterRow) -> str:
    """Clause on an engine's reading of the unchanged file, compared with its reading of the copy."""
    if as_written.whole is None:
        return f"refused ({as_written.refused})"
    if row.held is None:
        return "read"
    (nv, mass), (nv_of_copy, mass_of_copy) = (dataclasses.astuple(item) for item in (as_written.whole, row.held))
    if nv == nv_of_copy and abs(mass - mass_of_copy) <= _SAME_MASS * max(abs(mass), abs(mass_of_copy)):
        return "read"
    whole = f"held with {counted(nv, 'velocities')} and {mass:.6g} kg"
    return f"{whole}, the copy that is compared with {nv_of_copy} and {mass_of_copy:.6g} kg"


_Made = TypeVar("_Made")


def _of_changed(file: RobotFile, make: Callable[[RobotFile, Path], _Made | None]) -> Callable[[Element], _Made | None]:
    """Cached function from an edited file to ``make`` of its written copy; its result is None if that fails."""

    @cache
    def made(content: bytes) -> _Made | None:
        other_file = dataclasses.replace(file, root=fromstring(content))
        with tempfile.TemporaryDirectory() as folder, contextlib.suppress(InputError, WorkerDied):
            return make(other_file, reading.write(other_file, Path(folder)))
        return None

    return lambda root: made(tostring(root, "utf-8"))


def _offending(truth: RobotTruth, reading: Reading) -> list[str]:
    """Joints whose carried body an engine holds with another mass, centre of mass or inertia, or lacks."""
    groups = truth.robot.groups
    offending = [name for name in groups if name not in reading.joints]
    spin = max((float(np.abs(group.inertia).max()) for group in groups.values()), default=1.0) or 1.0
    for name, group in groups.items():
        if name in reading.mass:
            off = max(
                abs(reading.mass[name] - group.mass), float(np.abs(reading.inertia[name] - group.inertia).max()) / spin
            )
            apart = float(np.abs(reading.com[name] - group.com).max()) if group.mass > 0 < reading.mass[name] else 0.0
            if max(off, apart) > 1e-6:
                offending.append(name)
    return offending
