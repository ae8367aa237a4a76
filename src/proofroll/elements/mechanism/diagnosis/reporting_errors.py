"""Hypotheses of wrongly reported motion: frames, points, signs and times of an engine's samples."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.arrays import FloatArray, known_difference
from proofroll.core.diagnosis import Cause, Evidence, hypothesis
from proofroll.core.diagnosis.lines import differing
from proofroll.core.diagnosis.samples import (
    another_clock,
    at_start,
    reported_quaternions,
    reported_vectors,
    single_precision_run,
)
from proofroll.core.diagnosis.vectors import ReportedVector
from proofroll.core.first_steps import OF_FIRST_STEPS
from proofroll.elements.mechanism.diagnosis.equations import placed_of
from proofroll.elements.mechanism.run.dataset import quaternions

if TYPE_CHECKING:
    import xarray as xr

BODY = "body axes"
_UNITS = {
    "p_WB": ("the origin of the body's frame", "m"),
    "v_WB": ("the velocity of that origin", "m/s"),
    "w_WB": ("the angular velocity", "rad/s"),
}


def _state(element: Any, data: xr.Dataset) -> FloatArray:
    """Poses and twists of all bodies, each scaled to a length by the mechanism's own length and time [m]."""
    length, T = element.length, element.natural_time
    parts = [data["p_WB"], data["v_WB"] * T, data["w_WB"] * (length * T), quaternions(data) * length]
    return np.concatenate(parts, axis=-1)


def _of_centres(vector: ReportedVector, evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: positions or velocities are those of the centres of mass."""
    com = np.array([body.com for body in evidence.element.mechanism.bodies])
    if vector.name == "w_WB" or not np.any(com) or vector.reported.shape != vector.true.shape:
        return
    placed = placed_of(evidence.element.mechanism, evidence.truth)
    arm = np.einsum("tnij,nj->tni", placed.R_WB[:, :-1], com)
    shift = arm if vector.name == "p_WB" else np.cross(placed.w_WB, arm)
    what = "position" if vector.name == "p_WB" else "velocity"
    says = f"{vector.name} is the {what} of the centres of mass, not of the origins of the bodies' frames"
    yield vector.cause(
        "centre of mass", says, vector.true + shift[-len(vector.true) :], "give the origins of the frames"
    )


@hypothesis(
    "centres of mass at time 0",
    "the scene's own vectors at time 0, of the centres of mass, are those of the certificate",
)
def centres_at_start(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: vectors at time 0 are those of the centres of mass, and nothing else differs."""
    element, wrong = evidence.element, {line["quantity"]: line for line in differing(evidence.lines)}
    com, start = np.array([body.com for body in element.mechanism.bodies]), element.start
    w, turning = start.w_WB[0], element.first_motion.angular_acceleration
    arm = np.einsum("nij,nj->ni", start.R_WB[0, :-1], com)
    acceleration = np.cross(turning, arm) + np.cross(w, np.cross(w, arm))
    shifts = {"position": arm, "velocity": np.cross(w, arm), "acceleration": acceleration}
    shifts[f"acceleration{OF_FIRST_STEPS}"] = acceleration
    meant = {"position": "p_WB is the position", "velocity": "v_WB is the velocity"}
    meant |= {"acceleration": "the acceleration is that", f"acceleration{OF_FIRST_STEPS}": meant["velocity"]}
    if set(wrong) - shifts.keys():
        return
    for name, line in wrong.items():
        off = np.reshape(line["found"], (-1, 3)) - np.reshape(line["expected"], (-1, 3))
        if off.shape == arm.shape:
            says = f"{meant[name]} of the centres of mass, not of the origins of the bodies' frames"
            proof = (
                f"{name} at time 0",
                str(line["unit"]),
                known_difference(off, 0 * off),
                known_difference(off, shifts[name]),
            )
            yield Cause("centre of mass", says, *proof, "give the origins of the frames")


def _size(element: Any, name: str) -> float:
    """Natural size of a quantity of a mechanism, from its length and natural time."""
    length, time = element.length, element.natural_time
    return float({"p_WB": length, "v_WB": length / time, "w_WB": 1 / time}[name])


def _attitudes(evidence: Evidence) -> FloatArray:
    assert evidence.truth is not None
    return quaternions(evidence.truth)


CLOCK = another_clock(_state, ("p_WB", "v_WB", "w_WB", "q_WB", "force", "torque", "motion"))
REPORTING_ERRORS: tuple[Any, ...] = (
    CLOCK,
    reported_vectors(
        _UNITS,
        lambda evidence: {BODY: placed_of(evidence.element.mechanism, evidence.truth).R_WB[:, :-1]},
        CLOCK,
        _size,
        _of_centres,
    ),
    at_start(lambda element: {BODY: element.start.R_WB[0, :-1]}, frozenset()),
    centres_at_start,
    reported_quaternions(_attitudes),
    single_precision_run,
)
