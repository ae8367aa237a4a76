"""Hook of the law check: the path of the published route up to the first violation of a law, and works of drives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from proofroll.core.errors import Refused
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.modes import ContactMode
from proofroll.elements.mechanism.dynamics.link_forces import working
from proofroll.truth.bodies.contact_bodies import ContactBodies
from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates
from proofroll.truth.check.law_records import LawRecorder
from proofroll.truth.check.law_states import by_the_bodies, by_the_tree
from proofroll.truth.check.laws.law_check import LawCheck
from proofroll.truth.check.laws.record import Pieces, joined_pieces
from proofroll.truth.check.laws.residuals import LawResiduals
from proofroll.truth.check.laws.tiles import Tiles, joined_tiles
from proofroll.truth.followed_paths import CLOSE
from proofroll.truth.natural_units import Units
from proofroll.truth.numerics.hybrid import HybridPath, Stretch, first_close
from proofroll.truth.switching.held_route import HeldPath
from proofroll.truth.tree.contact_tree import ContactTree
from proofroll.truth.work_of_drives import WorkAlong

_Path = HybridPath[Stretch[ContactMode]]


class Recorded(NamedTuple):
    """A route whose path is held to the laws.

    Attributes:
        name: for a person.
        recorder: of its statements.
        path: in natural units.
        held: held values along it; None: there are none.
    """

    name: str
    recorder: LawRecorder
    path: _Path
    held: HeldPath | None = None


def of_tree(
    mechanism: Mechanism,
    units: Units,
    tree: ContactTree,
    path: _Path,
    held_path: HeldPath | None = None,
) -> Recorded:
    """A path of the first route; ``mechanism`` in SI units."""
    recorder = LawRecorder(mechanism, units, tree, partial(by_the_tree, tree))
    return Recorded("joint coordinates", recorder, path, held_path)


def of_bodies(
    mechanism: Mechanism,
    units: Units,
    bodies: ContactBodies,
    second: MaximalCoordinates,
    path: _Path,
    held_path: HeldPath | None = None,
) -> Recorded:
    """A path of the second route; ``second``: its equations of all joints."""
    recorder = LawRecorder(mechanism, units, bodies, partial(by_the_bodies, bodies, second))
    return Recorded("bodies", recorder, path, held_path)


class HeldMotion(NamedTuple):
    """Outcome of the law check.

    Attributes:
        end: time of the first violation of a law, in natural units; inf: there is none.
        text: its reason.
        laws: sentence of the outcome; empty after a violation.
        works: work of drives along each route.
        pieces: of the first route, by the numbers of its stretches.
    """

    end: float
    text: str
    laws: str
    works: list[WorkAlong]
    pieces: Mapping[int, Sequence[Pieces]]


def held_to_laws(mechanism: Mechanism, units: Units, routes: Sequence[Recorded]) -> HeldMotion:
    """Outcome of the law check of the first route, which is published; what another one misses is in the bars.

    Args:
        mechanism: in SI units.
        units: natural units of the routes and paths.
        routes: all.

    Raises:
        Refused: a law is violated from the start.
    """
    # beyond an early end of one path the other may be on another branch, and beyond a close decision all is open
    paths = [route.path for route in routes]
    early = min((path.stretches[-1].end for path in paths if not path.known), default=np.inf)
    walks = [_Walk(mechanism, units, route) for route in routes]
    residuals = walks[0].through(min(early, first_close(paths, CLOSE)) * (1 - CLOSE))
    for walk in walks[1:]:
        walk.through(0.0)
    works, pieces = [walk.work for walk in walks], walks[0].taken
    text = residuals.broken("the motion that was followed")
    if residuals.first is None:
        return HeldMotion(end=np.inf, text="", laws=residuals.held(), works=works, pieces=pieces)
    if residuals.first.time <= CLOSE * units.time:  # a first piece begins at 0 but for round-off
        raise Refused(text)
    return HeldMotion(end=residuals.first.time / units.time, text=text, laws="", works=works, pieces=pieces)


def tiles_of(route: Recorded, until: float, taken: Mapping[int, Sequence[Pieces]] | None = None) -> Tiles | None:
    """Poses and velocities in all pieces of a route that begin before a time in natural units; None: there are none.

    ``taken``: pieces of its stretches that are known, by their numbers.
    """
    parts = list[Tiles]()
    for number, stretch in enumerate(route.path.stretches):
        if stretch.start >= until and number:
            break
        if route.held is not None:
            route.held.recall(stretch.start)
        part = route.recorder.tiles(number, stretch, (taken or {}).get(number))
        parts += [] if part is None else [part]
    borders = np.array([stretch.start for stretch in route.path.stretches[1:]]) * route.recorder.second
    return replace(joined_tiles(parts), borders=borders) if parts else None


def work_along(mechanism: Mechanism, units: Units, tree: ContactTree, path: _Path) -> WorkAlong:
    """Work of drives along another path of the first route; ``mechanism`` in SI units."""
    walk = _Walk(mechanism, units, of_tree(mechanism, units, tree, path))
    walk.through(0.0)
    return walk.work


class _Walk:
    """Takes the record of one route along its path.

    Attributes:
        work: of drives so far.
        taken: pieces so far, by the numbers of their stretches.
    """

    def __init__(self, mechanism: Mechanism, units: Units, route: Recorded) -> None:
        self._recorder, self._path, self._held = route.recorder, route.path, route.held
        self._check = LawCheck(mechanism, units.length, 1 / units.time)
        self.work, self._working = WorkAlong(mechanism, units.length, 1 / units.time), bool(working(mechanism))
        resisted = any(pair.rolling_resistance or pair.spinning_friction for pair in mechanism.pairs)
        self._numeric = self._working or resisted
        self.taken = dict[int, list[Pieces]]()
        self._waiting = list[Pieces]()  # of stretches in one mode, which are checked together

    def through(self, end: float) -> LawResiduals:
        """Remainders of the laws along the path, whose stretches are judged up to a time in natural units.

        Forces in numbers, at a third of the cost of steps, are held at samples; here too where works ask for
        them, or contacts have moments, which no dataset has.
        """
        last_pieces: Pieces | None = None
        judged, judging = self._check.residuals, True
        for number, stretch in enumerate(self._path.stretches):
            if stretch.start >= end and judging:
                if not self._working:
                    break
                self._take_waiting()
                self._check.residuals, judging = LawResiduals(rate=judged.rate), False  # work alone goes on
            if self._held is not None:
                self._held.recall(stretch.start)
            pieces = self._recorder.pieces(stretch, numeric=self._numeric)
            self.taken[number] = pieces
            if last_pieces is not None:
                passage = self._recorder.passage(self._path, number, last_pieces, self._recorder.start(stretch, pieces))
                if passage.happens:
                    self._take_waiting()
                impulses = self._check.passes(passage)
                if self._working:
                    self.work.passes(passage, impulses)
            for part in pieces if judging else ():
                if self._waiting and (self._waiting[-1].modes, self._waiting[-1].coarse) != (part.modes, part.coarse):
                    self._take_waiting()
                self._waiting.append(part)
            if self._working:
                self.work.take(number, pieces)
            last_pieces = self._recorder.end(stretch, pieces)
        self._take_waiting()
        return judged

    def _take_waiting(self) -> None:
        if self._waiting:
            self._check.take(joined_pieces(self._waiting))
            self._waiting.clear()
