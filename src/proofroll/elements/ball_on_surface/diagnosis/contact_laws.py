"""Hypotheses of another law of rolling resistance or friction than the scene's."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray, known_difference
from proofroll.core.diagnosis import Cause, Evidence, Hypothesis, hypothesis
from proofroll.core.diagnosis.samples import run_and_truth
from proofroll.core.events import EventKind, events_of
from proofroll.elements.ball_on_surface.diagnosis.equations import (
    COVERED,
    Law,
    has_resistance,
    is_bounded,
    residuals_of,
)
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.mechanism.run.contacts.on_wall import resistance_moment

_ANGLES = 90
_FEWEST = 5
# Slip or friction must turn by this angle [rad] to show the shape of a friction cone. At an edge of a pyramid the slip
# keeps its direction while the friction alternates between two faces. A fitted face comes near any short arc of slip:
# an elliptic cone that lags left a fiftieth, so that a pyramid must leave less than a hundredth.
_PYRAMID = 1 / 100
_TURNS = 0.4


def other_law(
    name: str, says: str, law: Callable[[RollingBall], Law], remedy: str, applies: Callable[[RollingBall], bool]
) -> Hypothesis:
    """Hypothesis that the contact has another law than the scene's, without any fitted number.

    ``law``: of a ball; ``applies``: True for balls whose scene can show the difference.
    """

    @hypothesis(name, "the other law gives the accelerations and forces at every sample, with no number fitted")
    def test(evidence: Evidence) -> Iterator[Cause]:
        body = evidence.element.rolling
        if applies(body):
            for residuals in residuals_of(evidence):
                yield residuals.cause(name, says, law(body), remedy, 0)

    return test


@hypothesis(
    "static friction", "up to the first slip the path is the true one, so the friction that it needs then is the bound"
)
def starts_to_slip(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: the ball begins to slip at the kinetic friction, not at the static one."""
    run, truth, contact = evidence.run, evidence.truth, evidence.element.contact
    if run is None or truth is None or not np.isfinite(contact.mu_static) or "sticking" not in truth:
        return
    slip_time, true = (
        next((event.time for event in events_of(data) if event.kind == EventKind.SLIP), float(data["time"][-1]))
        for data in (run, truth)
    )
    if contact.mu_kinetic >= contact.mu_static or slip_time == true:
        return
    time, needed = truth["time"].to_numpy(), truth["needed_friction"].to_numpy()
    held = (time <= true) & (truth["sticking"].to_numpy() > 0) & np.isfinite(needed)
    above = np.flatnonzero(held & (needed >= contact.mu_kinetic))
    if not len(above) or above[0] == 0:
        return
    i = int(above[0])
    share = (contact.mu_kinetic - needed[i - 1]) / (needed[i] - needed[i - 1])
    crossing = float(time[i - 1] + share * (time[i] - time[i - 1]))
    both = f"the kinetic friction {contact.mu_kinetic:g}, not at the static {contact.mu_static:g}"
    says = f"the ball begins to slip at {both}"
    remedy = "the ball sticks up to the static friction, and only slips at the kinetic one"
    difference, remainder = abs(slip_time - true), abs(slip_time - crossing)
    yield Cause(
        id="static friction",
        says=says,
        quantity="first slip",
        unit="s",
        before=difference,
        after=remainder,
        remedy=remedy,
        fitted=0,
        covers=("motion", "force"),
    )


@hypothesis(
    "pyramidal cone",
    "while it slips, the reported friction is that of a cone of four faces at one angle, sample by sample",
)
def pyramidal_cone(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: the friction cone is a pyramid, so that friction depends on the direction of the slip."""
    pair, body = run_and_truth(evidence), evidence.element.rolling
    if pair is None or "sticking" not in pair[0] or "N" not in pair[0] or not is_bounded(body):
        return
    run = pair[0]
    slips = run["sticking"].to_numpy() == 0
    slip = np.stack([run[name].to_numpy()[slips] for name in ("slip2", "slip3")], axis=-1)
    reported, true = (np.stack([of[name].to_numpy()[slips] for name in ("F2", "F3")], axis=-1) for of in pair)
    most = body.contact.mu_kinetic * run["N"].to_numpy()[slips][:, None]
    sizes = np.linalg.norm(slip, axis=-1, keepdims=True)
    if len(slip) < _FEWEST or not np.all(sizes > 0) or not np.all(np.isfinite(reported)):
        return
    if max(np.ptp(np.unwrap(np.arctan2(of[:, 1], of[:, 0]))) for of in (slip, reported)) < _TURNS:
        return
    difference, least = known_difference(reported, -most * slip / sizes), _PYRAMID * float(np.max(np.abs(most)))
    if not difference > least or known_difference(reported, true) <= least:
        return  # friction as the law has it, or the true one against a slip that is wrong
    remainder = np.inf
    for angle in np.arange(_ANGLES) * np.pi / 2 / _ANGLES:
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        components = slip @ turn
        corner = np.abs(components) == np.max(np.abs(components), axis=-1, keepdims=True)
        for kind in (corner, 1.0):
            remainder = min(remainder, known_difference(reported, -most * (np.sign(components) * kind) @ turn.T))
    says = "the friction cone is a pyramid: the friction depends on the direction of the slip"
    remedy = "choose an elliptic (quadratic) cone"
    covered = ("motion", *COVERED)
    yield Cause(
        id="pyramidal cone",
        says=says,
        quantity="friction while slipping",
        unit="N",
        before=difference,
        after=remainder,
        remedy=remedy,
        fitted=1,
        covers=covered,
        closes=_PYRAMID,
    )


def _along_spin(body: RollingBall) -> Law:
    def moment(ball: RollingBall, N: float, w: FloatArray) -> FloatArray:
        return -ball.contact.rolling_resistance * N * w / (float(np.linalg.norm(w)) or 1.0)

    return Law(body, resisting=moment)


def _by_weight(body: RollingBall) -> Law:
    weight = body.ball.mass * float(np.linalg.norm(body.gravity))

    def moment(e1: FloatArray, v: FloatArray, _: FloatArray) -> FloatArray:
        return resistance_moment(body.contact.rolling_resistance, weight, e1, v)

    return Law(body, moment=moment, resisting=lambda *_: np.zeros(3))


def _as_velocity(body: RollingBall) -> Law:
    def friction(ball: RollingBall, N: float, v: FloatArray) -> FloatArray:
        return -ball.contact.mu_kinetic * N * v / (float(np.linalg.norm(v)) or 1.0)

    return Law(body, slipping=friction)


CONTACT_LAWS: tuple[Any, ...] = (
    other_law(
        "resistance along spin",
        "the rolling resistance acts against the whole angular velocity, spin about the normal included",
        _along_spin,
        "the moment of the rolling resistance is f (v/V) x (-N e1): it is against the rolling alone",
        has_resistance,
    ),
    other_law(
        "resistance by weight",
        "the rolling resistance is f times the ball's weight, not f times the force of the wall",
        _by_weight,
        "the moment of the rolling resistance is f N, with the N of that moment",
        has_resistance,
    ),
    other_law(
        "friction against velocity",
        "the friction acts against the velocity of the centre, not against the slip of the contact point",
        _as_velocity,
        "friction is against v + w x a e1",
        is_bounded,
    ),
    pyramidal_cone,
    starts_to_slip,
)
