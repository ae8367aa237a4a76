"""Hypotheses of wrongly reported motion: signs, units, axes, points and times of an engine's samples."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.core.arrays import FloatArray, cross, known_difference
from proofroll.core.diagnosis import Cause, Evidence, above_round_off, hypothesis
from proofroll.core.diagnosis.clocks import delay_text, in_steps
from proofroll.core.diagnosis.fitting import least_squares_parameter
from proofroll.core.diagnosis.lines import differing
from proofroll.core.diagnosis.samples import (
    another_clock,
    at_start,
    forced_otherwise,
    reported_quaternions,
    reported_vectors,
    run_and_truth,
    single_precision_run,
)
from proofroll.core.diagnosis.vectors import ReportedVector, components_along
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.mechanism.run.contacts.stretches import carried

if TYPE_CHECKING:
    import xarray as xr

SURFACE, BODY = "the surface's axes e1, e2, e3", "body axes"
_SUBSTEPS = 32


def frames(body: RollingBall, truth: xr.Dataset) -> dict[str, FloatArray]:
    """Frames in which a vector may be given by mistake, at each time of the true run, shape (time, 3, 3), by name."""
    local = body.surface.frame(body.surface.locate(truth["p_WB"].to_numpy()))
    return {SURFACE: local, BODY: attitudes(truth["time"].to_numpy(), truth["w_WB"].to_numpy())}


def attitudes(time: FloatArray, w_WB: FloatArray) -> FloatArray:
    """Rotations of the body from its true angular velocity; the identity at time 0, shape (time, 3, 3)."""
    if len(time) < 2:
        return np.eye(3)[None]
    rotations = [np.eye(3)]
    for rotation in carried(Rotation.identity(len(time) - 1), time, w_WB, _SUBSTEPS).as_matrix():
        rotations.append(rotation @ rotations[-1])
    return np.array(rotations)


def forces(body: RollingBall, dataset: xr.Dataset) -> FloatArray:
    """Force of the wall on the ball in the world [N], NaN where not reported, shape (time, 3)."""
    frame = body.surface.frame(body.surface.locate(dataset["p_WB"].to_numpy()))
    local = np.stack([-dataset["N"].to_numpy(), dataset["F2"].to_numpy(), dataset["F3"].to_numpy()], axis=-1)
    return np.asarray(np.einsum("tij,tj->ti", frame, local))


_FORCE = "the wall's force on the ball"
_UNITS = {
    "p_WB": ("the centre", "m"),
    "v_WB": ("the velocity of the centre", "m/s"),
    "w_WB": ("the angular velocity", "rad/s"),
}


def _state(element: Any, data: xr.Dataset) -> FloatArray:
    """Centre and velocities of the ball, each scaled to a length by the radius [m]."""
    a = element.rolling.ball.radius
    return np.concatenate([data["p_WB"], data["v_WB"] * a, data["w_WB"] * a**2], axis=-1)


def _frames(evidence: Evidence) -> dict[str, FloatArray]:
    assert evidence.truth is not None
    return frames(evidence.element.rolling, evidence.truth)


CLOCK = another_clock(_state, ("p_WB", "v_WB", "w_WB", "force", "motion"))


@hypothesis("said force", "the engine's force equals the true one with another sign, unit, frame or time")
def reported_force(evidence: Evidence) -> Iterator[Cause]:
    """Hypotheses on the wall's force along the run, and on its friction alone."""
    pair, body = run_and_truth(evidence), evidence.element.rolling
    if pair is None or "N" not in pair[0] or "N" not in pair[1] or CLOCK.proven(evidence):
        return
    run, truth = pair
    time, axes = truth["time"].to_numpy(), frames(body, truth)
    reported, true = forces(body, run), forces(body, truth)
    finite = np.all(np.isfinite(reported) & np.isfinite(true), axis=-1)
    finite_axes = {name: frame[finite] for name, frame in axes.items()}
    vector = ReportedVector(
        name="force",
        what=_FORCE,
        unit="N",
        reported=reported[finite],
        true=true[finite],
        time=time[finite],
        frames=finite_axes,
    ).after_start()
    if forced_otherwise(evidence, vector):
        return
    yield _friction_reversed(vector, finite_axes[SURFACE][-len(vector.true) :, :, 0])
    yield from vector.causes(evidence.step)


def _friction_reversed(vector: ReportedVector, e1: FloatArray) -> Cause:
    """Cause that N is right and the friction points the other way."""
    normal = np.sum(vector.true * e1, axis=-1, keepdims=True) * e1
    says = "the friction has the wrong sign, and N is right"
    return vector.cause(
        "friction sign", says, 2 * normal - vector.true, "give the friction on the ball, not on the wall"
    )


