"""Hook of the law check: paths of both routes up to the first violation of a law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from proofroll.core.errors import Refused
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.acting import ContactMode
from proofroll.truth.bodies.contact_bodies import ContactBodies
from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates
from proofroll.truth.followed_paths import CLOSE
from proofroll.truth.law_records import LawRecorder
from proofroll.truth.law_states import by_the_bodies, by_the_tree
from proofroll.truth.laws.check import LawCheck, LawVerdict, sentence, verdict
from proofroll.truth.laws.record import Pieces, joined_pieces
from proofroll.truth.laws.residuals import LawResiduals
from proofroll.truth.natural_units import Units
from proofroll.truth.numerics.hybrid import HybridPath, Stretch, first_close
from proofroll.truth.switching.held_route import HeldPath
from proofroll.truth.tree.contact_tree import ContactTree

# Pieces of a stretch whose forces are found in numbers, at a third of the cost of its steps. Some suffice to see a
# violation: after one a motion does not come right again.
_MOST = 3

_Path = HybridPath[Stretch[ContactMode]]


def held_to_laws(
    mechanism: Mechanism,
    units: Units,
    routes: tuple[ContactTree, ContactBodies],
    paths: tuple[_Path, _Path],
    second: MaximalCoordinates,
    held: Sequence[HeldPath],
) -> tuple[tuple[_Path, _Path], str]:
    """Paths up to the first violation of a law by either, and the outcome of the check; empty after a violation.

    Args:
        mechanism: in SI units.
        units: natural units of the routes and paths.
        routes: both.
        paths: of both.
        second: equations of all joints of the second route.
        held: held values of both; empty: there are none.

    Raises:
        Refused: a law is violated from the start.
    """
    tree, bodies = routes
    recorders = {
        "joint coordinates": LawRecorder(mechanism, units, tree, partial(by_the_tree, tree)),
        "bodies": LawRecorder(mechanism, units, bodies, partial(by_the_bodies, bodies, second)),
    }
    # beyond an early end of one path the other may be on another branch, and beyond a close decision all is open
    early = min((path.stretches[-1].end for path in paths if not path.known), default=np.inf)
    end = min(early, first_close(paths, CLOSE))
    values: Sequence[HeldPath | None] = held or (None, None)

    def outcome(most: int | None) -> LawVerdict:
        checked = {}
        for (name, recorder), path, value in zip(recorders.items(), paths, values, strict=True):
            check = LawCheck(mechanism, units.length, 1 / units.time)
            checked[name] = _checked(check, recorder, path, end * (1 - CLOSE), value, most)
        return verdict(checked)

    result = outcome(_MOST)
    if result.violation is not None:
        # The first violation may lie in a piece that was left out, and a joint may have turned around meanwhile.
        result = outcome(None)
    if result.violation is None:
        return paths, sentence(result, len(recorders))
    text = sentence(result, len(recorders))
    if not result.violation.time > 0:
        raise Refused(text)
    cut = result.violation.time / units.time
    return (_cut(paths[0], cut, text), _cut(paths[1], cut, text)), ""


def _checked(
    check: LawCheck, recorder: LawRecorder, path: _Path, end: float, held: HeldPath | None, most: int | None
) -> LawResiduals:
    """Remainders of the laws along one path, whose stretches are judged up to a time.

    ``most``: pieces of a stretch whose forces are found in numbers; None: all.
    """
    before: Pieces | None = None
    waiting = list[Pieces]()  # of stretches in one mode, which are checked together

    def check_waiting() -> None:
        if waiting:
            check.take(joined_pieces(waiting))
            waiting.clear()

    for number, stretch in enumerate(path.stretches):
        if stretch.start >= end:
            break
        if held is not None:
            held.recall(stretch.start)
        pieces = recorder.pieces(stretch, most)
        if before is not None:
            passage = recorder.passage(path, number, before, recorder.start(stretch, pieces))
            if passage.happens:
                check_waiting()
            check.passes(passage)
        for part in pieces:
            if waiting and (waiting[-1].modes, waiting[-1].coarse) != (part.modes, part.coarse):
                check_waiting()
            waiting.append(part)
        before = recorder.end(stretch, pieces)
    check_waiting()
    return check.residuals


def _cut(path: _Path, end: float, text: str) -> _Path:
    """Path up to a time, and the reason why it ends there."""
    kept = [stretch for stretch in path.stretches if stretch.start < end]
    last = kept[-1]
    if last.end > end:
        kept[-1] = replace(last, end=end, guard=None)
    return replace(
        path,
        stretches=tuple(kept),
        happenings=tuple(item for item in path.happenings if item.time < end),
        margins=tuple(item for item in path.margins if item[0] < end),
        known=False,
        ended=text,
        transitions=path.transitions[: len(kept)],
    )
