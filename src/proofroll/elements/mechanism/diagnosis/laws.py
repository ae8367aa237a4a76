"""Hypotheses that an engine moves another mechanism than the scene's: other numbers, other loads, fewer rows."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import CLOSES, CLOSES_EXACTLY, Cause, Evidence
from proofroll.core.diagnosis.fitting import FACTORS, said_factor
from proofroll.core.diagnosis.lines import differing
from proofroll.elements.mechanism.diagnosis.equations import Change, States, of_run, of_start
from proofroll.elements.mechanism.model import Mechanism

_ABOVE = 20.0
# Part of the mechanism's size from which on a loop is open, and part of inertia and loads that balances.
_OPEN = 1e-4
_BALANCED = 1e-3
COVERED = ("p_WB", "v_WB", "w_WB", "q_WB", "force", "torque")
# Quantities of the certificate that follow from how the mechanism moves.
_FOLLOWS = frozenset(
    {
        "acceleration",
        "angular acceleration",
        "acceleration of the first steps",
        "angular acceleration of the first steps",
    }
)


@dataclass(frozen=True)
class Held:
    """What changes are held against.

    Attributes:
        states: of the run, or of the start with the certificate's accelerations.
        before: what the scene's own numbers leave.
        closes: part of it that a proof may leave.
        at: which of the two, for words.
        alone: whether there is but one equation, which any one number closes.
    """

    states: States
    before: float
    closes: float
    at: str
    alone: bool

    def cause(self, name: str, says: str, change: Change, remedy: str, number: int) -> Cause:
        """That the engine moves the changed mechanism."""
        after = float(np.max(np.abs(self.states.left(change)), initial=0.0))
        quantity = f"balance of the equations of motion {self.at}, relative,"
        return Cause(name, says, quantity, "1", self.before, after, remedy, number, ("motion", *COVERED), self.closes)


def held_against(evidence: Evidence) -> Iterator[Held]:
    """The start by the certificate, if its accelerations differ; the run, if it does not balance as the truth."""
    mechanism = evidence.element.mechanism
    plain = Change(mechanism)
    if _FOLLOWS & {line["quantity"] for line in differing(evidence.lines)}:
        start = of_start(evidence)
        if start is not None:
            left = start.left(plain)
            yield Held(
                start, float(np.max(np.abs(left), initial=0.0)), 1e3 * CLOSES_EXACTLY, "at time 0", len(left) < 2
            )
    if evidence.run is None or evidence.truth is None:
        return
    seen, true = of_run(mechanism, evidence.run), of_run(mechanism, evidence.truth)
    if seen is None or true is None or not seen.consistent:
        return
    before, floor = (float(np.max(np.abs(states.left(plain)), initial=0.0)) for states in (seen, true))
    if np.isfinite(before) and before > _ABOVE * floor:
        yield Held(seen, before, CLOSES, "along the run", False)


@dataclass(frozen=True)
class Factor:
    """A number of all bodies or joints times a factor.

    Attributes:
        id: of the hypothesis.
        what: the number, in words.
        change: the mechanism with a factor on it.
        has: whether the mechanism has such numbers.
        remedy: what to look at.
    """

    id: str
    what: str
    change: Callable[[Mechanism, float], Change]
    has: Callable[[Mechanism], bool]
    remedy: str
    grounds: str = "the equations of motion are linear in it: one factor balances them at every state of the run"

    def test(self, evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        mechanism = evidence.element.mechanism
        if not self.has(mechanism):
            return
        for held in held_against(evidence):
            factor, number = best(held, lambda x: self.change(mechanism, x))
            says = f"the engine moves it with {self.what} {said_factor(factor)}"
            yield held.cause(self.id, says, self.change(mechanism, factor), self.remedy, number)


def best(held: Held, change: Callable[[float], Change]) -> tuple[float, int]:
    """The factor that balances a linear equation, and how many numbers were fitted: none if it is a known one.

    Where there is one equation, any factor would do, and only those that mistakes make are looked at.
    """
    at = held.states.left(change(1.0))
    slope = held.states.left(change(2.0)) - at
    square = float(slope @ slope)
    fitted = 1.0 - float(slope @ at) / square if square else 1.0
    known = min(FACTORS, key=lambda x: float(np.max(np.abs(at + (x - 1.0) * slope), initial=0.0)))
    left_by_known = float(np.max(np.abs(at + (known - 1.0) * slope), initial=0.0))
    if held.alone or left_by_known <= held.closes * held.before:
        return known, 0
    return fitted, 1


@dataclass(frozen=True)
class OfEachBody:
    """A number of one body times a factor."""

    id: str = "body"
    grounds: str = "as for all bodies, for one"

    def test(self, evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        mechanism = evidence.element.mechanism
        mass = np.array([body.mass for body in mechanism.bodies])
        inertia, com = (np.array([getattr(body, key) for body in mechanism.bodies]) for key in ("inertia", "com"))
        for held in held_against(evidence):
            for i, body in enumerate(mechanism.bodies if len(mechanism.bodies) > 1 else ()):
                one = np.arange(len(mass)) == i

                def heavier(x: float, one: Any = one) -> Change:
                    return Change(mechanism, mass=np.where(one, x, 1.0) * mass)

                def stiffer(x: float, one: Any = one) -> Change:
                    return Change(mechanism, inertia=np.where(one, x, 1.0)[:, None, None] * inertia)

                for what, change in (("mass", heavier), ("inertia", stiffer)):
                    factor, number = best(held, change)
                    says = f"the engine moves the body {body.name} with its {what} {said_factor(factor)}"
                    yield held.cause(
                        f"{what} of {body.name}", says, change(factor), f"give {body.name} its {what} once", number
                    )
            if np.any(com):
                yield from self._about_origin(held, mechanism, mass, com, inertia)

    @staticmethod
    def _about_origin(
        held: Held, mechanism: Mechanism, mass: FloatArray, com: FloatArray, inertia: FloatArray
    ) -> Iterator[Cause]:
        """Steiner's part once too often or once too few, and centres of mass forgotten."""
        steiner = mass[:, None, None] * (
            np.einsum("ni,ni->n", com, com)[:, None, None] * np.eye(3) - com[:, :, None] * com[:, None, :]
        )
        remedy = "the scene's inertia is about the centre of mass, in the body's axes"
        for sign, words in ((1.0, "with Steiner's part added once more"), (-1.0, "with Steiner's part taken away")):
            says = f"the inertia is about the wrong point: that about the centre of mass {words}"
            for count, which in ((0, np.ones(len(mass))), *((0, row) for row in np.eye(len(mass)))):
                change = Change(mechanism, inertia=inertia + sign * which[:, None, None] * steiner)
                yield held.cause("point of inertia", says, change, remedy, count)
        says = "the centres of mass are taken to be at the origins of the bodies' frames"
        yield held.cause(
            "centre of mass", says, Change(mechanism, com=np.zeros_like(com)), "give the centres of mass", 0
        )


