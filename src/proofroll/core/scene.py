"""Scene: elements, parameters and questions, frozen and typed.

A scene knows no engine and no kind of element: :mod:`proofroll.core.element` has the protocol of elements. Engines
compare :attr:`Scene.requires` with the capabilities of their formulations.
"""

import copy
import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Self

from proofroll.core.arrays import read_only
from proofroll.core.element import Element, described_by
from proofroll.core.errors import InputError, choices, require_known
from proofroll.core.observable import Observable
from proofroll.core.source_code import code_of

_NOTHING = "this scene has no results besides its motion; leave it out"


@dataclass(frozen=True)
class Scene:
    """One mechanical problem.

    Attributes:
        name: folder name under ``models/``.
        title: one line for a person.
        elements: its parts, each of one kind.
        parameters: the numbers a user can set by name, SI units.
        folder: folder of the scene's file and its engine-native models.
        asks: results wanted besides the motion; others need not be modelled.
        files: names of the engine-native models in the folder, and of files that these read.
        omitted: clauses on what its file describes and the scene leaves out, with the option that brings it in.

    Raises:
        InputError: no elements, two elements of one name, or a question that no element can answer.
    """

    name: str
    title: str
    elements: tuple[Element, ...]
    parameters: Mapping[str, float] = field(default_factory=dict)
    folder: Path = Path()
    asks: tuple[str, ...] = ()
    files: tuple[str, ...] = ()
    omitted: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Checks names and questions, and makes the arrays of its elements read-only."""
        read_only(self.elements)
        names = [element.name for element in self.elements]
        if not names:
            raise InputError("scene", self.name, "it holds no element; add bodies or balls")
        for name in names:
            if names.count(name) > 1:
                raise InputError("scene", name, "two elements have this name; rename one")
            if "." in name and len(names) > 1:
                raise InputError("scene", name, "a dot parts a quantity from its element; name the element without")
        for name in self.asks:
            if not any(name in element.askable for element in self.elements):
                questions = dict.fromkeys(questions for element in self.elements for questions in element.askable)
                advice = f"no element of the scene offers this; choose {choices(questions)}" if questions else _NOTHING
                raise InputError("asks", name, advice)

    @property
    def fully_asked(self) -> Self:
        """Copy of the scene that asks for every optional result of its elements, as a truth needs it."""
        asks = tuple(dict.fromkeys(ask for element in self.elements for ask in element.askable))
        return self if asks == self.asks else replace(self, asks=asks)

    @property
    def for_an_engine(self) -> Self:
        """Deep copy of the scene, which an engine may change without harm."""
        return replace(copy.deepcopy(self))

    @cached_property
    def requires(self) -> frozenset[str]:
        """Capabilities that a formulation must provide for its elements and questions."""
        needs = {need for element in self.elements for need in element.requires}
        asked = {element.askable[name] for element in self.elements for name in self.asks if name in element.askable}
        return frozenset(needs | asked)

    def label(self, element: Element, name: str) -> str:
        """Name in the scene of an element's variable or observable; with several elements, ``name.element``."""
        return f"{name}.{element.name}" if len(self.elements) > 1 else name

    @cached_property
    def observables(self) -> dict[str, Observable]:
        """Observables of all elements, by name in the scene."""
        return {self.label(element, item.name): item for element in self.elements for item in element.observables}

    @property
    def deciding(self) -> str:
        """Default observable of a stability map and of a ladder."""
        return next(name for name, item in self.observables.items() if item.decides)

    def observable(self, name: str, field: str = "quantity") -> Observable:
        """The observable of this name.

        Args:
            name: in the scene.
            field: location of the name in the file, for the message.

        Raises:
            InputError: no element has it, or no run of this scene determines it.
        """
        require_known(field, name, self.observables, "there is no such observable; choose from")
        item = self.observables[name]
        if item.absent:
            raise InputError(field, name, item.absent)
        return item

    @property
    def natural_time(self) -> float:
        """Period of the slowest motion of any element [s]."""
        return max(element.natural_time for element in self.elements)

    @cached_property
    def digest(self) -> str:
        """Hash of everything in the scene that decides a result: elements, questions and engine-native files.

        The code of elements from other packages is included; that of this package is part of every engine's hash
        instead.
        """
        content = [[described_by(element), asdict(element)] for element in self.elements]  # type: ignore[call-overload]
        code = code_of(self.elements)
        everything = [self.name, content, self.asks, *([code] if code else [])]
        digest = hashlib.sha256(json.dumps(everything, sort_keys=True, default=str).encode())
        for name in self.files:
            digest.update(name.encode() + (self.folder / name).read_bytes())
        return digest.hexdigest()[:16]
