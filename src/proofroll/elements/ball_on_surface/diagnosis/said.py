"""Hypotheses about what an engine says of its ball: signs, units, axes, points and times of its samples."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.spatial.transform import Rotation

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import Cause, Evidence, worth
from proofroll.core.diagnosis.fitting import fitted
from proofroll.core.diagnosis.lines import differing, single_precision
from proofroll.core.diagnosis.quaternions import quaternions, rounded
from proofroll.core.diagnosis.vectors import Reported, apart, into, late, said_delay
from proofroll.elements.ball_on_surface.model import RollingBall

if TYPE_CHECKING:
    import xarray as xr

SURFACE, BODY = "the surface's axes e1, e2, e3", "body axes"
_SUBSTEPS = 32
_FORCE = "the wall's force on the ball"
_UNITS = {
    "p_WB": ("the centre", "m"),
    "v_WB": ("the velocity of the centre", "m/s"),
    "w_WB": ("the angular velocity", "rad/s"),
}


def frames(body: RollingBall, truth: xr.Dataset) -> dict[str, FloatArray]:
    """The frames in which a vector may be given by mistake, at each time of the true run."""
    local = body.surface.frame(body.surface.locate(truth["p_WB"].to_numpy()))
    return {SURFACE: local, BODY: attitudes(truth["time"].to_numpy(), truth["w_WB"].to_numpy())}


def attitudes(time: FloatArray, w_WB: FloatArray) -> FloatArray:
    """Rotations of the body from its true angular velocity; the identity at time 0, shape (time, 3, 3)."""
    if len(time) < 2:
        return np.eye(3)[None]
    spin, h = make_interp_spline(time, w_WB, k=min(7, len(time) - 1)), np.diff(time) / _SUBSTEPS
    turned, found = Rotation.identity(len(h)), [np.eye(3)]
    for step in range(_SUBSTEPS):
        one, two = (spin(time[:-1] + (step + 0.5 + side / np.sqrt(12)) * h) for side in (-1, 1))
        bent = h[:, None] * (one + two) / 2 - np.sqrt(3) / 12 * h[:, None] ** 2 * np.cross(one, two)
        turned = Rotation.from_rotvec(bent) * turned
    for rotation in turned.as_matrix():
        found.append(rotation @ found[-1])
    return np.array(found)


def forces(body: RollingBall, dataset: xr.Dataset) -> FloatArray:
    """The wall's force on the ball in the world, NaN where it is not said, shape (time, 3)."""
    frame = body.surface.frame(body.surface.locate(dataset["p_WB"].to_numpy()))
    local = np.stack([-dataset["N"].to_numpy(), dataset["F2"].to_numpy(), dataset["F3"].to_numpy()], axis=-1)
    return np.asarray(np.einsum("tij,tj->ti", frame, local))


