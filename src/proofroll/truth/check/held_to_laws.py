"""Hook of the law check: paths of both routes up to the first violation of a law."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from proofroll.core.errors import Refused
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.modes import ContactMode
from proofroll.elements.mechanism.dynamics.link_forces import working
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.truth.bodies.contact_bodies import ContactBodies
from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates
from proofroll.truth.check.law_records import LawRecorder
from proofroll.truth.check.law_states import by_the_bodies, by_the_tree
from proofroll.truth.check.laws.law_check import LawCheck, LawVerdict, sentence, verdict
from proofroll.truth.check.laws.record import Pieces, joined_pieces
from proofroll.truth.check.laws.residuals import LawResiduals
from proofroll.truth.check.laws.tiles import Tiles, joined_tiles
from proofroll.truth.followed_paths import CLOSE
from proofroll.truth.natural_units import Units
from proofroll.truth.numerics.hybrid import HybridPath, Stretch, first_close
from proofroll.truth.switching.held_route import HeldPath
from proofroll.truth.tree.contact_tree import ContactTree
from proofroll.truth.work_of_drives import WorkAlong

# Pieces of a stretch whose forces are found in numbers, at a third of the cost of its steps. Some suffice to see a
# violation: after one a motion does not come right again.
_MOST = 3

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
    turns_at: Callable[[Array], Array] | None = None,
    name: str = "joint coordinates",
) -> Recorded:
    """A path of the first route; ``mechanism`` in SI units, ``turns_at``: see :class:`LawRecorder`."""
    return Recorded(name, LawRecorder(mechanism, units, tree, partial(by_the_tree, tree), turns_at), path, held_path)


def of_bodies(
    mechanism: Mechanism,
    units: Units,
    bodies: ContactBodies,
    second: MaximalCoordinates,
    path: _Path,
    held_path: HeldPath | None = None,
    turns_at: Callable[[Array], Array] | None = None,
) -> Recorded:
    """A path of the second route; ``second``: its equations of all joints."""
    recorder = LawRecorder(mechanism, units, bodies, partial(by_the_bodies, bodies, second), turns_at)
    return Recorded("bodies", recorder, path, held_path)


class HeldMotion(NamedTuple):
    """Outcome of the law check.

    Attributes:
        end: time of the first violation of a law, in natural units; inf: there is none.
        text: its reason.
        laws: sentence of the outcome; empty after a violation.
        works: work of drives along each route.
        tiles: of each route, by its place among them: poses and velocities at all times before one in natural units.
    """

    end: float
    text: str
    laws: str
    works: list[WorkAlong]
    tiles: Callable[[int, float], Tiles | None]


def held_to_laws(mechanism: Mechanism, units: Units, routes: Sequence[Recorded], most: int | None = None) -> HeldMotion:
    """Outcome of the law check of all routes.

    Args:
        mechanism: in SI units.
        units: natural units of the routes and paths.
        routes: all.
        most: pieces of a stretch that are looked at where forces are found in numbers; then recorders know whole turns,
            and the work of drives is not asked for; None: as many as turns and work take.

    Raises:
        Refused: a law is violated from the start.
    """
    # beyond an early end of one path the other may be on another branch, and beyond a close decision all is open
    paths = [route.path for route in routes]
    early = min((path.stretches[-1].end for path in paths if not path.known), default=np.inf)
    end = min(early, first_close(paths, CLOSE))
    works = most is None and bool(working(mechanism))
    walks = list[_Walk]()

    def outcome(most: int | None) -> LawVerdict:
        walks[:] = [_Walk(mechanism, units, route, works) for route in routes]
        names = [route.name for route in routes]
        return verdict({name: walk.through(end * (1 - CLOSE), most) for name, walk in zip(names, walks, strict=True)})

    def tiles(number: int, until: float) -> Tiles | None:
        return walks[number].tiles(until)

    result = outcome(None if works else most or _MOST)
    if result.violation is not None and most is None and not works:
        # The first violation may lie in a piece that was left out, and a joint may have turned around meanwhile.
        result = outcome(None)
    text, alongs = sentence(result, len(routes)), [walk.work for walk in walks]
    if result.violation is None:
        return HeldMotion(end=np.inf, text="", laws=text, works=alongs, tiles=tiles)
    if not result.violation.time > 0:
        raise Refused(text)
    return HeldMotion(end=result.violation.time / units.time, text=text, laws="", works=alongs, tiles=tiles)


def work_along(mechanism: Mechanism, units: Units, tree: ContactTree, path: _Path) -> WorkAlong:
    """Work of drives along another path of the first route; ``mechanism`` in SI units."""
    walk = _Walk(mechanism, units, of_tree(mechanism, units, tree, path), bool(working(mechanism)))
    if working(mechanism):
        walk.through(0.0, None)
    return walk.work


class _Walk:
    """Takes the record of one route along its path.

    Attributes:
        work: of drives so far.
    """

    def __init__(self, mechanism: Mechanism, units: Units, route: Recorded, works: bool) -> None:
        self._recorder, self._path, self._held = route.recorder, route.path, route.held
        self._check = LawCheck(mechanism, units.length, 1 / units.time)
        self.work, self._working = WorkAlong(mechanism, units.length, 1 / units.time), works
        self._taken = dict[int, list[Pieces]]()
        self._waiting = list[Pieces]()  # of stretches in one mode, which are checked together

    def through(self, end: float, most: int | None) -> LawResiduals:
        """Remainders of the laws along the path, whose stretches are judged up to a time in natural units.

        ``most``: pieces of a stretch whose forces are found in numbers; None: all.
        """
        last_pieces: Pieces | None = None
        judged = self._check.residuals
        for number, stretch in enumerate(self._path.stretches):
            if stretch.start >= end and self._check.residuals is judged:
                if not self._working:
                    break
                self._take_waiting()
                self._check.residuals = LawResiduals(rate=judged.rate)  # behind the end work alone goes on
            if self._held is not None:
                self._held.recall(stretch.start)
            pieces = self._recorder.pieces(stretch, most)
            self._taken[number] = pieces
            if last_pieces is not None:
                passage = self._recorder.passage(self._path, number, last_pieces, self._recorder.start(stretch, pieces))
                if passage.happens:
                    self._take_waiting()
                impulses = self._check.passes(passage)
                if self._working:
                    self.work.passes(passage, impulses)
            for part in pieces:
                if self._waiting and (self._waiting[-1].modes, self._waiting[-1].coarse) != (part.modes, part.coarse):
                    self._take_waiting()
                self._waiting.append(part)
            if self._working:
                self.work.take(number, pieces)
            last_pieces = self._recorder.end(stretch, pieces)
        self._take_waiting()
        return judged

    def tiles(self, until: float) -> Tiles | None:
        """Poses and velocities in all pieces that begin before a time in natural units; None: there are none."""
        parts = list[Tiles]()
        for number, stretch in enumerate(self._path.stretches):
            if stretch.start >= until and number:
                break
            if self._held is not None:
                self._held.recall(stretch.start)
            pieces = self._taken[number] if number in self._taken else self._recorder.pieces(stretch, 0)
            part = self._recorder.tiles(number, stretch, pieces)
            parts += [] if part is None else [part]
        return joined_tiles(parts) if parts else None

    def _take_waiting(self) -> None:
        if self._waiting:
            self._check.take(joined_pieces(self._waiting))
            self._waiting.clear()
