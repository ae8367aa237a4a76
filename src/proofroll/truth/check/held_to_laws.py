"""Hook of the law check: transitions of the route that is published, up to the first violation; works of drives."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from proofroll.core.errors import Refused
from proofroll.core.pace import PACE, OutOfTime
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.modes import ContactMode
from proofroll.elements.mechanism.dynamics.link_forces import working
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.truth.bodies.contact_bodies import ContactBodies
from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates
from proofroll.truth.check.law_records import LawRecorder
from proofroll.truth.check.laws.residuals import LawResiduals
from proofroll.truth.check.laws.scene import LawScene
from proofroll.truth.check.laws.tiles import Tiles, joined_tiles
from proofroll.truth.check.laws.transitions import transition
from proofroll.truth.followed_paths import CLOSE
from proofroll.truth.natural_units import Units
from proofroll.truth.numerics.hybrid import HybridPath, Stretch, first_close
from proofroll.truth.switching.held_route import HeldPath
from proofroll.truth.tree.contact_tree import ContactTree
from proofroll.truth.work_of_drives import WorkAlong

_Path = HybridPath[Stretch[ContactMode]]


def of_tree(
    mechanism: Mechanism, units: Units, tree: ContactTree, path: _Path, held_path: HeldPath | None = None
) -> LawRecorder:
    """A path of the first route; ``mechanism`` in SI units."""
    dynamics = tree.dynamics

    def named_at(states: Array, modes: Iterable[ContactMode]) -> Array:
        parts = ((*dynamics.parts(state), mode) for state, mode in zip(states, modes, strict=True))
        named = [dynamics.sample(q, v, mode, time)[0]["named"] for q, v, time, mode in parts]
        return np.asarray(np.nan_to_num(named))  # what is not determinate does no work

    return LawRecorder(mechanism, units, tree, path, held_path, named_at)


def of_bodies(
    mechanism: Mechanism,
    units: Units,
    bodies: ContactBodies,
    second: MaximalCoordinates,
    path: _Path,
    held_path: HeldPath | None = None,
) -> LawRecorder:
    """A path of the second route; ``second``: its equations of all joints."""

    def named_at(states: Array, modes: Iterable[ContactMode]) -> Array:
        return bodies.recorded(second, states[:, -1], states, modes)[0].named

    return LawRecorder(mechanism, units, bodies, path, held_path, named_at)


class HeldMotion(NamedTuple):
    """Outcome of the law check.

    Attributes:
        end: time of the first violation of a law, or up to which the limit of a truth lets routes be held to them, in
            natural units; inf: there is none.
        text: its reason.
        laws: sentence of the outcome; empty after a violation, and where there are no transitions.
        works: work of drives along each route.
        tiles: of the first route.
    """

    end: float
    text: str
    laws: str
    works: list[WorkAlong]
    tiles: Tiles | None


def held_to_laws(mechanism: Mechanism, units: Units, routes: Sequence[LawRecorder]) -> HeldMotion:
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
    try:
        PACE.follow("laws", np.inf)
        parts = walks[0].through(min(early, first_close(paths, CLOSE)) * (1 - CLOSE))
        for walk in walks[1:] if working(mechanism) else ():
            walk.through(0.0)
    finally:
        PACE.leave()
    works, residuals, tiles = [walk.work for walk in walks], walks[0].residuals, _joined(parts, routes[0])
    tiles = None if tiles is None else replace(tiles, impulses=tuple(walks[0].impulses))
    text, reached = residuals.broken("the motion that was followed"), min(walk.reached for walk in walks)
    if residuals.first is None:
        text = "" if np.isinf(reached) else PACE.reason
        return HeldMotion(end=reached, text=text, laws=residuals.held(), works=works, tiles=tiles)
    if residuals.first.time <= CLOSE * units.time:
        raise Refused(text)
    return HeldMotion(end=residuals.first.time / units.time, text=text, laws="", works=works, tiles=tiles)


def tiles_of(route: LawRecorder, until: float) -> Tiles | None:
    """Poses and velocities in all pieces of a route that begin before a time in natural units; None: there are none."""
    count = sum(stretch.start < until for stretch in route.path.stretches) or 1
    return _joined([route.tiles(number) for number in range(count)], route)


def _joined(parts: Sequence[Tiles | None], route: LawRecorder) -> Tiles | None:
    """Tiles of all stretches of a route; None: there are none."""
    tiles = [part for part in parts if part is not None]
    borders = np.array([stretch.start for stretch in route.path.stretches[1:]]) * route.second
    return replace(joined_tiles(tiles), borders=borders) if tiles else None


def work_along(mechanism: Mechanism, units: Units, tree: ContactTree, path: _Path) -> WorkAlong:
    """Work of drives along another path of the first route; ``mechanism`` in SI units."""
    walk = _Walk(mechanism, units, of_tree(mechanism, units, tree, path))
    if working(mechanism):
        walk.through(0.0)
    return walk.work


class _Walk:
    """Takes the record of one route along its path.

    Attributes:
        residuals: remainders of the laws of transitions.
        work: of drives.
        impulses: time of each impact that driven joints take a part of [s], and the impulses along these.
        reached: start of the first stretch that the limit of a truth leaves out, in natural units; inf: there is none.
    """

    def __init__(self, mechanism: Mechanism, units: Units, route: LawRecorder) -> None:
        self._route, scale = route, (units.length, 1 / units.time)
        self._scene, self.residuals = LawScene(mechanism, *scale), LawResiduals(rate=scale[1])
        self.work, self._working = WorkAlong(mechanism, *scale), bool(working(mechanism))
        self.impulses, self.reached = list[tuple[float, dict[int, float]]](), np.inf

    def through(self, end: float) -> list[Tiles | None]:
        """Tiles of all stretches; transitions are judged up to a time in natural units."""
        parts, ending, route = list[Tiles | None](), None, self._route
        fastest, unjudged = dict[str, float](), LawResiduals(rate=self.residuals.rate)
        for number, stretch in enumerate(route.path.stretches):
            try:
                if number:
                    PACE.reached(stretch.start)
            except OutOfTime:
                self.reached = stretch.start
                break
            if route.held is not None:
                route.held.recall(stretch.start)
            if ending is not None:
                residuals = self.residuals if stretch.start < end else unjudged
                passage = route.passage(number, ending)
                if pulses := transition(self._scene, passage, residuals, fastest):
                    self.impulses.append((stretch.start * route.second, pulses))
                self.work.passes(passage, pulses)
            parts.append(route.tiles(number, drives=self._working))
            if self._working and (part := parts[-1]) is not None:
                self.work.take(part)
            goes_on = stretch is not route.path.stretches[-1] and (stretch.end < end or self._working)
            ending = route.ending(number) if goes_on else None
        return parts