@hypothesis("late start", "the position at time 0 is that of the true path at another time, to second order")
def starts_late(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: the start lies on the true path before or after time 0; tested with the certificate's line alone."""
    lines = {line["quantity"]: line for line in differing(evidence.lines)}
    if evidence.run is not None or "position" not in lines:
        return
    v = evidence.element.rolling.v0
    off = np.subtract(lines["position"]["found"], lines["position"]["expected"])
    if not v @ v:
        return
    ahead = float(off @ v / (v @ v))
    start = evidence.element.first_motion
    bend = start.acceleration[0] * ahead**2 / 2 if start is not None else 0.0
    difference, remainder = float(np.max(np.abs(off))), float(np.max(np.abs(off - v * ahead - bend)))
    says = f"the start is {delay_text(-ahead, evidence.step)}: the ball has moved before time 0"
    remedy, change = "sample before the first step", in_steps(ahead, evidence.step)
    yield Cause(
        id="late",
        says=says,
        quantity="position at time 0",
        unit="m",
        before=difference,
        after=remainder,
        remedy=remedy,
        fitted=1,
        change=change,
    )


@hypothesis("contact point", "the contact point is at p + a e1, its velocity v + a w x e1, both known from the truth")
def at_the_contact(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: quantities of the centre are those of the contact point, or lack the spin about the normal."""
    run, truth, body = evidence.run, evidence.truth, evidence.element.rolling
    if run is None or truth is None:
        return
    p, v, w = (truth[name].to_numpy() for name in ("p_WB", "v_WB", "w_WB"))
    e1, a = body.surface.normal(p), body.ball.radius
    spin = np.sum(w * e1, axis=-1, keepdims=True) * e1
    for name, says, changed in (
        ("p_WB", "p_WB is the contact point, not the centre", p + a * e1),
        ("v_WB", "v_WB is the velocity of the contact point, not of the centre", v + a * cross(w, e1)),
        ("w_WB", "w_WB lacks the spin about the surface's normal", w - spin),
        ("w_WB", "w_WB is the spin about the surface's normal alone", spin),
        ("w_WB", "w_WB has the spin about the surface's normal with the wrong sign", w - 2 * spin),
    ):
        reported, true = run[name].to_numpy(), truth[name].to_numpy()
        if reported.shape == true.shape and len(reported) > 1:
            reported, true = reported[1:], true[1:]
            difference = known_difference(reported, true)
            remedy = f"give {name} of the ball's centre, along the axes of the world"
            yield Cause(
                id="contact point",
                says=says,
                quantity=name,
                unit=_UNITS[name][1],
                before=difference,
                after=known_difference(reported, changed[1:]),
                remedy=remedy,
            )


@hypothesis("stale normal", "the engine's force is the true N, F2 and F3 along e1, e2, e3 of an earlier time")
def stale_normal(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: the force has the right components, but along the axes of another time."""
    run, truth, body = evidence.run, evidence.truth, evidence.element.rolling
    if run is None or truth is None or "N" not in run or "N" not in truth or run.sizes["time"] < 3:
        return
    reported, true = forces(body, run)[1:], forces(body, truth)[1:]
    p, v = (truth[name].to_numpy()[1:] for name in ("p_WB", "v_WB"))
    if (
        reported.shape != true.shape
        or not np.all(np.isfinite(reported))
        or not above_round_off(known_difference(reported, true), float(np.max(abs(true))))
    ):
        return
    local = components_along(body.surface.frame(body.surface.locate(p)), true)

    def turned(delay: float) -> FloatArray:
        return np.asarray(np.einsum("tij,tj->ti", body.surface.frame(body.surface.locate(p - delay * v)), local))

    delay = least_squares_parameter(lambda x: np.ravel(turned(x) - reported), 0.0, evidence.step or 1e-3)
    if 2 * known_difference(run["p_WB"].to_numpy()[1:], p) > float(np.max(np.abs(delay * v))):
        return  # the ball itself is as far off, which explains its force
    moment = delay_text(delay, evidence.step).removesuffix(" late")
    says = f"the force is along the axes of the local frame {moment} earlier"
    remainder, remedy = (
        known_difference(reported, turned(delay)),
        "take the normal where the ball is when the force is read",
    )
    change = in_steps(delay, evidence.step)
    yield Cause(
        id="stale normal",
        says=says,
        quantity="force",
        unit="N",
        before=known_difference(reported, true),
        after=remainder,
        remedy=remedy,
        fitted=1,
        change=change,
    )


@hypothesis("force at time 0", "the scene's own force with another sign, unit or axes is the one of the certificate")
def force_at_start(evidence: Evidence) -> Iterator[Cause]:
    """Hypotheses on the wall's force at time 0, from the certificate."""
    lines, body = {line["quantity"]: line for line in evidence.lines}, evidence.element.rolling
    wrong, parts = {line["quantity"] for line in differing(evidence.lines)}, ("N", "F2", "F3")
    if not wrong or not wrong <= set(parts) or not all(lines[name]["found"] for name in parts):
        return
    frame = body.surface.frame(body.u0)
    reported, true = (
        frame @ np.array([-lines["N"][key][0], lines["F2"][key][0], lines["F3"][key][0]])
        for key in ("found", "expected")
    )
    vector = ReportedVector(
        name="force",
        what=_FORCE,
        unit="N",
        reported=reported[None],
        true=true[None],
        time=np.zeros(1),
        frames={SURFACE: frame[None]},
    )
    yield _friction_reversed(vector, frame[None, :, 0])
    yield from vector.causes(evidence.step)


def _attitudes(evidence: Evidence) -> FloatArray:
    assert evidence.truth is not None
    turned = attitudes(evidence.truth["time"].to_numpy(), evidence.truth["w_WB"].to_numpy())
    return np.asarray(Rotation.from_matrix(turned).as_quat(scalar_first=True))


REPORTING_ERRORS: tuple[Any, ...] = (
    CLOCK,
    starts_late,
    reported_vectors(_UNITS, _frames, CLOCK),
    reported_force,
    at_the_contact,
    stale_normal,
    at_start(
        lambda element: {SURFACE: element.rolling.surface.frame(element.rolling.u0)[None]},
        frozenset({"slip", "N", "F2", "F3"}),
    ),
    force_at_start,
    single_precision_run,
    reported_quaternions(_attitudes),
)
