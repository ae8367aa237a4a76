"""Random scenes: choices from a seed, what they make, and families of them, which packages announce."""

from __future__ import annotations

import random
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations
from typing import Any, TypeVar

from proofroll.core.entry_points import loaded

GROUP = "proofroll.scene_families"
T = TypeVar("T")
# Changes the content of a scene file; raises LookupError where it does not apply.
Change = Callable[[dict[str, Any]], object]


class Choices:
    """Random choices that a seed decides, on every machine alike."""

    def __init__(self, seed: int) -> None:
        self._random = random.Random(seed)

    def pick(self, items: Sequence[T]) -> T:
        """One of the items, all equally likely."""
        return items[self.whole(0, len(items) - 1)]

    def happens(self, probability: float) -> bool:
        """True with this probability."""
        return self._random.random() < probability

    def whole(self, low: int, high: int) -> int:
        """Whole number from ``low`` to ``high``, both included."""
        return low + int(self._random.random() * (high - low + 1))

    def number(self, low: float, high: float, size: float = 1.0) -> float:
        """Number between ``low`` and ``high``, times a size, of three digits."""
        return three_digits(size * (low + (high - low) * self._random.random()))

    def decade(self, low: float, high: float, size: float = 1.0) -> float:
        """Number whose logarithm to base 10 is between ``low`` and ``high``, times a size, of three digits."""
        return three_digits(size * 10 ** (low + (high - low) * self._random.random()))

    def vector(self, size: float = 1.0) -> list[float]:
        """Three numbers up to a size."""
        return [self.number(-1, 1, size) for _ in range(3)]


def three_digits(value: float) -> float:
    """The number rounded to three significant digits."""
    return float(f"{value:.3g}")


@dataclass(frozen=True)
class DrawnScene:
    """A random scene.

    Attributes:
        family: name of the family that it is drawn from.
        features: names of the features that it was asked to have.
        tables: content of its ``scene.toml``, with ``duration``, ``dt`` and ``every`` [s].
    """

    family: str
    features: tuple[str, ...]
    tables: Mapping[str, Any]


@dataclass(frozen=True)
class Relation:
    """A scene that has to move as another one does.

    Attributes:
        change: makes it of the other one, whose trajectory is its second argument; raises LookupError where there is
            no such scene.
        back: trajectory of the changed scene, and tables of the other one -> values by name, as the other one has them.
    """

    change: Callable[[dict[str, Any], Mapping[Any, Any]], object]
    back: Callable[[Mapping[Any, Any], Mapping[str, Any]], Mapping[str, Any]]


@dataclass(frozen=True)
class SceneFamily:
    """Scenes of one structure.

    Attributes:
        features: name of a feature that a scene may have -> probability that a scene has it unasked.
        draw: tables of a scene with some features, from choices.
        capabilities: names of all capabilities of its kind of element; a feature of such a name needs it.
        needs: capabilities; every scene needs at least one.
        smaller: changes that each make a scene simpler, the boldest first.
        close: makes lengths that follow from others fit again; its second argument is the scene before a change.
        nearest: changes of one thing in a scene, each with its words; no words: what differs tells it.
        relations: name -> a scene that has to move alike, see :class:`Relation`.
    """

    features: Mapping[str, float]
    draw: Callable[[Choices, Sequence[str]], Mapping[str, Any]]
    capabilities: frozenset[str] = frozenset()
    needs: frozenset[str] = frozenset()
    smaller: Callable[[Mapping[str, Any]], Iterable[Change]] = lambda _: ()
    close: Callable[[dict[str, Any], Mapping[str, Any]], object] = lambda *_: None
    nearest: Callable[[Mapping[str, Any]], Iterable[tuple[str, Change]]] = lambda _: ()
    relations: Mapping[str, Relation] = field(default_factory=dict)

    def within(self, provided: Collection[str]) -> SceneFamily:
        """The family without features that need a capability beside those that are provided."""
        lacking = self.capabilities - set(provided)
        return replace(self, features={name: weight for name, weight in self.features.items() if name not in lacking})

    @cached_property
    def pairs(self) -> list[tuple[str, ...]]:
        """All pairs of features, in an order in which neighbours have little in common."""
        pairs: list[tuple[str, ...]] = list(combinations(sorted(self.features), 2))
        random.Random(0).shuffle(pairs)
        return pairs


def drawn_scene(families: Mapping[str, SceneFamily], seed: int) -> DrawnScene:
    """Scene of a seed: families in turn, within each every pair of features in turn, the rest by chance.

    Args:
        families: name -> family, at least one.
        seed: not negative; consecutive seeds cover all pairs of features evenly.
    """
    names = sorted(families)
    name, turn = names[seed % len(names)], seed // len(names)
    family, choices = families[name], Choices(seed)
    pairs = family.pairs or [tuple(family.features)]
    features = dict.fromkeys(pairs[turn % len(pairs)])
    features |= {feature: None for feature, weight in sorted(family.features.items()) if choices.happens(weight)}
    return DrawnScene(name, tuple(features), family.draw(choices, tuple(features)))


def all_families() -> dict[str, SceneFamily]:
    """Name -> family of random scenes, of all installed packages that announce some.

    Such a package has an entry point of the group ``proofroll.scene_families``, under any name, which names a mapping
    from names to :class:`SceneFamily`. Each scene must be valid, and sampled well within its natural time.
    """
    return {name: family for _, families in loaded(GROUP, of=Mapping) for name, family in families.items()}
