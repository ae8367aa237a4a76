"""Reads the comparison files that claim something of a trade-off: ``study = "tradeoff"``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pydantic import ConfigDict, TypeAdapter, ValidationError

from proofroll.core.comparison import Tolerance
from proofroll.core.engine import Level
from proofroll.core.errors import InputError
from proofroll.files.scene_file import load_scene
from proofroll.files.toml import read_toml, study_files
from proofroll.files.validation import first_problem
from proofroll.studies.recommend import Wish, fits, recommend
from proofroll.studies.sweep import Question

STUDY = "tradeoff"


@dataclass(frozen=True)
class Cheapest:
    """Which engine is claimed to be the cheapest at a tolerance.

    Attributes:
        tolerance: of the quantity.
        engine: any of these, ``name[key=value,…]``.
        because: why it is.
        levels: among which rungs of the ladder; all engines proper if empty.
    """

    tolerance: Tolerance
    engine: list[str]
    because: str
    levels: list[Level] = field(default_factory=list)


@dataclass(frozen=True)
class TradeoffClaims:
    """What a file asks and claims.

    Attributes:
        name: of the file, without ending.
        title, question: for a person.
        scene, parameters, until, quantity: what is swept.
        over: parameter -> values; the range over which the best points are checked.
        cheapest: the claims.
    """

    name: str
    title: str
    question: str
    scene: str
    until: float
    quantity: str
    parameters: dict[str, float] = field(default_factory=dict)
    over: dict[str, list[float]] = field(default_factory=dict)
    cheapest: list[Cheapest] = field(default_factory=list)

    @property
    def swept(self) -> Question:
        """What is to be swept."""
        return Question(self.scene, self.parameters, self.until, self.quantity)

    def wish(self, claim: Cheapest) -> Wish:
        """What a claim asks of the measured points."""
        return Wish(self.quantity, claim.tolerance, levels=tuple(claim.levels))

    def contradictions(self, study: Mapping[str, Any]) -> list[str]:
        """What the measured points do not confirm, as sentences."""
        found = []
        for claim in self.cheapest:
            choice = recommend(study, self.wish(claim))["choice"]
            among = f" among {', '.join(claim.levels)}" if claim.levels else ""
            where = f"{self.name}: {self.quantity} to {claim.tolerance.value:g} {claim.tolerance.unit}{among}"
            if choice is None:
                found.append(f"{where}: nothing holds it, expected: {' or '.join(claim.engine)}")
            elif not any(fits(choice, text) for text in claim.engine):
                said = f"{choice['engine']} {choice['settings'].get('formulation', '')}"
                found.append(f"{where}: the cheapest is {said}, expected: {' or '.join(claim.engine)}")
        return found


def claims_for(scene: str) -> TradeoffClaims | None:
    """The claims about a scene as its file has them, or None if there is no file."""
    found = (_claims(path, content) for path, content in study_files(STUDY) if content.get("scene") == scene)
    return next(found, None)


def load_claims(path: Path) -> TradeoffClaims:
    """Reads a file.

    Raises:
        InputError: it is broken, or is about something else.
    """
    content = read_toml(path)
    if content.get("study") != STUDY:
        raise InputError(str(path), "study", f'only a file with study = "{STUDY}" is about a trade-off')
    return _claims(path, content)


def _claims(path: Path, content: dict[str, Any]) -> TradeoffClaims:
    where = path.name
    given = {key: value for key, value in content.items() if key != "study"}
    raw = given.get("cheapest", [])
    for index, claim in enumerate(raw if isinstance(raw, list) else []):
        if isinstance(claim, dict):
            claim["tolerance"] = Tolerance.parse(f"{where}: cheapest.{index}.tolerance", claim.get("tolerance"))
            if isinstance(claim.get("engine"), str):
                claim["engine"] = [claim["engine"]]
    try:
        found = TypeAdapter(TradeoffClaims).validate_python({**given, "name": path.stem})
    except ValidationError as error:
        raise first_problem(error, where) from None
    _check(where, found)
    return found


def _check(where: str, found: TradeoffClaims) -> None:
    scene = load_scene(found.scene, **found.parameters)
    unit = scene.observable(found.quantity, f"{where}: quantity").unit
    if not found.cheapest:
        advice = "the file claims nothing; add [[cheapest]] with tolerance, engine and because"
        raise InputError(f"{where}: cheapest", "nothing", advice)
    for index, claim in enumerate(found.cheapest):
        if not claim.because:
            raise InputError(f"{where}: cheapest.{index}.because", "nothing", "every claim needs its reason; add it")
        if not claim.tolerance.relative and claim.tolerance.unit != unit:
            raise InputError(f"{where}: cheapest.{index}.tolerance", claim.tolerance.unit, f"its unit is {unit}")
    for name, values in found.over.items():
        for value in values:
            load_scene(found.scene, **{**found.parameters, name: value})


for _typed in (TradeoffClaims, Cheapest):
    setattr(_typed, "__pydantic_config__", ConfigDict(extra="forbid"))  # noqa: B010 -- the name is pydantic's, not the class's
