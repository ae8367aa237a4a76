"""The law check of one route: takes its record piece by piece and collects what the laws leave."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

from proofroll.truth.check.laws.contacts import contact_laws
from proofroll.truth.check.laws.joints import Coordinates, joint_laws
from proofroll.truth.check.laws.loads import BodyLoads
from proofroll.truth.check.laws.motion import energy, joined, kinematics, momenta
from proofroll.truth.check.laws.record import Passage, Pieces
from proofroll.truth.check.laws.residuals import COARSE, LAWS, LawResiduals, Violation
from proofroll.truth.check.laws.scene import LawScene
from proofroll.truth.check.laws.transitions import transition

if TYPE_CHECKING:
    from proofroll.elements.mechanism import Mechanism


class LawCheck:
    """Laws of a mechanism, to which the record of one route is held.

    Attributes:
        residuals: remainders of the laws so far.
    """

    def __init__(self, mechanism: Mechanism, length: float, rate: float) -> None:
        """Takes a mechanism in SI units with its natural length [m] and rate [1/s]."""
        self._scene, self.residuals = LawScene(mechanism, length, rate), LawResiduals(rate=rate)
        self._coordinates, self._fastest = Coordinates(self._scene), dict[str, float]()

    def take(self, pieces: Pieces) -> None:
        """Checks pieces of one stretch, in order of time."""
        residuals = self.residuals
        residuals.coarse = COARSE if pieces.coarse else 1.0
        residuals.points += pieces.time.size
        kinematics(self._scene, pieces, residuals)
        joined(self._scene, pieces, residuals)
        loads = BodyLoads(self._scene, pieces)
        axes = joint_laws(self._scene, pieces, residuals, self._coordinates, loads)
        contact_laws(self._scene, pieces, residuals, loads)
        momenta(self._scene, pieces, residuals, loads, axes)
        energy(self._scene, pieces, residuals, loads, axes)

    def passes(self, passage: Passage) -> dict[int, float]:
        """Checks the transition after the pieces that were taken last.

        Returns:
            Impulse along each driven joint, by its number, of an impact [N s, N m s]; NaN where not determinate.
        """
        self.residuals.coarse = 1.0
        self.residuals.events += 1
        return transition(self._scene, passage, self.residuals, self._coordinates, self._fastest)


class LawVerdict(NamedTuple):
    """Outcome of the check for all routes.

    Attributes:
        laws: number of laws that applied.
        points: largest number of points at which a route was held against them.
        events: number of transitions.
        largest: largest residual in parts of its allowance, its law, time [s] and part.
        violation: first violation; None: all hold.
        routes: names of the routes that break a law; if both do, the cause is in code that they share.
    """

    laws: int
    points: int
    events: int
    largest: tuple[float, str, float, str]
    violation: Violation | None
    routes: tuple[str, ...]


def verdict(checked: Mapping[str, LawResiduals]) -> LawVerdict:
    """Verdict from the residuals of each route, by its name."""
    largest = [
        (part, law, time, name)
        for residuals in checked.values()
        for law, (part, time, name) in residuals.largest.items()
    ]
    broken = {route: residuals.first for route, residuals in checked.items() if residuals.first is not None}
    violation = min(broken.values(), key=lambda item: item.time, default=None)
    return LawVerdict(
        laws=len({law for residuals in checked.values() for law in residuals.largest}),
        points=max((residuals.points for residuals in checked.values()), default=0),
        events=max((residuals.events for residuals in checked.values()), default=0),
        largest=max(largest, default=(0.0, "", 0.0, "")),
        violation=violation,
        routes=tuple(broken),
    )


def sentence(result: LawVerdict, count: int) -> str:
    """Sentence of the outcome for a person; ``count``: number of routes; empty: nothing could be held to a law."""
    if not result.points:
        return ""
    if result.violation is None:
        share, law, time, _ = result.largest
        events = f" and on both sides of {result.events} events" if result.events else ""
        routes = {1: "one route", 2: "both routes"}.get(count, f"{count} routes")
        return (
            f"holds {result.laws} laws at {result.points:,} points in {routes}{events}; "
            f"largest residual {share:.2g} of its allowance ({law}, {time:.3g} s)"
        )
    item = result.violation
    who = " and ".join(result.routes)
    whose = f"both routes ({who}) break" if len(result.routes) > 1 else f"one route ({who}) breaks"
    part = f" for {item.part}" if item.part else ""
    return (
        f'{whose} the law "{LAWS[item.law][1]}"{part} by {item.size:.2g} of its natural '
        f"size (allowed {item.allowed:.1g}): an error of proofroll; please report it"
    )
