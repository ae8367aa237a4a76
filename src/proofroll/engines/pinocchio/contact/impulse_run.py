"""Formulation ``impulses``: run of a mechanism with contacts, dry friction and stops, and its samples."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
from typing_extensions import override

from proofroll.core.arrays import longest
from proofroll.core.engine import Regularised, whole_steps
from proofroll.core.errors import Diverged
from proofroll.core.events import Event
from proofroll.core.number_format import number
from proofroll.elements.mechanism import WORLD, Mechanism
from proofroll.elements.mechanism.run.capabilities import ALL_JOINTS, ALL_LOOPS, ALL_SHAPES, FORCES, MechanismCapability
from proofroll.elements.mechanism.run.contacts.family import Family, of_contact
from proofroll.elements.mechanism.run.sampling import MechanismBuilt, MechanismSample
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.engines.pinocchio.contact.impulses import ImpulseSteps
from proofroll.engines.pinocchio.contact.shared_cones import BY_BLOCKS
from proofroll.engines.pinocchio.contact.step_terms import Impulses
from proofroll.engines.pinocchio.settings import PinocchioSettings
from proofroll.engines.pinocchio.smooth.joint_tree import JointTree
from proofroll.engines.pinocchio.smooth.mechanism_run import MechanismRun
from proofroll.engines.pinocchio.smooth.null_space import LoopRows, NullSpace

_CAPABILITY = MechanismCapability
PROVIDES: frozenset[str] = (
    ALL_JOINTS
    | FORCES
    | ALL_SHAPES
    | {_CAPABILITY.ARMATURE, _CAPABILITY.CONTACT, _CAPABILITY.CONTACT_FRICTION, _CAPABILITY.CONTACT_REBOUNDS}
    | {_CAPABILITY.UNBOUNDED_FRICTION, _CAPABILITY.SLIP_REBOUNDS, _CAPABILITY.TURNING_FRICTION, _CAPABILITY.ORIENTATION}
    | {_CAPABILITY.ACTUATORS, _CAPABILITY.SATURATION, _CAPABILITY.SIGNALS, _CAPABILITY.HELD, _CAPABILITY.SHARED_CONE}
    | {_CAPABILITY.JOINT_FRICTION, _CAPABILITY.STOPS, _CAPABILITY.REBOUNDS, _CAPABILITY.MOTIONS}
)
_OF_A_TREE = "its steps are those of a tree with contacts"
LACKING: Mapping[str, str] = {
    **dict.fromkeys(
        ALL_LOOPS | {_CAPABILITY.COUPLINGS, _CAPABILITY.COUPLINGS_OF_MANY, _CAPABILITY.MASSLESS}, _OF_A_TREE
    ),
    _CAPABILITY.STATIC_FRICTION: "this formulation gives a contact one coefficient",
}
# Fraction of a step over which the initial accelerations are evaluated, and factor on their errors.
_PART, _MARGIN = 1 / 16, 4.0
_BLOCKS = (
    "Pinocchio's admm solver did not reach solver_tolerance at one step; from there proofroll solves its matrices by "
    "blocks"
)
_PARTS = "in the convex problem a slipping contact separates"
_FOUND = "an impulse opposes the slip at its end, which turns, is found to solver_tolerance"
_LATER = f"{_FOUND}, and follows the turning of its contact (J̇v) one step later"


def family(settings: PinocchioSettings) -> Mapping[str, str]:
    """See :class:`proofroll.core.engine_abilities.TellsFamily`."""
    return of_contact(Family.CONVEX if settings.convex else Family.HARD)


class ImpulseRun(MechanismRun):
    """Run of formulation ``impulses``; see :class:`proofroll.core.engine.Engine` for the methods."""

    def __init__(self, mechanism: Mechanism, settings: PinocchioSettings) -> None:
        self._mechanism, self._settings = mechanism, settings
        self.tree = JointTree(mechanism, apart=True)
        self._model, self._data = self.tree.model, self.tree.model.createData()
        self.dynamics = NullSpace(self.tree, LoopRows(self.tree))
        self.steps, self._dt = ImpulseSteps(self.tree, settings), float(settings.dt or 0.0)

    @override
    def advance(self, t: float) -> None:
        start, steps = self.steps.t, self.steps
        for count in range(whole_steps(start, t, self._dt)):
            steps.t = start + count * self._dt
            steps.step()
            if not math.isfinite(steps.v.sum()):
                raise Diverged(f"the state is not finite at t = {steps.t:.6g} s")
        steps.t = t

    def _renew(self) -> None:
        """Keeps the stepper, which evaluates all forces anew."""
        self.steps.coming = None

    def _kick(self) -> Impulses:
        """Joint accelerations v̇, forces and moments of contacts [N, N m], of joint rows and motions, in the next step.

        At time 0 they belong to a fraction of that step, and include effects that later steps may see one step late.
        """
        steps = self.steps
        if steps.t:
            steps.coming = steps.coming or steps.kick(steps.q, steps.v)
            kick, span = steps.coming, self._dt
        else:
            span = _PART * self._dt
            kick = steps.beginning(span, convex=self._settings.convex)
        parts = kick._replace(v=kick.v - steps.v)._asdict()
        return Impulses(**{name: part if name == "states" else part / span for name, part in parts.items()})

    def _evaluated(self) -> tuple[Any, Array, Array, Array, Any, Array]:
        """Data of the present state, q, v, accelerations, joint forces in the next step, and empty loop forces."""
        q, v, kick = self.steps.q, self.steps.v, self._kick()
        touching = self.steps.touched(self.steps.ahead, q, v, [None] * len(self.steps.contacts))
        self.tree.now, self.dynamics.on_motions = self.steps.t, kick.driving
        data = self._placed(kick.v)
        forces = self.tree.pulls(data)
        parts = zip(self.steps.contacts, touching, kick.impulse, kick.moment, strict=True)
        for contact, touch, force, moment in parts:
            for body, sign in ((contact.body_a, 1.0), (contact.body_b, -1.0)):
                if body != WORLD:
                    frame = self.tree.body[self._mechanism.body_index[body]]
                    self.tree.put(forces, data, frame, touch.place, sign * force, sign * moment)
        return data, q, v, kick.v, forces, np.zeros((2, 0, 3))

    def _placed(self, acceleration: Array) -> Any:
        """Data of the present state with an acceleration."""
        data = self._data
        pin.forwardKinematics(self._model, data, self.steps.q, self.steps.v, acceleration)
        pin.updateFramePlacements(self._model, data)
        return data

    def sample(self) -> MechanismSample:
        """See :class:`proofroll.core.engine.Engine`; the forces are those of the next step."""
        kick = self._kick()
        forces = self.steps.joints.along_joints(self.steps.q, kick.along) if kick.along.size else {}
        return replace(super().sample(), contact_force=kick.impulse if self.steps.contacts else None, **forces)

    def remarks(self) -> Sequence[str]:
        """See :class:`proofroll.core.engine_abilities.TellsRemarks`."""
        blocks = self.steps.blocks
        if not blocks.solved:
            return []
        by_blocks = BY_BLOCKS if self.steps.sharing else _BLOCKS
        rough = blocks.worst > float(self._settings.solver_tolerance or 0.0)
        return [f"{by_blocks}, to {number(blocks.worst, 1)} of the largest speed" if rough else by_blocks]

    def events(self) -> Sequence[Event] | None:
        """See :class:`proofroll.core.engine_abilities.LocatesEvents`."""
        return self.steps.events.events()

    @override
    def built(self) -> MechanismBuilt:
        plain, span = super().built(), _PART * self._dt
        reason = _FOUND if self._settings.integrator == "midpoint" else _LATER
        hard, twice = (
            self._accelerations(self.steps.beginning(length, convex=False), length) for length in (span, 2 * span)
        )
        kick = self.steps.kick(self.steps.q, self.steps.v)
        step = self._accelerations(kick, self._dt)
        softened = dict[str, Regularised]()
        impulses = kick._replace(v=self.steps.v)
        accelerations, errors = self._accelerations(impulses, span), self.steps.unsure(span)
        off = [self._accelerations(impulses._replace(v=impulses.v + error), span) for error in errors]
        for name, value in hard.items():
            size = longest(value) or 1.0  # 1 if all accelerations are zero
            others = twice[name], step[name], getattr(plain, name)
            apart = sum(longest(value - rival) for rival in others)
            unsure = max((longest(shifted[name] - accelerations[name]) for shifted in off), default=0.0)
            tolerance = _MARGIN * (unsure + apart) / size
            softened[name] = Regularised(tolerance, _PARTS if self._settings.convex else reason)
        return replace(plain, **self.steps.read() if self.steps.contacts else {}, regularised=softened)

    def _accelerations(self, kick: Impulses, span: float) -> dict[str, Array]:
        """Accelerations of all bodies during a kick of length ``span`` [s]."""
        data = self._placed((kick.v - self.steps.v) / span)
        accelerations = [
            pin.getFrameClassicalAcceleration(self._model, data, frame, pin.LOCAL_WORLD_ALIGNED)
            for frame in self.tree.body
        ]
        return {
            "acceleration": np.array([item.linear for item in accelerations]),
            "angular_acceleration": np.array([item.angular for item in accelerations]),
        }
