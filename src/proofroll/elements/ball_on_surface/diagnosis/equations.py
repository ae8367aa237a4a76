"""Residuals of the equations of motion for a ball's certificate and run, under the scene's or another law.

Accelerations are derived from the run, forces are those that it reports. So each sample tests a law by itself, however
far the path has departed from the true one.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.interpolate import make_interp_spline

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import CLOSES, CLOSES_EXACTLY, Evidence
from proofroll.core.diagnosis.fitting import ABOVE, Residuals, cached_on_evidence
from proofroll.core.diagnosis.lines import differing, relative_differences
from proofroll.core.first_steps import OF_FIRST_STEPS
from proofroll.elements.ball_on_surface.mechanics import natural_acceleration, newton_euler
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.mechanism.run.contacts.stretches import DEGREE, ENDS, accelerations, stretches

if TYPE_CHECKING:
    import xarray as xr

# Numbers that an engine is given; it may report them correctly and yet move with others.
GIVEN = ("mass", "inertia", "gravity", "ball radius", "rolling resistance")
# Quantities that follow from the law of motion.
COVERED = ("force", "p_WB", "v_WB", "w_WB", "velocity", "spin", "acceleration", "angular acceleration")
_SAMPLES = 24
# Error of a line of first steps in the certificate, in its tolerances.
_KNOWN = 3.0


@dataclass(frozen=True)
class BallStates:
    """States of a run at some of its samples, away from events.

    Attributes:
        p, v, w: centre, velocity and angular velocity in the world, shape (samples, 3).
        a, alpha: rates of v and w, from the run itself.
        force: force of the wall that the engine reports [N], shape (samples, 3); None if it does not.
    """

    p: FloatArray
    v: FloatArray
    w: FloatArray
    a: FloatArray
    alpha: FloatArray
    force: FloatArray | None


@dataclass(frozen=True)
class Law:
    """Law of motion of a ball.

    Attributes:
        body: ball with the numbers that the law assumes.
        force: additional force [N] as a function of the velocity.
        moment: additional moment [N m] as a function of e1, the velocity and the angular velocity.
        resisting: moment of rolling resistance [N m] as a function of ball, N and spin; None: the scene's law.
    """

    body: RollingBall
    force: Callable[[FloatArray], FloatArray] | None = None
    moment: Callable[[FloatArray, FloatArray, FloatArray], FloatArray] | None = None
    resisting: Callable[[RollingBall, float, FloatArray], FloatArray] | None = None


def states(body: RollingBall, dataset: xr.Dataset) -> BallStates | None:
    """States of a run at up to 24 samples; None: too few samples lie between events."""
    parts = [_states(body, part) for part in stretches(dataset)]
    if not parts:
        return None
    columns = zip(*(dataclasses.astuple(part) for part in parts), strict=True)
    whole = [None if column[0] is None else np.concatenate(column) for column in columns]
    pick = np.unique(np.linspace(0, len(whole[0]) - 1, _SAMPLES).astype(int))  # type: ignore[arg-type]  # positions are there
    return BallStates(*(None if part is None else part[pick] for part in whole))  # type: ignore[arg-type]  # only a force is None


def _states(body: RollingBall, part: xr.Dataset) -> BallStates:
    t, inner = part["time"].to_numpy(), slice(ENDS, -ENDS)
    u, a = accelerations(body.surface, part)
    w = part["w_WB"].to_numpy()
    alpha = make_interp_spline(t, w, k=DEGREE).derivative()(t)
    force = None
    if "N" in part:
        local = np.stack([-part["N"].to_numpy(), part["F2"].to_numpy(), part["F3"].to_numpy()], axis=-1)
        force = np.einsum("tij,tj->ti", body.surface.frame(u), local)
        force = force[inner] if np.all(np.isfinite(force[inner])) else None
    p, v = part["p_WB"].to_numpy(), part["v_WB"].to_numpy()
    return BallStates(p=p[inner], v=v[inner], w=w[inner], a=a[inner], alpha=alpha[inner], force=force)


def residuals(body: RollingBall, seen: BallStates, law: Law) -> FloatArray:
    """Residuals of a law: accelerations, angular ones times the radius, and forces over mass, in one vector [m/s²]."""
    left = []
    for i in range(len(seen.p)):
        a, alpha, force = response(law, seen.p[i], seen.v[i], seen.w[i])
        left += [seen.a[i] - a, body.ball.radius * (seen.alpha[i] - alpha)]
        if seen.force is not None:
            left.append((seen.force[i] - force) / body.ball.mass)
    return np.concatenate(left)


def response(law: Law, p: FloatArray, v: FloatArray, w: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Acceleration, angular acceleration and wall's force at a state: Newton-Euler with the loads of the law."""
    body = law.body
    loads = law.force(v) if law.force else np.zeros(3)
    turning = law.moment(body.surface.normal(p), v, w) if law.moment else np.zeros(3)
    held = law.resisting(body, 1.0, w) if law.resisting else None
    return newton_euler(body, p, v, w, force=loads, moment=turning, resistance=held)


