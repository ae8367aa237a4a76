"""Formulation ``geoms``: a mechanism of :mod:`~proofroll.engines.mujoco.smooth.mechanism` whose bodies may touch."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar

import mujoco
import numpy as np
from typing_extensions import override

from proofroll.core.arrays import longest
from proofroll.core.engine import Regularised
from proofroll.core.errors import Refused
from proofroll.core.events import Event
from proofroll.elements.mechanism.run.capabilities import ALL_SHAPES, MechanismCapability
from proofroll.elements.mechanism.run.contacts.family import Family, of_contact
from proofroll.elements.mechanism.run.sampling import DEPENDENT, MechanismBuilt, MechanismSample, mechanism_of
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.engines.mujoco.contact.contact_states import ContactStates
from proofroll.engines.mujoco.contact.mechanism_contacts import Contacts, check_contacts, times_softer
from proofroll.engines.mujoco.contact.rolling_resistance import RollingResistance
from proofroll.engines.mujoco.contact.walls import Walls, curved_end
from proofroll.engines.mujoco.running import evaluate_behind, silent
from proofroll.engines.mujoco.settings import LARGEST_IMPEDANCE, MujocoSettings, check, check_restitution
from proofroll.engines.mujoco.smooth import mechanism
from proofroll.engines.mujoco.smooth.mechanism import MujocoMechanism

_CAPABILITY = MechanismCapability
# Rounds for the lift of slip; each at least halves its error.
_ROUNDS = 40
# Margin of what hard contacts would change. With J̇v they start as deep as the soft ones and keep half of the slip that
# this depth makes, so as much again is missing.
_MARGIN, _OF_DEPTH = 1.1, 2.0
# Evaluations of a start with velocities that lag: each halves the error along the rows of contacts.
_LAGS = 41
# Factor on the share of the load that the impedance does not carry, for it acts on the bodies with lever arms.
_OF_LOAD = 10.0
_SOFT = (
    "contacts are soft, start without load, lift what slips and lack the turning of their normals (J̇v); hard ones "
    "would change that much"
)
PROVIDES = mechanism.PROVIDES | {_CAPABILITY.CONTACT, _CAPABILITY.CONTACT_FRICTION, _CAPABILITY.CONTACT_REBOUNDS}
PROVIDES |= ALL_SHAPES | {_CAPABILITY.UNBOUNDED_FRICTION, _CAPABILITY.TURNING_FRICTION, _CAPABILITY.ORIENTATION}
PROVIDES |= {_CAPABILITY.SHARED_CONE}
LACKING: Mapping[str, str] = {
    **mechanism.LACKING,
    _CAPABILITY.STATIC_FRICTION: "this formulation gives a contact one coefficient",
    _CAPABILITY.SLIP_REBOUNDS: "this formulation sets restitution along the normal alone",
}


def family(settings: MujocoSettings) -> Mapping[str, str]:
    """See :class:`proofroll.core.engine_abilities.TellsFamily`."""
    elliptic = Family.HARD if settings.cone_correction else Family.CONVEX
    kind = Family.PYRAMID if settings.cone == "pyramidal" else elliptic
    return of_contact(kind, time=settings.contact_time if settings.time_constant is None else None)


# Steps made at once where nothing is done in each: what lasts longer is seen, and located to this many steps.
_AT_ONCE = 2


class MujocoGeoms(MujocoMechanism):
    """Run of a mechanism with contacts; see :class:`proofroll.core.engine.Engine` for the methods."""

    provides: ClassVar[frozenset[str]] = PROVIDES
    lacking: ClassVar[Mapping[str, str]] = LACKING
    _resistance: RollingResistance | None = None  # before the model is there

    def __init__(self, scene: Any, settings: MujocoSettings) -> None:
        mechanism = mechanism_of(scene)
        check(settings)
        if mechanism.prescribed or all(curved_end(contact) is None for contact in mechanism.contacts):
            # nothing to curve, or motions, whose rows take velocities for those of the positions
            settings = replace(settings, curvature=False)
        check_contacts(mechanism, settings)
        if any(pair.restitution for pair in mechanism.pairs):
            check_restitution(settings)
        super().__init__(mechanism, settings)
        self._contacts = Contacts(self._model, mechanism, settings)
        self._states = ContactStates(self._contacts, mechanism, settings)
        self._watched = False
        self._resistance = RollingResistance(self._model, mechanism, settings, self._contacts)
        self._walls = Walls(self._model, mechanism)
        velocities = self._data.qvel.copy()
        rounds = 2 if self._resistance else 1  # its torque belongs to the forces at the start
        for number in range(rounds):
            if settings.curvature:
                with silent():
                    self._start_behind(2 * settings.velocity_lag / settings.contact_time, velocities)
            if self._resistance and not number:
                self._resistance.begin(self._evaluated(), self._data)

    def _start_behind(self, share: float, velocities: Array) -> None:
        """Takes the ``velocities`` at the start back by their lag, and loads the contacts of curved walls.

        An evaluation leaves the part ``share`` of an error of accelerations.
        """
        self._data.qvel[:] = velocities
        evaluate_behind(self._data, self._evaluate_step, self._settings.velocity_lag, share, _LAGS)
        self._walls.lift(self._contacts.depths(self._data))
        self._data.qvel[:] = velocities
        evaluate_behind(self._data, self._evaluate_step, self._settings.velocity_lag, share, _LAGS)

    def spec(self, portable: bool = False) -> Any:
        """MjSpec, whose keyframe ``start`` is time 0. Raises Refused if each step poses or edits the contacts."""
        if self._walls:
            raise Refused("the plane that stands for a curved wall is posed in every step, and in no MJCF")
        if self._settings.cone_correction:
            raise Refused("the correction of the cone is made in every step, and in no MJCF; set cone_correction=false")
        if self._resistance:
            raise Refused("the torque of rolling resistance is computed in every step, and in no MJCF")
        return super().spec(portable)

    def _run(self, steps: int) -> None:
        edits = self._settings.cone_correction or self._settings.curvature
        observes = bool(self._states.events) and (self._watched or bool(self._resistance))
        if not (edits or observes or self._resistance or self._walls):
            super()._run(steps)
            return
        if not (edits or self._resistance or self._walls):
            for made in range(0, steps, _AT_ONCE):
                super()._run(min(_AT_ONCE, steps - made))
                self._states.observe(self._data)
            return
        for _ in range(steps):
            self._walls.pose(self._data)
            if edits:
                self._step_edited()
            else:
                super()._run(1)
            if observes:
                self._states.observe(self._data)
            if self._resistance:
                self._resistance.remember(self._data, self._data.time - self._states.behind)

    def _step_edited(self) -> None:
        """Makes one step with edited reference accelerations."""
        self._contacts.watch(self._data)
        self._motions.apply(self._data)
        mujoco.mj_step1(self._model, self._data)
        self._drive(self._model, self._data)
        self._edit(self._data, remember=True)
        mujoco.mj_step2(self._model, self._data)

    def watch_events(self) -> None:
        """See :class:`proofroll.core.engine_abilities.WatchesEvents`; resistance looks at its contacts anyway."""
        self._watched = True

    def events(self) -> Sequence[Event] | None:
        """See :class:`proofroll.core.engine_abilities.LocatesEvents`."""
        return self._states.events.events() if self._watched else None

    @property
    @override
    def _applies(self) -> bool:
        return super()._applies or bool(self._resistance)

    @override
    def _drive(self, _: Any, data: Any) -> None:
        super()._drive(_, data)
        if self._resistance:
            if not super()._applies:
                data.xfrc_applied[:] = 0.0
            foreseen = self._resistance.foreseen(float(data.time))
            moments = self._resistance.apply(data, foreseen, self._states, self._resistance.of_step)
            if data is self._data:
                self._resistance.of_step = moments

    def _edit(self, data: Any, *, remember: bool = False) -> None:
        """Corrects the reference accelerations of contacts as the settings ask."""
        if self._settings.curvature:
            self._contacts.add_curvature(data)
        rows = self._rows(data, data.nefc)
        if self._settings.cone_correction:
            self._contacts.correct(data, rows)
        if remember:
            self._contacts.remember(data, rows)

    def _evaluate_step(self, data: Any) -> None:
        """Computes forces and accelerations of the state in ``data`` as a step would, with velocities that may lag."""
        super()._evaluate(data)

    def _evaluate(self, data: Any) -> None:
        super()._evaluate(data)
        if self._settings.curvature:
            data.qvel += self._settings.velocity_lag * data.qacc
            mujoco.mj_fwdVelocity(self._model, data)

    def _forward(self, data: Any) -> None:
        self._forward_once(data)
        if self._resistance:
            self._resist(self._resistance, data)
            self._forward_once(data)

    def _resist(self, resistance: RollingResistance, data: Any) -> None:
        """Puts the torques of rolling resistance under the present normal forces into ``data``."""
        if super()._applies:
            self._loads.apply(data)
        else:
            data.xfrc_applied[:] = 0.0
        resistance.apply(data, resistance.pressing(data), self._states, resistance.applied)

    def _forward_once(self, data: Any) -> None:
        self._walls.pose(data)
        if not (self._settings.cone_correction or self._settings.curvature):
            super()._forward(data)
            return
        self._contacts.watch(data)
        mujoco.mj_fwdPosition(self._model, data)
        mujoco.mj_fwdVelocity(self._model, data)
        self._edit(data)
        mujoco.mj_fwdActuation(self._model, data)
        mujoco.mj_fwdAcceleration(self._model, data)
        mujoco.mj_fwdConstraint(self._model, data)
        mujoco.mj_sensorAcc(self._model, data)

    @override
    def sample(self) -> MechanismSample:
        sample = super().sample()
        return replace(sample, contact_force=self._contacts.forces(self._scratch))

    @override
    def built(self) -> MechanismBuilt:
        plain = super().built()
        with self._without_steps(), self._walls.unlifted():
            read = self._contacts.read(self._evaluated(), self._rows)
        contacts = {f"contact_{name}": value for name, value in read._asdict().items()}
        if self._resistance is not None:
            contacts["contact_rolling"] = self._resistance.levers + contacts["contact_rolling"]
        if not self._evaluated().ncon:
            return replace(plain, **contacts)
        softened, forces = dict(plain.regularised), self._forces(self._evaluated())
        with self._without_steps():
            data = self._evaluated()
            hard, hard_forces = self._hard(data), self._forces(data)
        load = (
            (1 - LARGEST_IMPEDANCE)
            * max(_OF_LOAD, times_softer(self._mechanism))
            * float(np.linalg.norm(self._mechanism.gravity))
        )
        margin = _MARGIN * (_OF_DEPTH if self._settings.curvature else 1.0)
        for name, expected in hard.items():
            size = longest(expected) or np.finfo(float).tiny
            rest = load / (longest(hard["acceleration"]) or np.finfo(float).tiny)
            difference = longest(expected - getattr(plain, name)) / size
            softened[name] = Regularised(margin * difference + rest + DEPENDENT, _SOFT)
        least = max(softened[name].tolerance for name in hard)
        for name, expected in hard_forces.items():
            size = np.nanmax(np.abs(expected)) or np.finfo(float).tiny
            share = max(margin * float(np.nanmax(np.abs(expected - forces[name])) / size), least)
            loops = plain.regularised.get(name)
            softened[name] = Regularised(share + (0.0 if loops is None else loops.tolerance), _SOFT)
        return replace(plain, **contacts, regularised=softened)

    def _hard(self, data: Any) -> dict[str, Array]:
        """Accelerations from MuJoCo's own equations with the largest impedance, with J̇v and without the cone's lift.

        The same keys and shapes as :meth:`_accelerations`.
        """
        model = self._model
        kept = model.pair_solimp.copy(), model.dof_solimp.copy()
        MujocoSettings("geoms").set_solver(model.opt)
        model.pair_solimp[:, :2] = model.dof_solimp[:, :2] = LARGEST_IMPEDANCE
        try:
            self._solve_hard(data)
            if self._resistance:
                self._resist(self._resistance, data)
                self._solve_hard(data)
            return self._accelerations(data)
        finally:
            model.pair_solimp[:], model.dof_solimp[:] = kept
            self._settings.set_solver(model.opt)

    def _solve_hard(self, data: Any) -> None:
        """Computes forces and accelerations of the present state, with J̇v and without the cone's lift."""
        mujoco.mj_forward(self._model, data)
        self._contacts.add_turning(data)
        reference = data.efc_aref.copy()
        for _ in range(_ROUNDS):
            rates = self._rows(data, data.nefc) @ data.qacc
            data.efc_aref[:] = reference
            self._contacts.take_lift(data, rates)
            mujoco.mj_fwdConstraint(self._model, data)
