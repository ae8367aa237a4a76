"""Relations of the truth: a scene that has to move as another one does, and whether the truths of both say so."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Iterator, Mapping
from copy import deepcopy
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll import InputError, load_scene
from proofroll.files.toml import toml_text
from proofroll.running.case import Status
from proofroll.running.runner import Runner
from proofroll.running.store import write_text
from proofroll.studies.cases import case_of
from proofroll.studies.comparison.outcome import ComparedPoint
from proofroll.studies.judging.reference import Reference
from proofroll_fuzz.drawing import Relation, SceneFamily
from proofroll_fuzz.surprises import RELATION, TRUTH, Surprise, SurpriseKind

if TYPE_CHECKING:
    import xarray as xr

_BARS = 10.0  # sums of both error bars by which two truths may differ
_ROUND_OFF = 1e-12  # relative to the largest value: positions and angles of a changed file are rounded
_LARGE = 3.0  # size of a surprise that has no number [decades]


def write_scene(folder: Path, tables: Mapping[str, Any]) -> None:
    """Writes the ``scene.toml`` of a random scene into a folder of its own."""
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / "scene.toml", toml_text(tables))


def _other_samples(tables: dict[str, Any], _: object) -> None:
    """Twice as many samples in half the time."""
    samples = round(tables["duration"] / tables["every"])
    tables["duration"] = float(f"{math.ceil(samples / 2) * tables['every']:.12g}")
    tables["every"] /= 2


def _each_second(truth: Mapping[Any, Any], _: object) -> dict[str, Any]:
    names = [name for name in truth if name.startswith(("p_", "v_", "q.", "v."))]
    return {name: truth[name].to_numpy()[::2] for name in names}


def relations_of(family: SceneFamily) -> Mapping[str, Relation]:
    """Relations of the scenes of a family, by name."""
    return {"other samples": Relation(_other_samples, _each_second), **family.relations}


def breaches(folder: Path, point: ComparedPoint, name: str, relation: Relation, runner: Runner) -> Iterator[Surprise]:
    """Surprise of the truth of the scene in a folder that contradicts the truth of a changed scene; or none.

    Args:
        folder: of the scene; the changed one is written into a folder of the relation's name in it.
        point: the truth of the scene.
        name: of the relation.
        relation: the change.
        runner: of the case.
    """
    reference = point.reference
    if point.result.status is not Status.DONE or reference is None or reference.ended or reference.ill_posed:
        return
    tables = tomllib.loads((folder / "scene.toml").read_text(encoding="utf-8"))
    partner_tables = deepcopy(tables)
    try:
        relation.change(partner_tables, reference.dataset)
    except LookupError:
        return
    place = folder / name.replace(" ", "_")
    write_scene(place, partner_tables)

    def breach(quantity: str, size: float, message: str) -> Surprise:
        return Surprise(SurpriseKind(TRUTH, f"{RELATION}{name}", quantity), size, message)

    try:
        scene = load_scene(str(place))
    except InputError as error:
        yield breach("refused by the reader", _LARGE, str(error))
        return
    case = case_of(
        str(place),
        scene.fully_asked,
        (),
        point.case.engine,
        partner_tables["duration"],
        partner_tables["every"],
        time_limit=point.case.time_limit,
    )
    result = runner.run([case])[case.key]
    if result.status is not Status.DONE:
        yield breach("no result", _LARGE, result.message)
        return
    partner = Reference.of(scene, runner.store.stored(case).dataset)
    if partner.ended:
        yield breach("ends", _LARGE, partner.ended)
    elif not partner.ill_posed:
        yield from _worst(reference, partner.dataset, relation.back(partner.dataset, tables), breach)


def _worst(
    reference: Reference, partner: xr.Dataset, values: Mapping[str, Any], breach: Callable[[str, float, str], Surprise]
) -> Iterator[Surprise]:
    """Breach of the variable that differs by the most error bars, if it differs by too many."""
    broken: list[tuple[float, str, str]] = []
    for name, curve in values.items():
        if name not in reference.dataset or (reference.events and name.startswith("v")):
            continue  # a speed jumps at an event, and a sample may be on either side
        variable = reference.dataset[name]
        true = variable.to_numpy()[: len(curve)]
        difference = np.abs(curve - true)
        bar = _bar(reference.dataset, name) + _bar(partner, name)
        allowed = _BARS * bar + _ROUND_OFF * max(float(np.abs(true).max()), reference.sizes.get(name, 0.0))
        if not difference.max() <= allowed:
            index = np.unravel_index(np.argmax(difference), difference.shape)[0]
            time, unit = reference.dataset["time"].to_numpy()[index], variable.attrs.get("units", "")
            words = f"{name} is off by {difference.max():.3g} {unit} at {time:.6g} s, {difference.max() / bar:.2g} bars"
            broken.append((math.log10(difference.max() / allowed), name.partition(".")[0], words))
    if broken:
        size, quantity, words = max(broken)
        yield breach(quantity, size, words)


def _bar(dataset: xr.Dataset, name: str) -> float:
    """Largest error bar of the variables whose names begin alike."""
    alike = [item for label, item in dataset.data_vars.items() if str(label)[:2] == name[:2]]
    return max((float(item.attrs.get("error_bar", 0.0)) for item in alike), default=0.0)