@cached_on_evidence
def residuals_of(evidence: Evidence) -> Iterator[Residuals[Law]]:
    """Residuals of the certificate if a line of it differs, and of the run if it balances worse than the truth.

    Nothing if the certificate shows a number that was built wrongly: that is the cause.
    """
    body = evidence.element.rolling
    plain, wrong = Law(body), differing(evidence.lines)
    if {line["quantity"] for line in wrong} & set(GIVEN):
        return
    if wrong and float(np.linalg.norm(body.v0)) > 0:
        yield held_at_start(evidence, body, wrong)
    if evidence.run is None or evidence.truth is None or evidence.by_step:
        return
    seen, true = states(body, evidence.run), states(body, evidence.truth)
    if seen is None or true is None:
        return

    def left_of_run(law: Law | None) -> FloatArray:
        left = residuals(body, seen, law or plain)
        return np.full_like(left, np.inf) if law is None else left

    largest = float(np.max(np.abs(left_of_run(plain))))
    if np.isfinite(largest) and largest > ABOVE * float(np.max(np.abs(residuals(body, true, plain)))):
        allowed = CLOSES * largest / natural_acceleration(body)
        yield Residuals(
            left=left_of_run, quantity="motion", unit="m/s^2", before=largest, closes=CLOSES, covers=COVERED,
            plain=plain, others=lambda: _others(body),
            contradicted=lambda law: _contradicted(evidence.lines, body, law, allowed),
        )  # fmt: skip


def held_at_start(evidence: Evidence, body: RollingBall, wrong: Sequence[Mapping[str, Any]]) -> Residuals[Law]:
    """Residuals of the certificate's lines, relative to their scales; ``wrong`` are the lines that differ."""

    def left_of_lines(law: Law | None) -> FloatArray:
        plain = relative_differences(evidence.lines, {}, GIVEN)
        return (
            np.full_like(plain, np.inf)
            if law is None
            else relative_differences(evidence.lines, at_start(body, law), GIVEN)
        )

    what = " and ".join(str(line["quantity"]) for line in wrong[:2]) + (" and more" if len(wrong) > 2 else "")
    largest = float(np.max(np.abs(relative_differences(evidence.lines, {}, GIVEN)), initial=0.0))
    return Residuals(
        left=left_of_lines, quantity=f"at time 0 {what}, relative,", unit="1", before=largest, closes=CLOSES_EXACTLY,
        covers=COVERED, plain=Law(body), others=lambda: _others(body),
        contradicted=lambda law: _contradicted(evidence.lines, body, law, CLOSES_EXACTLY * largest),
    )  # fmt: skip


def _others(body: RollingBall) -> list[Law]:
    """Laws that differ in one number each: gravity, mass, inertia, damping, constant moments."""
    ball = body.ball
    lighter = [replace(ball, mass=0.9 * ball.mass), replace(ball, inertia_ratio=0.9 * ball.inertia_ratio)]
    laws = [Law(replace(body, gravity=body.gravity + axis)) for axis in np.eye(3)]
    laws += [Law(replace(body, ball=lighter_ball)) for lighter_ball in lighter]
    laws += [Law(body, force=lambda v: -ball.mass * v), Law(body, moment=lambda _e1, _v, w: -ball.inertia * w)]
    return [*laws, *(Law(body, moment=lambda *_, axis=axis: ball.inertia * axis) for axis in np.eye(3))]


def _contradicted(lines: Sequence[Mapping[str, Any]], body: RollingBall, law: Law, allowed: float) -> bool:
    """True if an engine's first steps show other accelerations than a law, by more than ``allowed``.

    The accelerations that the engine reports may lack a damping that its steps add.
    """
    if not float(np.linalg.norm(body.v0)):
        return False
    natural, expected = natural_acceleration(body), at_start(body, law)
    scales = {"acceleration": natural, "angular acceleration": natural / body.ball.radius}
    seen = {
        str(line["quantity"]).removesuffix(OF_FIRST_STEPS): line for line in lines if OF_FIRST_STEPS in line["quantity"]
    }
    for name, scale in scales.items():
        if name in seen:
            off = float(np.max(np.abs(np.subtract(seen[name]["found"], expected[name])))) / scale
            if not off <= _KNOWN * float(seen[name]["tolerance"]) + allowed:
                return True
    return False


def at_start(body: RollingBall, law: Law) -> dict[str, Any]:
    """Expected lines of a certificate for a ball that moves by a law."""
    acceleration, turning, force = response(law, body.p0, body.v0, body.w0)
    local = body.surface.frame(body.u0).T @ force
    ball, contact = law.body.ball, law.body.contact
    return {
        "mass": [ball.mass],
        "inertia": [ball.inertia] * 3,
        "gravity": law.body.gravity,
        "rolling resistance": [contact.rolling_resistance],
        "acceleration": acceleration,
        "angular acceleration": turning,
        "N": [-local[0]],
        "F2": [local[1]],
        "F3": [local[2]],
    }


def falling(element: Any, gravity: FloatArray) -> Law:
    """Law with another gravity [m/s²]."""
    return Law(dataclasses.replace(element.rolling, gravity=gravity))


def has_resistance(body: RollingBall) -> bool:
    """True if the scene has rolling resistance."""
    return body.contact.rolling_resistance > 0
