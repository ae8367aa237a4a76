"""What other laws of a ball's motion are held against: its certificate, if that differs, and the states of its run."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import CLOSES, CLOSES_EXACTLY, Evidence
from proofroll.core.diagnosis.held import ABOVE, Held
from proofroll.core.diagnosis.lines import differing, left
from proofroll.elements.ball_on_surface.diagnosis.equations import Law, residuals, response, states
from proofroll.elements.ball_on_surface.model import RollingBall

if TYPE_CHECKING:
    import xarray as xr

# What an engine is given, and may say to hold though it does not.
GIVEN = ("mass", "inertia", "gravity", "ball radius", "rolling resistance", "static friction", "kinetic friction")
# What follows from the law by which a ball moves.
COVERED = ("force", "p_WB", "v_WB", "w_WB", "velocity", "spin", "acceleration", "angular acceleration")


def held_against(evidence: Evidence) -> Iterator[Held[Law]]:
    """The certificate, if something in it differs; the run, unless the equations hold there as for the truth."""
    body = evidence.element.rolling
    wrong = differing(evidence.lines)
    if wrong and float(np.linalg.norm(body.v0)) > 0:

        def left_of_lines(law: Law | None) -> FloatArray:
            plain = left(evidence.lines, {}, GIVEN)
            return np.full_like(plain, np.inf) if law is None else left(evidence.lines, at_start(body, law), GIVEN)

        what = " and ".join(str(line["quantity"]) for line in wrong[:2]) + (" and more" if len(wrong) > 2 else "")
        before = float(np.max(np.abs(left(evidence.lines, {}, GIVEN)), initial=0.0))
        yield Held(left_of_lines, f"at time 0 {what}, relative,", "1", before, CLOSES_EXACTLY, COVERED)
    if evidence.run is None or evidence.truth is None or (_leaves(evidence.run) and not _leaves(evidence.truth)):
        return  # off the wall another law holds, and an impact has no derivative
    seen, true = states(body, evidence.run), states(body, evidence.truth)
    if seen is None or true is None:
        return

    def left_of_run(law: Law | None) -> FloatArray:
        found = residuals(body, seen, law or Law(body))
        return np.full_like(found, np.inf) if law is None else found

    plain = Law(body)
    before = float(np.max(np.abs(residuals(body, seen, plain))))
    if np.isfinite(before) and before > ABOVE * float(np.max(np.abs(residuals(body, true, plain)))):
        yield Held(left_of_run, "motion", "m/s^2", before, CLOSES, COVERED)


def _leaves(data: xr.Dataset) -> bool:
    return "N" in data and bool(np.any(data["N"].to_numpy()[1:] == 0))


def at_start(body: RollingBall, law: Law) -> dict[str, Any]:
    """What a certificate would expect of a ball that moves by a law."""
    acceleration, turning, force = response(law, body.p0, body.v0, body.w0, True)
    local = body.surface.frame(body.u0).T @ force
    ball, contact = law.body.ball, law.body.contact
    return {
        "mass": [ball.mass],
        "inertia": [ball.inertia] * 3,
        "gravity": law.body.gravity,
        "rolling resistance": [contact.rolling_resistance],
        "static friction": [contact.mu_static],
        "kinetic friction": [contact.mu_kinetic],
        "acceleration": acceleration,
        "angular acceleration": turning,
        "N": [-local[0]],
        "F2": [local[1]],
        "F3": [local[2]],
    }


def falling(element: Any, gravity: FloatArray) -> Law:
    """With another gravity [m/s²]."""
    return Law(dataclasses.replace(element.rolling, gravity=gravity))


def is_bounded(body: RollingBall) -> bool:
    """Whether the scene's ball may slip."""
    return bool(np.isfinite(body.contact.mu_static))


def has_resistance(body: RollingBall) -> bool:
    """Whether the scene resists the rolling."""
    return body.contact.rolling_resistance > 0
