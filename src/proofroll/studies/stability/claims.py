"""Reads the files with a question and claims for a stability map: ``study = "stability"``."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from proofroll.core.bounds import require_pair
from proofroll.core.errors import InputError, ProofrollError, error_location, require_known
from proofroll.core.plugins import parse_engine
from proofroll.core.validation import strict, validated
from proofroll.files.scene_file import is_scene, load_scene, read_scene_file
from proofroll.files.toml import named_file, study_content, study_files
from proofroll.studies.failure import meanings
from proofroll.studies.stability.axes import Axis, AxisTerm
from proofroll.studies.stability.records import Boundary, BoundaryPoint, StabilityStudy, dependence
from proofroll.studies.stability.step_numbers import step_numbers

STUDY = "stability"
# Fewest values of an axis between which a dependence can show.
_FEWEST_ALIKE = 2
# Fewest steps that must fail to confirm that no step holds; each is a fraction of the one before.
_TRIED = 4
# Values of a parameter along a default axis, relative to its default, as far as its bounds allow.
_PARTS = (0.1, 1.0, 10.0)


@dataclass(frozen=True)
class Claim:
    """Claim about an engine's boundaries.

    Attributes:
        engine: name, or ``name[key=value,…]``; it stands for every curve with these settings.
        boundary: ``stable`` or ``accurate``.
        because: why.
        axes: names of the axes; all if empty.
        values: lowest and highest value of the axis; all if empty.
        never: True if no step holds; then nothing else is claimed but ``failure`` and ``silent``.
        same: True if the boundary, in natural times, is the same all along each axis.
        number: dimensionless number of the boundary that is claimed to lie in ``between``.
        between: lowest and highest.
        failure: kinds of failure allowed beyond it.
        silent: True if the engine does not report the failure.
    """

    engine: str
    boundary: Literal["stable", "accurate"]
    because: str
    axes: list[str] = field(default_factory=list)
    values: list[float] = field(default_factory=list)
    never: bool = False
    same: bool = False
    number: str | None = None
    between: list[float] = field(default_factory=list)
    failure: list[str] = field(default_factory=list)
    silent: bool | None = None

    def untested(self, points: Sequence[BoundaryPoint]) -> str:
        """Reason why the points of a map cannot test the claim; empty if they can."""
        about = [point for point in points if self._about(point) and not point.problem]
        if not about:
            return "no point of this map is about it"
        about = [point for point in about if not point.timed_out]
        if not about:
            return "runs met the limit of time, which a faster machine might not"
        sides = [(point, point.sides[self.boundary]) for point in about]
        if self.same and sum(side.largest is not None for _, side in sides) < _FEWEST_ALIKE:
            return "nothing holds at two values of the axis"
        cut = [side.largest is None and point.cut for point, side in sides]
        tried = max(point.runs for point in about)
        if all(cut) and not self.failure and not (self.never and tried >= _TRIED):
            return "its searches were cut: finer runs take too long for this map"
        return ""

    def contradictions(self, points: Sequence[BoundaryPoint]) -> list[str]:
        """Contradictions by the points of a map, as sentences; points whose runs met the time limit do not count."""
        sentences = []
        about = [p for p in points if self._about(p) and not p.problem and not p.timed_out]
        if self.same:
            for curve, axis in dict.fromkeys((point.curve, point.axis) for point in about):
                on_axis = [p for p in about if (p.curve, p.axis) == (curve, axis)]
                change = dependence(on_axis, self.boundary)
                if change:
                    sentences.append(
                        f"{curve} along {axis}: {self.boundary} up to {change}, expected the same everywhere"
                    )
        expected = self.failure and not any(point.sides[self.boundary].failure for point in about)
        if about and expected and not any(point.cut for point in about):
            sentences.append(
                f"{self.engine}: nothing fails beyond {self.boundary}, expected: {' or '.join(self.failure)}"
            )
        for point in about:
            side = point.sides[self.boundary]
            place = f"{point.curve} at {point.axis} = {point.value:g}"
            sentences += [f"{place}: {sentence}" for sentence in self._wrong(side, point.cut)]
        return sentences

    def _about(self, point: BoundaryPoint) -> bool:
        if not parse_engine(self.engine).means(point.engine, point.settings):
            return False
        if self.axes and point.axis not in self.axes:
            return False
        return not self.values or self.values[0] <= point.value <= self.values[1]

    def _wrong(self, side: Boundary, cut: bool) -> list[str]:
        """Contradictions by one boundary; a missing one is no contradiction if finer runs were ``cut`` as too long."""
        sentences = []
        largest = side.largest
        if self.never and largest is not None:
            sentences.append(f"{self.boundary} at a step or tolerance of {largest:g}, expected at none")
        if self.number is not None:
            value = side.numbers.get(self.number)
            low, high = self.between
            if value is None and cut:
                return sentences
            if value is None or not low <= value <= high:
                seen = "no step is" if value is None else f"{value:.3g} is the largest"
                sentences.append(f"{self.boundary}: {self.number}: {seen}, expected between {low:g} and {high:g}")
        if self.failure and side.failure and side.failure not in self.failure:
            sentences.append(f"beyond {self.boundary}: {side.failure}, expected: {' or '.join(self.failure)}")
        if self.silent is not None and side.failure and side.silent != self.silent:
            words = {True: "silent", False: "said so"}
            sentences.append(f"beyond {self.boundary}: {words[side.silent]}, expected: {words[self.silent]}")
        return sentences


@dataclass(frozen=True)
class StabilityFile:
    """Question and claims of a stability map's file.

    Attributes:
        name: of the file, without ending.
        title, question: for a person.
        scene: name of the scene.
        axes: along which it is taken to its extremes.
        claims: expectations.
        on_request: True if a report without names has this map only when it is stored already.
    """

    name: str
    title: str
    question: str
    scene: str
    axes: list[Axis]
    claims: list[Claim] = field(default_factory=list)
    on_request: bool = False

    def contradictions(self, study: StabilityStudy) -> list[str]:
        """Contradictions by a map, as sentences."""
        return [sentence for claim in self.claims for sentence in claim.contradictions(study.points)]


def file_for(scene: str) -> StabilityFile:
    """Stability file by its path or name, or about a named scene, or a default map of the scene's parameters.

    Raises:
        InputError: there is no such scene, or the file is broken.
    """
    named = None if is_scene(scene) else named_file(scene) or (Path(scene) if Path(scene).suffix == ".toml" else None)
    about = (path for path, content in study_files(STUDY) if content.get("scene") == scene)
    path = named or next(about, None)
    if path is not None:
        return _load(path)
    question = "Up to which step or tolerance is each engine stable, and up to which is it right to 1 %?"
    return StabilityFile(
        name=Path(scene).stem,
        title=read_scene_file(scene).title,
        question=question,
        scene=scene,
        axes=default_axes(scene),
    )


def _load(path: Path) -> StabilityFile:
    place = path.name
    content = study_content(path, STUDY)
    file = validated(StabilityFile, content, place, name=path.stem)
    with error_location(place):
        _check(place, file)
    return file


def _check(place: str, file: StabilityFile) -> None:
    scene = load_scene(file.scene)
    for index, axis in enumerate(file.axes):
        if not axis.values:
            raise InputError(f"{place}: axes.{index}.values", None, "an axis needs its values; add them")
        for value in axis.values:
            # a parameter may be infinite, but not the length of a run
            if not value > -math.inf or (axis.horizon and not (math.isfinite(value) and value > 0)):
                what = "a length in natural times that is positive and finite" if axis.horizon else "a number"
                raise InputError(f"{place}: axes.{index}.values", value, f"give {what}")
        axis.at(scene, axis.values[0])
    axis_names = [axis.name for axis in file.axes]
    numbers = [item.name for item in step_numbers(scene)]
    for index, claim in enumerate(file.claims):
        claim_place = f"{place}: claims.{index}"
        if not claim.because:
            raise InputError(f"{claim_place}.because", None, "every claim needs its reason; add it")
        with error_location(claim_place):
            parse_engine(claim.engine)
        for name in claim.axes:
            require_known(f"{claim_place}.axes", name, axis_names, "there is no such axis; choose from")
        for failure in claim.failure:
            require_known(f"{claim_place}.failure", failure, meanings(scene))
        if claim.number is not None:
            require_known(f"{claim_place}.number", claim.number, numbers)
        if (claim.number is None) != (not claim.between):
            raise InputError(f"{claim_place}.between", claim.between, "number and between = [low, high] go together")
        for name in ("between", "values"):
            if pair := getattr(claim, name):
                require_pair(f"{claim_place}.{name}", pair)


strict(StabilityFile, Claim, Axis)
strict(AxisTerm, finite=True)


def default_axes(name: str) -> list[Axis]:
    """Axes of a stability map: each continuous parameter of the scene that is not zero, and the length of the run."""
    file = read_scene_file(name)
    values = load_scene(name).parameters
    axes = []
    for key, item in file.parameters.items():
        if item.integer or not values[key]:
            continue
        allowed = [part for part in _PARTS if _loads(name, key, part * values[key])]
        if len(allowed) > 1:
            axes.append(
                Axis(
                    name=key,
                    unit="1",
                    meaning=f"{item.meaning}, in parts of the default",
                    values=allowed,
                    parameters={key: AxisTerm(key)},
                )
            )
    return [*axes, Axis("horizon", "swings", "length of the run in natural times", [1.0, 3.0], horizon=True)]


def _loads(name: str, key: str, value: float) -> bool:
    try:
        load_scene(name, **{key: value})
    except ProofrollError:
        return False
    return True
