"""The check of an answer: what a truth publishes, held against the motion that was followed and against the laws."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from proofroll.truth.check.laws.changes import changes_of
from proofroll.truth.check.laws.record import Array, PublishedValues
from proofroll.truth.check.laws.residuals import COARSE, LAWS, LawResiduals
from proofroll.truth.check.laws.samples import force_laws, kinetic_energy, on_the_motion
from proofroll.truth.check.laws.scene import LawScene
from proofroll.truth.check.laws.tiled import Turns, laws_at_all_times, start_of
from proofroll.truth.check.laws.tiles import Places, Tiles
from proofroll.truth.check.laws.values import values_follow
from proofroll.truth.check.laws.works import held_efforts, works_follow

if TYPE_CHECKING:
    from proofroll.elements.mechanism import Mechanism

_BESIDE = 1e-9  # time beside the end of a stretch, relative to it and to a second, that counts as that end
_UNCERTAIN = 4e-5  # part of the time before a horizon in which what it hangs on may happen, and is no event
_EXACT = 1e-14  # round-off of times, relative to them and to a second
_INSTANT = 1e-6  # part of an interval of a controller beside an instant, where forces are those of either side


class AnswerCheck:
    """Laws of a mechanism, to which what a truth publishes is held.

    Attributes:
        residuals: remainders of the laws.
        samples, held: numbers of samples, and of those on a piece of the motion.
        between: number of stretches in whose middle laws are held.
    """

    def __init__(self, mechanism: Mechanism, length: float, rate: float) -> None:
        """Takes a mechanism in SI units with its natural length [m] and rate [1/s]."""
        self._scene = LawScene(mechanism, length, rate)
        self.residuals, self.samples, self.held = LawResiduals(rate=rate, known_alone=True), 0, 0
        self.between = 0

    def take(
        self,
        published: PublishedValues,
        tiles: Tiles,
        asked: Array,
        end: float,
        horizon: float,
        between: PublishedValues | None = None,
    ) -> None:
        """Checks an answer.

        Args:
            published: the answer.
            tiles: the motion that was followed.
            asked: times that were asked for [s].
            end: time before which the truth ends, or inf [s].
            horizon: time from which the question is ill-posed, or inf [s]: from there on nothing is held.
            between: motion and forces in the middle of each stretch.
        """
        scene, residuals, time = self._scene, self.residuals, published.pieces.time[:, 0]
        residuals.coarse = COARSE if tiles.coarse else 1.0
        self.samples = len(time)
        self._times(time, asked, end)
        if not np.isfinite(published.pieces.p).all():  # a motion that is not unique has no values
            return
        last, sure = float(time[-1]), horizon * (1 - _BESIDE)
        if not sure > 0:
            return
        tiles = tiles.ordered(np.flatnonzero(tiles.time[:, 0] <= min(sure, max(last, tiles.time[0, 0]))))
        last = min(last, sure)
        turns = laws_at_all_times(scene, tiles, residuals, last)
        struck = any(item.jumps and item.low <= 0 for item in published.changes)
        for moving in (published.pieces, tiles):
            if moving.time[0, 0] == 0:
                start_of(scene, moving, residuals, struck)
                break
        changes_of(scene, tiles, published, residuals, min(last, horizon - _UNCERTAIN * max(1 / scene.rate, horizon)))
        reached = time.copy()
        for item in published.changes:  # within the bracket of an event a sample is that of the later side
            reached[(item.low <= time) & (time < item.time)] = item.time
        places = tiles.holding(reached)
        # of a sample at the last time where stretches meet, which is that of the later side, there is no piece
        late = (time >= tiles.time[-1, -1] - _BESIDE * (1 + time)) & self._at_borders(published.pieces.time, tiles)
        for item in published.changes:  # at an instant of an impact values are of either side
            late |= item.jumps & (item.low - _EXACT * (1 + time) <= time) & (time <= item.high + _EXACT * (1 + time))
        rows = np.flatnonzero(places.held & (time < sure) & ~late)
        self.held = len(rows)
        if rows.size:
            published, places = self._of(published, turns, places, rows)
            works_follow(scene, tiles, turns, places, published, residuals)
            values_follow(scene, published, residuals, kinetic_energy(scene, published.pieces))
            self._forces(published, tiles, places)
        if between is not None:
            time = between.pieces.time[:, 0]
            places = tiles.holding(time)
            apart = ~self._at_borders(between.pieces.time, tiles)
            rows = np.flatnonzero(places.held & (time < min(sure, end * (1 - _BESIDE))) & apart)
            self.between = len(rows)
            if rows.size:
                between, places = self._of(between, turns, places, rows)
                held_efforts(scene, tiles, turns, places, between, residuals)
                self._forces(between, tiles, places)

    def _of(
        self, published: PublishedValues, turns: Turns, places: Places, rows: NDArray[np.intp]
    ) -> tuple[PublishedValues, Places]:
        """Some samples with their whole turns, and their places."""
        published, places = published.of(rows), places.of(rows)
        return replace(published, pieces=replace(published.pieces, turns=self._turns(turns, places))), places

    def _forces(self, published: PublishedValues, tiles: Tiles, places: Places) -> None:
        """Checks that samples at places are on the motion, and their forces where these do not jump."""
        scene, residuals = self._scene, self.residuals
        on_the_motion(scene, tiles, places, published, residuals)
        modes = [tiles.modes[tile] for tile in places.tile]
        between = ~(
            self._at_instants(published.pieces.time[:, 0]) | self._at_borders(published.pieces.time, tiles, kinks=True)
        )
        for mode in dict.fromkeys(modes):
            chosen = np.flatnonzero(np.array([item == mode for item in modes]) & between)
            if chosen.size:
                part = published.of(chosen)
                part = replace(part, pieces=replace(part.pieces, modes=mode))
                force_laws(scene, tiles, places.of(chosen), part, residuals)

    def sentence(self) -> str:
        """Clause on the samples that hold all laws."""
        laws = sum(law in self.residuals.largest for law in LAWS)
        middles = f" and in the middle of {self.between} stretches" if self.between else ""
        return f"what is published holds {laws} laws at {self.held} of {self.samples} samples{middles}"

    def _times(self, time: Array, asked: Array, end: float) -> None:
        """Samples are those that were asked for, and none before the end is missing."""
        residuals, count = self.residuals, min(len(time), len(asked))
        due = int(np.sum(asked < end * (1 - _INSTANT))) if np.isfinite(end) else len(asked)
        off = np.abs(time[:count] - asked[:count]) / (1 + np.abs(asked[:count]))
        residuals.note("times", "", off[:, None], 1.0, time[:count, None])
        if len(time) < due or len(time) > len(asked):
            residuals.note("times", "a sample", np.ones((1, 1)), 1.0, time[-1:, None])

    def _turns(self, turns: Turns, places: Places) -> Array:
        """Coordinates at the samples for their whole turns, (samples, 1, joints, 2)."""
        values = np.zeros((len(places.tile), 1, len(self._scene.mechanism.joints), 2))
        for (number, k), coordinates in turns.items():
            values[:, 0, number, k] = places.at(coordinates)
        return values

    def _at_borders(self, time: Array, tiles: Tiles, *, kinks: bool = False) -> NDArray[np.bool_]:
        """True where stretches meet, where forces are of either side; ``kinks``: of a scene with kinks at both ends."""
        ends = tiles.borders
        if kinks and self._scene.mechanism.kinks:
            ends = np.append(ends, [tiles.time[0, 0], tiles.time[-1, -1]])
        return np.asarray((np.abs(time - ends) <= _BESIDE * (1 + np.abs(ends))).any(1))

    def _at_instants(self, time: Array) -> NDArray[np.bool_]:
        """True at instants of a controller, where forces are those of either side."""
        control = self._scene.mechanism.control
        if control is None:
            return np.zeros(len(time), dtype=bool)
        return np.asarray(np.abs(time * control.rate - np.round(time * control.rate)) < _INSTANT)
