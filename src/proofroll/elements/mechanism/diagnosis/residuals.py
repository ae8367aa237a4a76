"""Residuals of the equations of motion for changed models of a mechanism, at its certificate and along its run."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import CLOSES, CLOSES_EXACTLY, Cause, Evidence, Hypothesis, hypothesis
from proofroll.core.diagnosis.fitting import ABOVE, CauseRow, Residuals, cached_on_evidence, differing, in_doubt
from proofroll.core.first_steps import OF_FIRST_STEPS
from proofroll.elements.mechanism.diagnosis.equations import (
    Change,
    MechanismStates,
    is_one_motion,
    of_run,
    of_start,
    stretch,
)

# Equations with a larger relative residual for the true run prove nothing.
_TELLS = 1e-4
# Quantities that follow from built numbers, and from the motion.
COVERED = ("p_WB", "v_WB", "w_WB", "q_WB", "force", "torque")
MOTION = ("motion", *COVERED)
# A wrong contact changes all of the motion, so that no further cause of the motion is looked for.
TOUCHING_MOTION = ("motion", "contacts", "contact_forces", "normal_forces", "acceleration")
# Quantities of the certificate that follow from the motion.
_FOLLOWS = {f"{turning}acceleration{when}" for turning in ("", "angular ") for when in ("", OF_FIRST_STEPS)}


# If these differ, the start itself differs, and so do its accelerations.
STATE = {"position", "orientation", "velocity", "spin"}
# Numbers that an engine is given; it may report them correctly and yet move with others.
PLACED = ("gaps", "normals of contact", "places of contact")  # where bodies are placed as in the scene
GIVEN = (
    "mass", "centre of mass", "inertia", "gravity", "joint positions", "joint axes",
    *PLACED, "friction of contacts", "restitution of contacts",
)  # fmt: skip
# A run whose joints or loops open by more than this part of the mechanism's size is no motion of it with any numbers.
_OPEN = 1e-2
# Time by which the loads of a first-order scheme act too early or late, in steps: 0.5, and what a fit of it leaves.
_FIRST_ORDER = 0.6
# Largest residual of a right model: in those of a scheme of first order, and by rounding and soft constraints alone.
_BY_STEP, _ROUNDED = 3.0, 1e-3
# Error of the accelerations at the start, in imbalances of the first steps.
_KNOWN = 10.0
# Part of the load that is left where a change moves the mechanism with accelerations of another order of magnitude.
_UNBALANCED = 0.9


@cached_on_evidence
def residuals_of(evidence: Evidence) -> Iterator[Residuals[Change]]:
    """Residuals at the start if its accelerations differ, and along the run if it balances worse than the truth.

    Nothing if the certificate shows a number that was built wrongly: that is the cause.
    """
    mechanism = evidence.element.mechanism
    plain = Change(mechanism)
    wrong = {line["quantity"] for line in differing(evidence.lines)}
    if wrong & set(GIVEN):
        return
    start = of_start(evidence)
    if start is not None and start.consistent and _FOLLOWS & wrong and not STATE & wrong:
        reported = any(line["found"] for line in evidence.lines if line["quantity"] == "acceleration")
        yield replace(balanced_at_start(start), exact=reported, scheme=0.0 if reported else np.inf)
    if evidence.run is None or evidence.truth is None or evidence.by_step:
        return
    part = stretch(evidence.element, evidence.run, evidence.truth)
    if float(np.max(evidence.run["drift"].to_numpy())) > _OPEN * evidence.element.length:
        return
    if part is None or not is_one_motion(evidence.run, evidence.truth, evidence.element.length, evidence.step or 0.0):
        return
    seen = of_run(evidence.element, evidence.run, part, step=evidence.step or 0.0)
    true = of_run(evidence.element, evidence.truth, part)
    if not seen.consistent:
        return
    true_sizes = np.abs(true.left(plain))
    tells = true_sizes < _TELLS  # e.g. the free spin of a body about its axis leaves only round-off to balance
    sizes = np.abs(seen.left(plain))
    if sizes.shape != true_sizes.shape or not tells.any():
        return
    difference, floor = float(np.max(sizes[tells])), float(np.max(true_sizes[tells]))
    if np.isfinite(difference) and difference > ABOVE * floor:
        at_start = of_start(evidence, derived=True)
        allowed = CLOSES * difference + _KNOWN * _doubt(evidence, at_start)
        contradicted = partial(contradicts_first_steps, at_start, allowed)
        residuals = _residuals_at(seen, "along the run", difference, CLOSES, contradicted, tells)
        scheme = _left_by_scheme(evidence, seen, part)[tells]
        leaves = np.maximum(_BY_STEP * scheme, max(_ROUNDED, ABOVE * floor))
        yield replace(residuals, scheme=scheme, leaves=leaves)


def _left_by_scheme(evidence: Evidence, seen: MechanismStates, part: slice) -> FloatArray:
    """Largest residual along each direction that a scheme of first order leaves, whose loads act half a step off.

    Steps that are not known, as of an engine that adapts them, may be as long as the interval between samples.
    """
    assert evidence.run is not None  # it is the run that is seen
    plain, step = Change(seen.mechanism), evidence.step or float(np.diff(evidence.run["time"].to_numpy()).max())
    ahead = of_run(evidence.element, evidence.run, part, _FIRST_ORDER * step)
    left = np.abs(ahead.left(plain) - seen.left(plain))
    constrained = seen.mechanism.loops or seen.mechanism.couplings or seen.mechanism.contacts
    if constrained:  # directions of one state are not those of another
        return np.full_like(left, np.max(left))
    by_state = left.reshape(len(seen.each), -1)
    return np.ravel(np.broadcast_to(by_state.max(axis=0), by_state.shape))


def contradicts_first_steps(at_start: MechanismStates | None, allowed: float, change: Change) -> bool:
    """True if the first steps do not balance with a change of the mechanism.

    Where nearly the whole load is left, the change asks for accelerations of another order of magnitude than those that
    were seen; then no doubt about these is an excuse, unless they balance as little with the scene's own numbers.

    Args:
        at_start: state and accelerations of the first steps; None: there are none.
        allowed: largest relative imbalance that their error explains.
        change: of the mechanism.
    """
    if at_start is None:
        return False
    left, plain_left = (
        float(np.max(np.abs(at_start.left(item)), initial=0.0)) for item in (change, Change(at_start.mechanism))
    )
    return not left <= min(allowed, max(_UNBALANCED, plain_left))


def balanced_at_start(start: MechanismStates) -> Residuals[Change]:
    """Residuals at time 0, for the accelerations of the certificate."""
    difference = float(np.max(np.abs(start.left(Change(start.mechanism))), initial=0.0))
    return _residuals_at(start, "at time 0", difference, 1e3 * CLOSES_EXACTLY)


def _doubt(evidence: Evidence, start: MechanismStates | None) -> float:
    """Imbalance of the first steps for the unchanged mechanism, or the tolerance of their lines if that is larger."""
    if start is None:
        return 0.0
    allowed = [float(line["tolerance"]) for line in evidence.lines if str(line["quantity"]).endswith(OF_FIRST_STEPS)]
    return max([float(np.max(np.abs(start.left(Change(start.mechanism))), initial=0.0)), *allowed])


def _residuals_at(
    states: MechanismStates,
    place: str,
    difference: float,
    closes: float,
    contradicted: Callable[[Change], bool] = lambda _: False,
    tells: Any = slice(None),
) -> Residuals[Change]:
    plain = Change(states.mechanism)

    def left(change: Change | None) -> FloatArray:
        return np.asarray(states.left(change or plain)[tells])

    return Residuals(
        left=left,
        quantity=f"balance of the equations of motion {place}, relative,",
        unit="1",
        before=difference,
        closes=closes,
        covers=MOTION,
        plain=plain,
        others=lambda: _others(plain),
        contradicted=contradicted,
    )


def _others(plain: Change) -> list[Change]:
    """Changes of one number each: gravity, masses and inertias of bodies, armature and damping of joints."""
    mechanism = plain.mechanism
    mass = np.array([body.mass for body in mechanism.bodies])
    inertia = np.array([body.inertia for body in mechanism.bodies])
    changes = [replace(plain, gravity=np.array(mechanism.gravity) + axis) for axis in np.eye(3)]
    for which in np.eye(len(mass)):
        changes += [
            replace(plain, mass=mass * (1 + which)),
            replace(plain, inertia=inertia * (1 + which)[:, None, None]),
        ]
    for which in np.eye(sum(joint.nv for joint in mechanism.joints)):
        changes += [replace(plain, added_armature=which), replace(plain, added_damping=which)]
    return changes


Rows = Callable[[Evidence, Residuals[Change]], Iterable[CauseRow[Change]]]


def by_rows(name: str, grounds: str) -> Callable[[Rows], Hypothesis]:
    """Decorator that makes a hypothesis of a function that gives rows for residuals.

    A row is a cause unless a number read back contradicts it, or a scheme of first order leaves as much by itself.
    """

    def decorated(rows: Rows) -> Hypothesis:
        @hypothesis(name, grounds)
        def test(evidence: Evidence) -> Iterator[Cause]:
            for residuals in residuals_of(evidence):
                for row in rows(evidence, residuals):
                    if in_doubt(evidence, residuals, row.quantity, row.fitted) and not _by_scheme(residuals, row.model):
                        yield residuals.cause(row)

        return test

    return decorated


def _by_scheme(residuals: Residuals[Change], change: Change | None) -> bool:
    """True if a change is damping alone, of joints or momenta, and a first-order scheme leaves as much at the step."""
    if change is None:
        return False
    mechanism = change.mechanism
    damping = np.array([joint.damping for joint in mechanism.joints for _ in range(joint.nv)])
    added = (change.damping - 1.0) * damping + change.added_damping
    added = np.append(added, change.decay)
    if np.any(added < 0) or not np.any(added > 0):
        return False
    least = np.maximum(residuals.scheme, residuals.closes * residuals.before)
    return bool(np.all(np.abs(residuals.left(residuals.plain)) <= least))
