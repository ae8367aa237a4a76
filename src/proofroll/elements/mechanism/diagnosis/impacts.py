"""Hypotheses of impacts: they come late, or have the restitution of another pair."""

import itertools
from collections.abc import Iterator

import numpy as np

from proofroll.core.diagnosis import CLOSES, Cause, Evidence, hypothesis
from proofroll.core.diagnosis.clocks import delay_text
from proofroll.core.diagnosis.fitting import change_by, factor_text
from proofroll.elements.mechanism.diagnosis.contacts import SeenContact, contact_cause, touch_of

_DELAY, _RATIO = 0.05, 1e-3  # largest delay, in steps, and error of restitution that count as none
_REAL = 1e-9  # imaginary part of a real root, in intervals of samples
# If a gap has a cubic term, and its parabola misses by m one interval T back, it misses by 5 m one interval ahead, and
# its rate there by 12 m / T.
_OFF, _OFF_RATE = 5.0, 12.0


@hypothesis(
    "impacts", "flights before and after an impact, extended to where they meet, tell its time and its restitution"
)
def impacts(evidence: Evidence) -> Iterator[Cause]:
    """Hypotheses: impacts come late, or with the restitution of another pair."""
    for touch in touch_of(evidence):
        law = [contact.restitution for contact in touch.mechanism.contacts]
        names = [contact.name for contact in touch.mechanism.contacts]
        met = [(k, one) for k in range(len(law)) for one in _met(touch, k)]
        if not met:
            continue
        delays, delay_bars, seen, seen_bars = np.array([one for _, one in met]).T
        size = float(np.abs(delays).max())
        if evidence.step and size > _DELAY * evidence.step:
            steps = np.round(2 * np.mean(delays) / evidence.step) / 2
            says = f"impacts come {delay_text(float(np.mean(delays)), evidence.step)}"
            after = float(np.max(np.abs(delays - steps * evidence.step) + delay_bars))
            proof = "time of impacts", "s", size, after
            remedy = "let the impact act in the step in which the gap closes"
            closes = CLOSES * min(1.0, evidence.step / size)  # any delay is near some multiple of half a step
            yield contact_cause("late impact", says, *proof, remedy, 1, closes=closes, explains=len(met))
        own = np.array([law[k] for k, _ in met])
        before = float(np.abs(seen - own).max())
        if before <= _RATIO:
            continue
        of_each = sorted({k for k, _ in met})
        for order in itertools.permutations(of_each):
            moved = dict(zip(of_each, order, strict=True))
            after = float(np.max(np.abs(seen - [law[moved[k]] for k, _ in met]) + seen_bars))
            swaps = "; ".join(f"{names[a]} has that of {names[b]}" for a, b in moved.items() if a != b)
            says = f"restitution is of another pair: {swaps}"
            yield contact_cause("restitution", says, "restitution", "1", before, after, "give each pair its own")
        factor = float(seen @ own / (own @ own)) if own.any() else np.nan
        says = f"restitution of all pairs is {factor_text(factor)}"
        after = float(np.max(np.abs(seen - factor * own) + seen_bars))
        proof = "restitution", "1", before, after
        remedy, change = "look at what the engine makes of it", change_by(factor)
        yield contact_cause("restitution", says, *proof, remedy, 1, explains=len(met), change=change)


def _met(touch: SeenContact, c: int) -> Iterator[tuple[float, float, float, float]]:
    """Delay [s] and its error bar, restitution and its error bar, of each impact of a contact between two flights.

    A flight is a parabola through two samples; its misfit at a third sample gives the error bars.
    """
    t, gap, rate, free = touch.time, touch.found.gap[:, c], touch.u_n[:, c], ~touch.presses[:, c]
    for k in range(1, len(t) - 2):
        if not (free[k - 1 : k + 3].all() and rate[k] < 0 < rate[k + 1]):
            continue
        flights, off, off_rate = [], 0.0, 0.0
        for at, other in ((k, k - 1), (k + 1, k + 2)):
            a, since = (rate[at] - rate[other]) / (t[at] - t[other]), t[other] - t[at]
            flights.append(np.poly1d([a / 2, rate[at] - a * t[at], gap[at] - rate[at] * t[at] + a * t[at] ** 2 / 2]))
            misfit = abs(gap[at] + rate[at] * since + a * since**2 / 2 - gap[other])
            off, off_rate = off + _OFF * misfit, off_rate + _OFF_RATE * misfit / abs(since)
        before, after = flights
        real = _REAL * (t[k + 1] - t[k])
        closes = [r.real for r in before.roots if abs(r.imag) < real and t[k] <= r.real <= 2 * t[k + 1] - t[k]]
        meets = [r.real for r in (before - after).roots if abs(r.imag) < real and t[k] <= r.real <= t[k + 1]]
        if closes and meets:
            when = min(meets, key=lambda at: abs(at - min(closes)))
            fell, rose = before.deriv()(when), after.deriv()(when)
            yield when - min(closes), off / abs(fell), float(-rose / fell), off_rate / abs(fell)
