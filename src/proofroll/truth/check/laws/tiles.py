"""Tiles: poses and velocities of a route in all pieces of its motion, and the laws that need no forces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from proofroll.truth.check.laws.integrals import COUNT, TO_SERIES
from proofroll.truth.check.laws.record import SPREAD, Array, BodyPoses, Modes

_CORRECTIONS = 6  # of Newton's method for the place of a time in a tile, at most: it converges in three
_OUTSIDE = 1.05  # place beyond the end of a tile, in which a time within the bracket of an event may lie
_LATER = 1e-9  # part of a time by which a tile may begin after it and still hold it: what changes at an instant
_ARRAYS = ("time", "pace", "p", "R", "v", "w", "stretch", "resolved")
# Series of a derivative from that of its function.
_DERIVATIVE: Array = np.vstack([chebyshev.chebder(np.eye(COUNT)), np.zeros(COUNT)])


@dataclass(frozen=True, kw_only=True)
class Tiles(BodyPoses):
    """Poses and velocities in all pieces of a motion, in order of time.

    Attributes:
        stretch: number of the stretch of each tile.
        modes: in each tile.
        borders: times at which stretches meet, those without a tile included [s].
        resolved: False of a tile in which no polynomial follows the states, as in the last instants of a slip.
        drives: forces whose work is a result [N, N m], (tiles, points, drives); without any where none was asked for.
        impulses: time of each impact [s], and impulses along driven joints by their numbers [N s, N m s].
    """

    stretch: NDArray[np.intp]
    modes: tuple[Modes, ...]
    resolved: NDArray[np.bool_]
    borders: Array = field(default_factory=lambda: np.zeros(0))
    drives: Array = field(default_factory=lambda: np.zeros(0))
    impulses: tuple[tuple[float, Mapping[int, float]], ...] = ()

    def ordered(self, order: NDArray[np.intp]) -> Tiles:
        """Tiles in another order, or some of them."""
        arrays: dict[str, Any] = {name: getattr(self, name)[order] for name in _ARRAYS}
        return replace(self, **arrays, modes=tuple(self.modes[k] for k in order))

    def of_contacts(self, parts: Sequence[Sequence[int]]) -> Tiles:
        """The same with contacts that stand for several of these each, by their numbers."""

        def folded(modes: Modes) -> Modes:
            kinds = [[modes.contacts[k] for k in part] for part in parts]
            contacts = [kind[0] if len(kind) == 1 else SPREAD if set(kind) - {"open"} else "open" for kind in kinds]
            turning = (tuple(of[part[0]] for part in parts) for of in (modes.rolling, modes.spinning))
            rolling, spinning = turning
            return modes._replace(contacts=tuple(contacts), rolling=rolling, spinning=spinning)

        merged: dict[Modes, Modes] = {}
        return replace(self, modes=tuple(merged.setdefault(item, folded(item)) for item in self.modes))

    def holding(self, times: Array) -> Places:
        """Places of times [s] in the tiles that hold them; of two that meet there the later."""
        begins, spans = self.time[:, 0], self.time[:, -1] - self.time[:, 0]
        now, later = (
            np.clip(np.searchsorted(begins, times * (1 + part), side="right") - 1, 0, len(begins) - 1)
            for part in (0.0, _LATER)
        )
        tile = np.where(begins[later] - times <= (_OUTSIDE - 1) / 2 * spans[later], later, now)
        room = _LATER * (1 + np.abs(times))
        inside = self.resolved[tile] & (times >= begins[tile] - room) & (times <= self.time[tile, -1] + room)
        series = self.time[tile] @ TO_SERIES.T
        span = spans[tile]
        place = np.divide(2 * (times - begins[tile]), span, out=np.zeros_like(times), where=span > 0) - 1
        for _ in range(_CORRECTIONS):
            powers = _vandermonde(np.clip(place, -_OUTSIDE, _OUTSIDE))
            off, rate = _each(powers, series) - times, _each(powers @ _DERIVATIVE, series)
            place = np.clip(place - np.divide(off, rate, out=np.zeros_like(off), where=rate != 0), -_OUTSIDE, _OUTSIDE)
        values, slopes = (_vandermonde(place) @ TO_SERIES, _vandermonde(place) @ _DERIVATIVE @ TO_SERIES)
        pace = _each(values, self.pace[tile])
        return Places(tile=tile, held=inside, values=values, slopes=slopes, pace=pace, half=span / 2)


class Places(NamedTuple):
    """Times in tiles.

    Attributes:
        tile: number of the tile of each time.
        held: True where a tile holds the time.
        values, slopes: weights of the points of its tile for a value and for its slope, (times, points).
        pace: rate of the time by the variable of its tile [s].
        half: half the length of its tile [s].
    """

    tile: NDArray[np.intp]
    held: NDArray[np.bool_]
    values: Array
    slopes: Array
    pace: Array
    half: Array

    def of(self, chosen: NDArray[np.intp]) -> Places:
        """Places of some of the times."""
        parts: dict[str, Any] = {name: part[chosen] for name, part in self._asdict().items()}
        return Places(**parts)

    def at(self, of_tiles: Array) -> Array:
        """Values at the times, (times, …), from those at the points of tiles."""
        return np.asarray(np.einsum("nk,nk...->n...", self.values, of_tiles[self.tile]))

    def rate(self, of_tiles: Array) -> Array:
        """Rates in time at the times, (times, …)."""
        slope = np.einsum("nk,nk...->n...", self.slopes, of_tiles[self.tile])
        return np.asarray(slope / self.pace.reshape(-1, *(1,) * (slope.ndim - 1)))


def _vandermonde(places: Array) -> Array:
    return np.asarray(chebyshev.chebvander(places, COUNT - 1))


def _each(powers: Array, series: Array) -> Array:
    return np.asarray(np.einsum("nk,nk->n", powers, series))


def joined_tiles(parts: Sequence[Tiles]) -> Tiles:
    """Tiles of all parts, in order of time."""
    arrays: dict[str, Any] = {name: np.concatenate([getattr(part, name) for part in parts]) for name in _ARRAYS}
    modes, coarse = (mode for part in parts for mode in part.modes), any(part.coarse for part in parts)
    whole = Tiles(**arrays, modes=tuple(modes), coarse=coarse)
    return whole.ordered(np.lexsort((whole.time[:, 0], whole.stretch)))