@dataclass(frozen=True)
class OfEachJoint:
    """Damping or armature in one joint or in all, that the scene does not have."""

    id: str = "joint"
    grounds: str = "the equations are linear in it: one coefficient balances them at every state of the run"

    def test(self, evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        mechanism = evidence.element.mechanism
        for held in held_against(evidence):
            if held.alone:
                continue
            rows = [
                (joint.name, np.arange(mechanism.nv), at)
                for joint, at in zip(mechanism.joints, mechanism.v_slices, strict=True)
            ]
            each = [
                (f"the joint {name}", ((all_v >= at.start) & (all_v < at.stop)).astype(float))
                for name, all_v, at in rows
            ]
            if len(each) > 1:
                each = [("every joint", np.ones(mechanism.nv)), *each]
            for where, which in each:
                for what, key in (("an armature (rotor inertia)", "added_armature"), ("damping", "added_damping")):
                    at = held.states.left(Change(mechanism))
                    slope = held.states.left(Change(mechanism, **{key: which})) - at
                    square = float(slope @ slope)
                    if not square:
                        continue
                    value = -float(slope @ at) / square
                    says = f"{where} has {what} of {value:.4g} more than the scene gives it"
                    remedy = f"set {key.removeprefix('added_')} of the joints yourself, also where it is zero"
                    change = Change(mechanism, **{key: value * which})
                    yield held.cause(f"{what} in {where}", says, change, remedy, 1)


@dataclass(frozen=True)
class LostCoupling:
    """Terms of the mass matrix between a body and one that hangs on it are lost."""

    id: str = "tree out of order"
    grounds: str = "without the terms that an algorithm loses that expects depth-first order, the equations balance"

    def test(self, evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        mechanism = evidence.element.mechanism
        pairs = _ancestry(mechanism)
        if not np.any(pairs):
            return
        says = "the mass matrix lacks terms between a body and those that hang on it, as when a tree is not depth-first"
        remedy = "add bodies depth-first, or take the mass matrix from an algorithm that does not need that order"
        for held in held_against(evidence):
            singles = []
            for row, column in np.argwhere(np.triu(pairs)):
                single = np.zeros_like(pairs)
                single[row, column] = single[column, row] = 1.0
                singles.append(single)
            for lost in [pairs, *singles]:
                yield held.cause(self.id, says, Change(mechanism, coupling=lost), remedy, 0)


def _ancestry(mechanism: Mechanism) -> FloatArray:
    """Pairs of velocities of which one's joint carries the other's, without those of one joint, (nv, nv)."""
    above = {joint.child: joint for joint in mechanism.joints}
    slices = dict(zip((joint.name for joint in mechanism.joints), mechanism.v_slices, strict=True))
    found = np.zeros((mechanism.nv, mechanism.nv))
    for joint in mechanism.joints:
        parent = above.get(joint.parent)
        while parent is not None:
            found[slices[joint.name], slices[parent.name]] = found[slices[parent.name], slices[joint.name]] = 1.0
            parent = above.get(parent.parent)
    return found


@dataclass(frozen=True)
class MissingRow:
    """A loop lacks one or more of its rows."""

    id: str = "missing row"
    grounds: str = (
        "the loop opens along some of its rows and along no other, and the equations balance along the motions that "
        "the others allow: nothing pulls it together there, as a stiff spring would"
    )

    def test(self, evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        mechanism = evidence.element.mechanism
        if not mechanism.loops or evidence.run is None:
            return
        seen = of_run(mechanism, evidence.run)
        if seen is None or not seen.consistent:
            return
        rows = [seen.tree.loop_rows(state.motion) for state in seen.each]
        opened = np.max(np.abs([row.residual for row in rows]), axis=0)
        if np.max(opened) <= _OPEN * evidence.element.length:
            return
        for k, loop in enumerate(mechanism.loops):
            own = rows[0].loop == k
            lost = np.flatnonzero(own & (opened > CLOSES * np.max(opened)))
            if not len(lost) or np.max(np.abs(seen.left(Change(mechanism), tuple(lost.tolist())))) > _BALANCED:
                continue
            after = float(np.max(np.delete(opened, lost), initial=0.0))
            many = "a row" if len(lost) == 1 else f"{len(lost)} of its rows"
            says = f"the loop {loop.name} lacks {many}: it opens there freely, and holds less than a {loop.kind} joint"
            remedy = f"a {loop.kind} loop has {int(np.sum(own))} rows; a point that is held gives three of them"
            covered = ("motion", *COVERED)
            yield Cause(self.id, says, "opening of loops", "m", float(np.max(opened)), after, remedy, 0, covered)


@dataclass(frozen=True)
class AnyGravity:
    """Gravity points another way."""

    id: str = "direction of gravity"
    grounds: str = "the equations are linear in gravity: one vector balances them at every state"

    def test(self, evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        mechanism = evidence.element.mechanism
        g = np.array(mechanism.gravity)
        for held in held_against(evidence):
            at = held.states.left(Change(mechanism, gravity=g))
            slopes = [held.states.left(Change(mechanism, gravity=g + axis)) - at for axis in np.eye(3)]
            if len(at) <= 3:
                continue
            found = g - np.linalg.lstsq(np.stack(slopes, axis=-1), at, rcond=None)[0]
            found = np.where(np.abs(found) < 1e-6 * max(float(np.max(np.abs(found))), 1e-300), 0.0, found)
            says = f"the engine's gravity is ({', '.join(f'{x:.4g}' for x in found)}) m/s^2"
            yield held.cause(self.id, says, Change(mechanism, gravity=found), "look at the axes of gravity", 3)


def _inertias(mechanism: Mechanism, x: float) -> Change:
    return Change(mechanism, inertia=x * np.array([body.inertia for body in mechanism.bodies]))


def _masses(mechanism: Mechanism, x: float) -> Change:
    return Change(mechanism, mass=x * np.array([body.mass for body in mechanism.bodies]))


LAWS: tuple[Any, ...] = (
    Factor(
        "gravity",
        "gravity",
        lambda m, x: Change(m, gravity=x * np.array(m.gravity)),
        lambda m: any(m.gravity),
        "give the engine the scene's gravity: an acceleration in the world, its sign and its unit",
    ),
    Factor("mass", "all masses", _masses, lambda m: bool(m.bodies), "give each body its mass once"),
    Factor("inertia", "all inertias", _inertias, lambda m: bool(m.bodies), "give each body its inertia once"),
    Factor(
        "joint damping",
        "the damping of the joints",
        lambda m, x: Change(m, damping=x),
        lambda m: any(joint.damping for joint in m.joints),
        "give the joints their damping, as a moment per rad/s or a force per m/s against the motion",
    ),
    Factor(
        "joint stiffness",
        "the stiffness of the joints",
        lambda m, x: Change(m, stiffness=x),
        lambda m: any(joint.stiffness for joint in m.joints),
        "give the joints their stiffness, per rad or per m",
    ),
    Factor(
        "joint torque",
        "the drives of the joints",
        lambda m, x: Change(m, torque=x),
        lambda m: any(joint.torque for joint in m.joints),
        "give the joints their drive, on the child against the parent",
    ),
    Factor(
        "armature",
        "the armature of the joints",
        lambda m, x: Change(m, armature=x),
        lambda m: any(joint.armature for joint in m.joints),
        "give the joints their armature",
    ),
    Factor(
        "springs",
        "the springs",
        lambda m, x: Change(m, springs=x),
        lambda m: bool(m.springs),
        "give the springs their stiffness and free length",
    ),
    Factor(
        "gyroscopic terms",
        "the gyroscopic moments w x I w",
        lambda m, x: Change(m, gyroscopic=x),
        lambda m: bool(m.bodies),
        "the rate of the angular momentum has the term w x I w",
    ),
    OfEachBody(),
    OfEachJoint(),
    LostCoupling(),
    MissingRow(),
    AnyGravity(),
)
