"""Formulation ``dependent``: run of a mechanism by the projection method, and its samples."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from proofroll.core.arrays import cross
from proofroll.core.dop853 import Accept
from proofroll.core.errors import Diverged, Refused
from proofroll.core.events import Event
from proofroll.core.integrators import INTEGRATORS, Integrator
from proofroll.core.stalling import Stalled
from proofroll.elements.mechanism.dynamics.held_signals import drive
from proofroll.elements.mechanism.dynamics.switches import switched_joints
from proofroll.elements.mechanism.run.capabilities import (
    ALL_JOINTS,
    ALL_LOOPS,
    ALL_SHAPES,
    FORCES,
    MechanismCapability,
    require,
)
from proofroll.elements.mechanism.run.sampling import (
    MechanismBuilt,
    MechanismSample,
    mechanism_of,
    of_drives,
    row_rank,
    unsaid,
)
from proofroll.elements.mechanism.run.sentences import pose
from proofroll.elements.mechanism.scene.joint_kinds import WITH_AXIS
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.signal import breaks, varies
from proofroll.engines.projection.contact.contact_modes import ContactMotion
from proofroll.engines.projection.contact.joint_modes import SwitchedMotion
from proofroll.engines.projection.settings import ProjectionSettings
from proofroll.engines.projection.smooth.dependent import DependentCoordinates, SolvedState
from proofroll.engines.projection.smooth.recursion import compiled

_FURTHER = {
    MechanismCapability[name] for name in (
        "REDUNDANT", "COUPLINGS", "COUPLINGS_OF_MANY", "ACTUATORS", "SATURATION", "SIGNALS", "HELD", "MOTIONS",
        "ARMATURE", "JOINT_FRICTION", "STOPS", "REBOUNDS", "CONTACT", "CONTACT_FRICTION", "UNBOUNDED_FRICTION",
        "STATIC_FRICTION", "SLIP_REBOUNDS", "CONTACT_REBOUNDS", "TURNING_FRICTION", "ORIENTATION",
    )
}  # fmt: skip
PROVIDES = frozenset(ALL_JOINTS | ALL_LOOPS | ALL_SHAPES | FORCES | _FURTHER)
# Regularity of the loops' rows, relative to the largest so far, that counts as singular: accelerations lose as many
# digits as it has zeros. It is about a hundredth for loops that miss a singular pose by a hundredth of a radian.
SINGULAR = 1e-6


class ProjectionMechanism:
    """Run of a mechanism; see :class:`proofroll.core.engine.Engine` for the methods."""

    def __init__(self, scene: Any, settings: ProjectionSettings) -> None:
        mechanism = mechanism_of(scene)
        require(mechanism, PROVIDES, {})
        self._timed = any(map(varies, mechanism.signals))
        limited = any(actuator.limit is not None for actuator in mechanism.actuators)
        switched = bool(switched_joints(mechanism)) or limited or bool(breaks(mechanism.signals))
        if mechanism.contacts and (mechanism.loops or mechanism.couplings):
            raise Refused("contacts are followed in trees, without loops and couplings")
        if any(contact.box_slot is not None for contact in mechanism.contacts):
            raise Refused(
                "a box meets boxes and capsules at places that begin and end at borders of faces, and this solver ends "
                "a mode where a gap closes, a force ends or a slip stops"
            )
        if mechanism.contacts and mechanism.cells:
            raise Refused("contacts under held targets are not followed yet")
        if (switched or self._timed or mechanism.contacts or mechanism.prescribed) and settings.equations == "compiled":
            raise Refused("equations that switch or change in time are not compiled; choose preset=matched")
        if any(spring.force for spring in mechanism.springs) and settings.equations == "compiled":
            raise Refused("formulas of springs are not compiled; choose preset=matched")
        if mechanism.bushings and settings.equations == "compiled":
            raise Refused("bushings are not compiled; choose preset=matched")
        self._mechanism, self._equations = mechanism, DependentCoordinates(mechanism)
        self._eliminates, self._most_regular = settings.eliminates, 0.0
        start = self._equations.start
        resolution = float(getattr(settings, settings.resolution))
        equations = self._equations
        in_numpy = equations.rates, equations.eliminated
        rates, self._without_violations = compiled(mechanism) if settings.equations == "compiled" else in_numpy
        self._switched: SwitchedMotion | None = None
        self._touching: ContactMotion | None = None
        self._motion: Integrator | SwitchedMotion | ContactMotion
        stepper = INTEGRATORS[settings.integrator](resolution)
        if mechanism.contacts:
            step, tolerance = (resolution, 0.0) if settings.resolution == "dt" else (0.0, resolution)
            self._motion = self._touching = ContactMotion(
                self._equations, mechanism, stepper, self._accepted, step, tolerance
            )
            return
        if switched:
            self._motion = self._switched = SwitchedMotion(self._equations, mechanism, stepper, self._accepted)
            return
        accepted: Accept = self._accepted
        if self._timed:  # the time is the last component of the state, as integrators pass on nothing else
            start, rates, accepted = np.append(start, 0.0), self._rates_in_time, self._accepted_in_time
        self._motion = stepper
        stepper.begin(0.0, start, rates, accepted, np.ones(len(start)))

    def _rates_in_time(self, y: Array) -> Array:
        self._equations.applied.now = float(y[-1])
        return np.append(self._equations.rates(y[:-1]), 1.0)

    def _accepted_in_time(self, t: float, y: Array) -> Array:
        return np.append(self._accepted(t, y[:-1]), y[-1])

    @property
    def _state(self) -> Array:
        """Present state, without the time."""
        self._equations.applied.now = self._motion.t
        return self._motion.x[: len(self._equations.start)]

    def _accepted(self, t: float, x: Array, held: Sequence[int] = ()) -> Array:
        if not np.isfinite(x.sum()):
            raise Diverged(f"the state is not finite at t = {t:.6g} s")
        self._equations.applied.now = t
        if self._eliminates:
            x = self._equations.eliminated(x, held) if held else self._without_violations(x)
        self._equations.accept(x)
        if self._equations.regularity < SINGULAR * self._most_regular:
            raise Stalled(f"a singular pose at t = {t:.6g} s, where the rows of loops become dependent")
        self._most_regular = max(self._most_regular, self._equations.regularity)
        return x

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        start = self._motion.t
        try:
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # detected after the step
                self._motion.advance(t)
        except np.linalg.LinAlgError as error:
            raise Diverged(f"{error}, between t = {start:.6g} s and {t:.6g} s") from None
        except Stalled as error:
            raise Diverged(f"{error}; {pose(self._mechanism, self.sample())}") from None

    def drive(self, values: Array) -> None:
        """See :class:`proofroll.core.engine_abilities.TakesTargets`."""
        drive(self._mechanism, values)
        if self._switched is not None:
            self._switched.renew()
        elif isinstance(self._motion, Integrator):
            self._motion.restart()

    def _solved(self) -> SolvedState:
        if self._touching:
            return self._touching.solve()[0]
        return self._switched.solve() if self._switched else self._equations.solve(self._state)

    def events(self) -> Sequence[Event]:
        """See :class:`proofroll.core.engine_abilities.LocatesEvents`."""
        switching = self._switched or self._touching
        return tuple(switching.events) if switching else ()

    def sample(self) -> MechanismSample:
        """See :class:`proofroll.core.engine.Engine`."""
        equations, x = self._equations, self._state
        solved = self._solved()
        # with contacts, joint reactions are not reported: contact forces are not among the loads from which they follow
        force, torque = unsaid(self._mechanism) if self._touching else equations.reactions(solved)
        r, q, v, _ = equations.parts(x)
        R, w = solved.bodies.rotation, solved.bodies.spin
        arm = np.einsum("nij,nj->ni", R, equations.com)
        return MechanismSample(
            p_WB=r - arm,
            v_WB=v - cross(w, arm),
            w_WB=w,
            q_WB=q / np.linalg.norm(q, axis=1, keepdims=True),
            joint_force=force,
            joint_torque=torque,
            effort=equations.efforts(solved.bodies) if self._mechanism.actuators else None,
            coupling=solved.multipliers[equations.loop_rows : equations.moved.start],
            drive=of_drives(self._mechanism, solved.multipliers[equations.moved]),
            **(self._switched.along_joints(len(self._mechanism.joints)) if self._switched else {}),
            **(self._touching.sampled(len(self._mechanism.joints)) if self._touching else {}),
        )

    def built(self) -> MechanismBuilt:
        """See :class:`proofroll.core.engine.Engine`."""
        equations = self._equations
        solved = self._solved()
        bodies, count, joints = solved.bodies, len(equations.mass), len(self._mechanism.joints)
        R, w = bodies.rotation, bodies.spin
        arm = np.einsum("nij,nj->ni", R, equations.com)
        turning = np.einsum("nij,nj->ni", R, solved.angular)
        ends, rows = equations.connections.ends(bodies), equations.constraint_rows(bodies)
        rank = row_rank(rows)
        axes = np.full((joints, 3), np.nan)
        for number, joint in enumerate(self._mechanism.joints):
            if joint.kind in WITH_AXIS:
                axes[number] = ends.A[number, :, 2]
        return MechanismBuilt(
            mass=equations.mass.copy(),
            com=equations.com.copy(),
            inertia=equations.inertia.copy(),
            joint_position=(ends.place + bodies.origin)[:joints],
            joint_axis=axes,
            gravity=equations.gravity.copy(),
            rows=len(rows),
            rank=rank,
            mobility=6 * count - rank,
            acceleration=solved.linear - cross(turning, arm) - cross(w, cross(w, arm)),
            angular_acceleration=turning,
            **(self._touching.read() if self._touching else {}),
        )
