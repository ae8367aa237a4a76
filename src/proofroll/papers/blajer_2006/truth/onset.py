"""First slip: its time, its conditioning, and the distance to the next edge of the onset staircase."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from proofroll.core.errors import InputError
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.papers.blajer_2006.truth.friction_curve import FrictionCurve, friction_curve

_STEP = 1e-4  # relative step of the finite difference in f; its error, 1e-8, is far below any use of a sensitivity


@dataclass(frozen=True)
class Onset:
    """The first slip and its conditioning.

    Attributes:
        time: of the first slip [s]; 0: the ball slips from the start; None: no slip until the end.
        by_mu: d ln t / d ln μ [1]; None without slip, or if it starts at time 0.
        by_f: d ln t / d ln f [1]; 0 without rolling resistance; None as for ``by_mu``.
        edge_below, edge_above: next values of μ at which the time jumps [1]; None: there is none until the end.
        distance: relative distance of μ from the nearer edge [1]; inf: there is none.
        uncertainty: relative uncertainty of μ and f for which the verdict holds [1].
        verdict: ``ill-posed`` where a change within the uncertainty moves the slip to another rise of the needed
            friction, or makes or removes it.
        earliest, latest: times of the first slip with μ and f at the corners of their ranges [s]; None: no slip.
    """

    time: float | None
    by_mu: float | None
    by_f: float | None
    edge_below: float | None
    edge_above: float | None
    distance: float
    uncertainty: float
    verdict: Literal["well-posed", "ill-posed"]
    earliest: float | None
    latest: float | None


def first_slip(body: RollingBall, until: float) -> float | None:
    """Time of the ball's first slip [s]; None: not until ``until`` [s]."""
    return friction_curve(body, until).onset(body.contact.mu_static)


def onset(body: RollingBall, until: float, uncertainty: float = 1e-3) -> Onset:
    """First slip until ``until`` [s], and its conditioning for this relative uncertainty of μ and f [1].

    Raises:
        InputError: ``uncertainty`` is not between 0 and 1.
    """
    if not 0 <= uncertainty < 1:
        raise InputError("uncertainty", uncertainty, "give a relative uncertainty of mu and f between 0 and 1")
    mu = body.contact.mu_static
    curve = friction_curve(body, until)
    time = curve.onset(mu)
    by_mu = by_f = None
    if time:
        slope = curve.slope(time)
        by_mu = mu / (time * slope)
        by_f = 0.0 - _by_f(body, time, until) / (time * slope)
    edges = curve.edges()
    below, above = max(edges[edges <= mu], default=None), min(edges[edges > mu], default=None)
    distances = [abs(float(edge) / mu - 1) for edge in (below, above) if edge is not None and mu > 0]
    # All corners of the ranges of f and μ: more resistance does not always mean an earlier slip.
    changed = [_changed(body, sign * uncertainty, until) for sign in (1, -1)]
    stairs = [_stair(changed_curve, mu * (1 + sign * uncertainty)) for changed_curve in changed for sign in (1, -1)]
    true_stair = _stair(curve, mu)
    times = [stair[0] for stair in (true_stair, *stairs) if stair[0] is not None]
    return Onset(
        time=time,
        by_mu=by_mu,
        by_f=by_f,
        edge_below=None if below is None else float(below),
        edge_above=None if above is None else float(above),
        distance=min(distances, default=float("inf")),
        uncertainty=uncertainty,
        verdict="well-posed" if all(stair[1] == true_stair[1] for stair in stairs) else "ill-posed",
        earliest=min(times, default=None),
        latest=max(times, default=None),
    )


def edge_between(body: RollingBall, low: float, high: float, until: float, digits: int = 6) -> float | None:
    """Value of μ between ``low`` and ``high`` at which the time of the first slip jumps, by bisection [1].

    Bisection asks on which rise of the needed friction the slip starts, so the answer does not depend on the size of
    the jump. The result is rounded to ``digits`` decimal places.

    Returns:
        None where both ends slip on the same rise.
    """
    curve = friction_curve(body, until)
    lower, upper = _stair(curve, low)[1], _stair(curve, high)[1]
    if lower == upper:
        return None
    while high - low > 0.1 * 10.0**-digits:
        middle = (low + high) / 2
        if _stair(curve, middle)[1] == lower:
            low = middle
        else:
            high = middle
    return round((low + high) / 2, digits)


def _stair(curve: FrictionCurve, mu: float) -> tuple[float | None, int]:
    """Time of the first slip [s] and the index of the rise on which it starts; -1: at time 0, -2: never."""
    time = curve.onset(mu)
    if time is None:
        return None, -2
    return time, curve.rises_before(time) if time > 0 else -1


def _changed(body: RollingBall, relative: float, until: float) -> FrictionCurve:
    f = body.contact.rolling_resistance
    return friction_curve(body.with_contact(rolling_resistance=f * (1 + relative)), until)


def _by_f(body: RollingBall, time: float, until: float) -> float:
    """Product of f and the derivative of the needed friction with respect to f, at a fixed time [1]."""
    if not body.contact.rolling_resistance:
        return 0.0
    high, low = (float(_changed(body, step, until)(np.array([time]))[0]) for step in (_STEP, -_STEP))
    return (high - low) / (2 * _STEP)