class Vectors:
    """Position, velocity, angular velocity and force, one by one."""

    id: ClassVar[str] = "said"
    grounds: ClassVar[str] = (
        "the true vector with another sign, unit, order of axes, frame, limit or time is what the engine says, sample "
        "by sample; no equation is needed"
    )

    @staticmethod
    def test(evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        run, truth, body = evidence.run, evidence.truth, evidence.element.rolling
        if run is None or truth is None or run.sizes["time"] < 3:
            return
        if any(cause.proven for cause in WholeRun.test(evidence)):
            return
        time, axes = truth["time"].to_numpy(), frames(body, truth)
        for name, (what, unit) in _UNITS.items():
            yield from Reported.after_start(
                name, what, unit, run[name].to_numpy(), truth[name].to_numpy(), time, axes
            ).causes(evidence.step)
        if "N" in run and "N" in truth:
            said, true = forces(body, run), forces(body, truth)
            known = np.all(np.isfinite(said) & np.isfinite(true), axis=-1)
            own = {name: frame[known] for name, frame in axes.items()}
            told = Reported.after_start("force", _FORCE, "N", said[known], true[known], time[known], own)
            yield _friction_reversed(told, frames(body, truth.isel(time=known))[SURFACE][-len(told.true) :, :, 0])
            yield from told.causes(evidence.step)


def _friction_reversed(told: Reported, e1: FloatArray) -> Cause:
    """That N is right and the friction points the other way."""
    normal = np.sum(told.true * e1, axis=-1, keepdims=True) * e1
    says = "the friction has the wrong sign, and N is right"
    return told.cause("friction sign", says, 2 * normal - told.true, "give the friction on the ball, not on the wall")


class WholeRun:
    """All that is said belongs to another time than it is said to."""

    id: ClassVar[str] = "late"
    grounds: ClassVar[str] = "position, velocity and angular velocity are the true ones, all shifted by one time"

    @staticmethod
    def test(evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        run, truth, a = evidence.run, evidence.truth, evidence.element.rolling.ball.radius
        if run is None or truth is None:
            yield from _late_at_start(evidence)
            return
        said, true = (
            np.concatenate([data["p_WB"], data["v_WB"] * a, data["w_WB"] * a**2], axis=-1) for data in (run, truth)
        )
        if said.shape != true.shape or not worth(apart(said, true), float(np.max(np.abs(true)))):
            return
        found = late(truth["time"].to_numpy(), said, true)
        if found is not None:
            delay, before, after = found
            says = f"every sample is {said_delay(delay, evidence.step)}: the path is right at another time"
            remedy = "advance(t) has to end at t, neither a step before nor after it"
            yield Cause(
                "late", says, "state", "m", before, after, remedy, 1, ("p_WB", "v_WB", "w_WB", "force", "motion")
            )


def _late_at_start(evidence: Evidence) -> Iterator[Cause]:
    """A start that lies on the true path a moment before or after time 0, from the certificate's line alone."""
    lines = {line["quantity"]: line for line in differing(evidence.lines)}
    if "position" not in lines:
        return
    v = evidence.element.rolling.v0
    off = np.subtract(lines["position"]["found"], lines["position"]["expected"])
    if not v @ v:
        return
    ahead = float(off @ v / (v @ v))
    start = evidence.element.first_motion
    bend = start.acceleration[0] * ahead**2 / 2 if start is not None else 0.0
    before, after = float(np.max(np.abs(off))), float(np.max(np.abs(off - v * ahead - bend)))
    says = f"the start is {said_delay(-ahead, evidence.step)}: the ball has moved before time 0"
    yield Cause("late", says, "position at time 0", "m", before, after, "sample before the first step", 1)


class AtTheContact:
    """What is said of the centre belongs to the contact point, or lacks the turning about the normal."""

    id: ClassVar[str] = "contact point"
    grounds: ClassVar[str] = "the contact point is at p + a e1, its velocity v + a w x e1, both known from the truth"

    @staticmethod
    def test(evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        run, truth, body = evidence.run, evidence.truth, evidence.element.rolling
        if run is None or truth is None:
            return
        p, v, w = (truth[name].to_numpy() for name in ("p_WB", "v_WB", "w_WB"))
        e1, a = body.surface.normal(p), body.ball.radius
        spin = np.sum(w * e1, axis=-1, keepdims=True) * e1
        for name, says, changed in (
            ("p_WB", "p_WB is the contact point, not the centre", p + a * e1),
            ("v_WB", "v_WB is the velocity of the contact point, not of the centre", v + a * np.cross(w, e1)),
            ("w_WB", "w_WB lacks the spin about the surface's normal", w - spin),
            ("w_WB", "w_WB is the spin about the surface's normal alone", spin),
            ("w_WB", "w_WB has the spin about the surface's normal with the wrong sign", w - 2 * spin),
        ):
            said, true = run[name].to_numpy(), truth[name].to_numpy()
            if said.shape == true.shape and len(said) > 1:
                said, true = said[1:], true[1:]
                before = apart(said, true)
                remedy = f"give {name} of the ball's centre, along the axes of the world"
                yield Cause("contact point", says, name, _UNITS[name][1], before, apart(said, changed[1:]), remedy)


class StaleNormal:
    """The force has the right components along the axes of another moment."""

    id: ClassVar[str] = "stale normal"
    grounds: ClassVar[str] = "N, F2 and F3 of the truth along e1, e2, e3 of one time before give the force that is said"

    @staticmethod
    def test(evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        run, truth, body = evidence.run, evidence.truth, evidence.element.rolling
        if run is None or truth is None or "N" not in run or "N" not in truth or run.sizes["time"] < 3:
            return
        said, true = forces(body, run)[1:], forces(body, truth)[1:]
        p, v = (truth[name].to_numpy()[1:] for name in ("p_WB", "v_WB"))
        if (
            said.shape != true.shape
            or not np.all(np.isfinite(said))
            or not worth(apart(said, true), float(np.max(abs(true))))
        ):
            return
        local = into(body.surface.frame(body.surface.locate(p)), true)

        def turned(delay: float) -> FloatArray:
            return np.asarray(np.einsum("tij,tj->ti", body.surface.frame(body.surface.locate(p - delay * v)), local))

        delay = fitted(lambda x: np.ravel(turned(x) - said), 0.0, evidence.step or 1e-3)
        moment = said_delay(delay, evidence.step).removesuffix(" late")
        says = f"the force is along the axes of the normal of {moment} before"
        after, remedy = apart(said, turned(delay)), "take the normal where the ball is when the force is read"
        yield Cause("stale normal", says, "force", "N", apart(said, true), after, remedy, 1)


class AtStart:
    """Signs and axes of what is said at time 0, from the certificate."""

    id: ClassVar[str] = "said at time 0"
    grounds: ClassVar[str] = "the scene's own vector with another sign, unit or axes is the one of the certificate"

    @staticmethod
    def test(evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        lines, body = {line["quantity"]: line for line in evidence.lines}, evidence.element.rolling
        wrong = {line["quantity"] for line in differing(evidence.lines)}
        frame = body.surface.frame(body.u0)
        vectors = [
            (name, what, unit, lines[name]["found"], lines[name]["expected"])
            for name, what, unit in (
                ("velocity", "the velocity of the centre", "m/s"),
                ("spin", "the angular velocity", "rad/s"),
                ("acceleration", "the acceleration of the centre", "m/s^2"),
                ("angular acceleration", "the angular acceleration", "rad/s^2"),
            )
            if name in wrong
        ]
        if wrong & {"N", "F2", "F3"} and all(lines[name]["found"] for name in ("N", "F2", "F3")):
            said, true = (
                frame @ np.array([-lines["N"][key][0], lines["F2"][key][0], lines["F3"][key][0]])
                for key in ("found", "expected")
            )
            vectors.append(("force", _FORCE, "N", said, true))
        for name, what, unit, said, true in vectors:
            told = np.atleast_2d(np.asarray(said)), np.atleast_2d(np.asarray(true))
            own = {"N", "F2", "F3"} if name == "force" else {name, "slip"}
            if told[0].shape == told[1].shape and wrong <= own:
                at_start = Reported(name, what, unit, *told, np.zeros(1), {SURFACE: frame[None]})
                if name == "force":
                    yield _friction_reversed(at_start, frame[None, :, 0])
                yield from at_start.causes(evidence.step)


class SinglePrecision:
    """Numbers of 24 bits."""

    id: ClassVar[str] = "float32"
    grounds: ClassVar[str] = "every number of the run, or each built one that differs, is exactly a float32"

    @staticmethod
    def test(evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        yield from single_precision(evidence.lines)
        if evidence.run is None or evidence.truth is None:
            return
        yield from rounded(evidence.run, evidence.truth, ("p_WB", "v_WB", "w_WB"))


class Attitude:
    """The quaternion is in another order, of the inverse rotation, or not of unit length."""

    id: ClassVar[str] = "quaternion"
    grounds: ClassVar[str] = "the true quaternion in another order or inverted is what is said, up to its sign"

    @staticmethod
    def test(evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        if evidence.run is None or evidence.truth is None or "q_WB" not in evidence.run:
            return
        body_axes = attitudes(evidence.truth["time"].to_numpy(), evidence.truth["w_WB"].to_numpy())
        true = Rotation.from_matrix(body_axes).as_quat(scalar_first=True)
        yield from quaternions(evidence.run["q_WB"].to_numpy(), true)


SAID: tuple[type[Any], ...] = (WholeRun, Vectors, AtTheContact, StaleNormal, AtStart, SinglePrecision, Attitude)
