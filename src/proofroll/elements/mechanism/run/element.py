"""A mechanism as an element of a scene: what the harness calls."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from proofroll.core.arrays import FloatArray, longest, read_only
from proofroll.core.columns import Columns
from proofroll.core.element import FirstMotion, OptionalTerm, Sign, StepNumber
from proofroll.core.element_abilities import RunWatch
from proofroll.core.engine import Regularised
from proofroll.core.errors import Refused
from proofroll.core.events import events_of
from proofroll.core.observable import Observable, Role
from proofroll.core.program_text import FailedRun
from proofroll.core.time_grid import EVERY
from proofroll.core.whole_turns import PART
from proofroll.elements.mechanism.contact.start import extent, followed_moves, natural_length
from proofroll.elements.mechanism.dynamics.analysis import Analysis, analyse
from proofroll.elements.mechanism.dynamics.held_signals import Commands, along, at_start, has_held, placed_start
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates, Solution
from proofroll.elements.mechanism.dynamics.link_forces import link_observables
from proofroll.elements.mechanism.dynamics.named_forces import named_forces
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.dynamics.switches import first_change, with_stops_at_start
from proofroll.elements.mechanism.reading.plausibility import implausible
from proofroll.elements.mechanism.run.capabilities import MechanismCapability, required
from proofroll.elements.mechanism.run.certificate import CAPS, certify
from proofroll.elements.mechanism.run.contacts.local_frame import local_observables, local_sizes, observe_locally
from proofroll.elements.mechanism.run.contacts.observables import contact_observables, event_observables
from proofroll.elements.mechanism.run.contacts.on_wall import BodyOnWall, LocalStart, body_on_wall, exceeds_grip
from proofroll.elements.mechanism.run.contacts.stretches import held_in_flight
from proofroll.elements.mechanism.run.dataset import from_samples
from proofroll.elements.mechanism.run.failure_program import program
from proofroll.elements.mechanism.run.optional_terms import optional_terms
from proofroll.elements.mechanism.run.sampling import MechanismSample
from proofroll.elements.mechanism.run.scales import scales
from proofroll.elements.mechanism.run.sentences import start_facts
from proofroll.elements.mechanism.run.step_limits import ServoSteps, law_rates, servo_steps, step_numbers
from proofroll.elements.mechanism.scene.joint_kinds import TURNING, JointKind
from proofroll.elements.mechanism.scene.model import Mechanism

if TYPE_CHECKING:
    import xarray as xr

    from proofroll.core.certificate import Line
    from proofroll.core.scene import Scene
    from proofroll.elements.mechanism.contact.modes import ContactMode
    from proofroll.elements.mechanism.contact.states import ContactSolution
    from proofroll.elements.mechanism.contact.tree_contacts import ContactDynamics

# Least scale of an observable, relative to its natural size, as for balls: smaller changes count as stillness.
_LEAST = 1e-2
# Growth of energy that is a failure, relative to the largest kinetic energy, where nothing drives the mechanism: all
# growth is then the engine's error, and runs within 1 % of the path stay far below.
GAIN = 0.1
# Opening of joints and loops that is a failure, relative to the mechanism's size: beyond, it is another mechanism.
OPEN = 0.1
ENERGY_GAIN, OPENED = "energy gain", "joints opened"
# Time of the first look at an engine without a step, relative to the natural time.
_PART = 1e-4
# Rate of a freedom on springs and servos of joints, relative to the fastest, below which they do not hold it.
_HELD = 1e-7
_AXES = "xyz"


@dataclass(frozen=True)
class MechanismElement:
    """Bodies that joints, loops, springs and contacts connect. See :class:`proofroll.core.element.Element`.

    Attributes:
        mechanism: its data.
        caps: quantities that a model may soften, with the largest difference that is accepted for any reason.
        local: ball whose motion and force are described in the local frame of its wall, see
            :mod:`proofroll.elements.mechanism.run.contacts.local_frame`; None: none.
    """

    mechanism: Mechanism
    local: LocalStart | None = None

    sample_type: ClassVar[type[MechanismSample]] = MechanismSample
    softened: ClassVar[frozenset[str]] = frozenset(CAPS)
    caps: ClassVar[Mapping[str, Regularised]] = CAPS
    failing_events: ClassVar[Mapping[str, str]] = {}
    askable: ClassVar[Mapping[str, str]] = {}

    @property
    def name(self) -> str:
        """See the protocol; a scene has at most one mechanism that is no ball on its wall."""
        return "mechanism" if self.local is None else self.local.ball

    @property
    def bodies(self) -> tuple[str, ...]:
        """See the protocol."""
        return tuple(body.name for body in self.mechanism.bodies)

    @cached_property
    def analysis(self) -> Analysis:
        """Rank, mobility, and which reactions are determinate."""
        return read_only(analyse(self.mechanism))

    @property
    def failures(self) -> Mapping[str, str]:
        """See the protocol."""
        return {
            OPENED: f"joints or loops opened by more than {OPEN:.0%} of the mechanism's size",
            ENERGY_GAIN: f"the energy grew by more than {GAIN:.0%} of what its weight or speed can make",
        }

    @cached_property
    def requires(self) -> frozenset[str]:
        """See the protocol."""
        capability = MechanismCapability
        return frozenset(required(self.mechanism) | ({capability.REDUNDANT} if self.analysis.redundant else set()))

    def another_scene(self, lines: Sequence[Mapping[str, Any]], truth: xr.Dataset) -> str | None:
        """See :class:`proofroll.core.element_abilities.KnowsAnotherScene`.

        A finite coefficient that stands for unbounded friction changes nothing while a motion needs less. Where it
        needs more, the ball slips in the engine though it cannot in the scene.
        """
        if self.on_wall is None or not np.isinf(self.on_wall.contact.mu_static):
            return None
        return exceeds_grip(lines, truth["needed_friction"].to_numpy())

    def commands(self) -> Commands | None:
        """See :class:`proofroll.core.element_abilities.HoldsTargets`."""
        return Commands(self.mechanism) if has_held(self.mechanism) else None

    def along(self, run: xr.Dataset | None) -> MechanismElement | None:
        """See :class:`proofroll.core.element_abilities.HoldsTargets`."""
        targets = along(self.mechanism, run)
        return None if targets is None else self if targets is self.mechanism else replace(self, mechanism=targets)

    def begun(self, values: Mapping[str, float]) -> MechanismElement | None:
        """See :class:`proofroll.core.element_abilities.BeginsAnywhere`; trees of joints with one coordinate each."""
        mechanism = self.mechanism
        joints = [joint for joint in mechanism.joints if joint.nv]
        names = {f"{kind}.{joint.name}" for joint in joints for kind in "qv"}
        bound = mechanism.loops or mechanism.couplings or any(joint.motion or joint.nv > 1 for joint in joints)
        if bound or not names <= values.keys():
            return None
        begun = [
            replace(item, q0=(values[f"q.{item.name}"],), v0=(values[f"v.{item.name}"],)) if item.nv else item
            for item in mechanism.joints
        ]
        return replace(self, mechanism=replace(mechanism, joints=tuple(begun)))

    @cached_property
    def start(self) -> Placed:
        """Motion of the mechanism at time 0."""
        return placed_start(self.mechanism)

    @property
    def start_facts(self) -> Sequence[str]:
        """See :class:`proofroll.core.element_abilities.TellsStart`."""
        return start_facts(self)

    @property
    def implausible(self) -> Sequence[str]:
        """See :class:`proofroll.core.element_abilities.DoubtsNumbers`."""
        return implausible(self.mechanism)

    @property
    def free_points(self) -> Sequence[str]:
        """See :class:`proofroll.core.element_abilities.MovesFreely`."""
        scene = self.mechanism
        if scene.contacts or scene.links or scene.loops:
            return ()
        free = {joint.child for joint in scene.joints if joint.kind == JointKind.FREE}
        return tuple(point.name for point in scene.points if point.body in free)

    @cached_property
    def _equations(self) -> JointCoordinates:
        return JointCoordinates(with_stops_at_start(at_start(self.mechanism)))

    @cached_property
    def law_rates(self) -> tuple[FloatArray, FloatArray]:
        """See :func:`proofroll.elements.mechanism.run.step_limits.law_rates`."""
        return read_only(law_rates(JointCoordinates(self.mechanism, self._equations.rank)))

    def step_bound(self, taken: Iterable[float]) -> str | None:
        """See :class:`proofroll.core.element_abilities.BoundsSteps`."""
        return None if self._servo_steps is None else self._servo_steps.sentence(taken)

    @property
    def longest_step(self) -> float:
        """See :class:`proofroll.core.element_abilities.BoundsSteps`."""
        return np.inf if self._servo_steps is None else self._servo_steps.explicit

    @cached_property
    def _servo_steps(self) -> ServoSteps | None:
        return servo_steps(JointCoordinates(self.mechanism, self._equations.rank))

    @cached_property
    def _solution(self) -> Solution:
        return self._equations.solve(*self.mechanism.start())

    @cached_property
    def _switches(self) -> bool:
        return bool(self.mechanism.contacts or self._equations.switched)

    @cached_property
    def _pressed(self) -> ContactSolution | None:
        """Accelerations and forces of contacts and of laws of joints at the start; None: as of ``_touching``."""
        return None if self._touching is None else self._touching[0].solve(*self.mechanism.start(), self._touching[1])

    @cached_property
    def _touching(self) -> tuple[ContactDynamics, ContactMode] | None:
        """Equations of contacts and laws of joints, and modes at the start; None: not unique, or of a shared cone."""
        from proofroll.elements.mechanism.contact.tree_contacts import ContactDynamics

        if self._switches:
            with contextlib.suppress(Refused):
                dynamics = ContactDynamics(self._equations.mechanism)
                mode, margin = dynamics.begin()
                closed = zip(self.mechanism.contacts, mode, strict=False)
                shared = any(contact.cone == "shared" and acting.kind != "open" for contact, acting in closed)
                return (dynamics, mode) if margin and not shared else None
        return None

    @cached_property
    def noise(self) -> float:
        """Round-off of the first accelerations [m/s², rad/s²]."""
        return self._equations.sensitivity()[1]

    @cached_property
    def length(self) -> float:
        """Largest distance between joints, centres of mass, tracked points and contacts at the start [m].

        Where all of these are at one place, a length of :func:`.natural_length`, or 1 m.
        """
        return self.own_length or 1.0

    @cached_property
    def own_length(self) -> float:
        """Length of the mechanism itself [m]; 0 where all of it is at one place and nothing gives a length."""
        solution = self._solution
        return extent(self.mechanism, solution.motion) or natural_length(self.mechanism, solution)

    @cached_property
    def natural_time(self) -> float:
        """Period [s] of a pendulum of its size, or of its slowest motion on springs and servos of joints if shorter.

        Without these: of its mass on the stiffest spring between points, else the time of a turn, else 1 s.
        """
        gravity, rates = float(np.linalg.norm(self.mechanism.gravity)), self.law_rates[1]
        slowest = float(rates.min(initial=np.inf))
        slowest = slowest if slowest > _HELD * float(rates.max(initial=0.0)) and np.isfinite(slowest) else 0.0
        if gravity:
            return 2 * np.pi / max(slowest, float(np.sqrt(gravity / self.length)))
        stiffest = max((link.stiffest for link in self.mechanism.links), default=0.0)
        spin = longest(self.start.w_WB)
        return 2 * np.pi / rate if (rate := slowest or float(np.sqrt(stiffest / self.mechanism.mass)) or spin) else 1.0

    @cached_property
    def turn_interval(self) -> float | None:
        """See :class:`proofroll.core.element_abilities.CountsTurns`; None without a joint or wall to turn about."""
        if not any(joint.kind in TURNING for joint in self.mechanism.joints):
            rounds = self.on_wall is not None and any(self.on_wall.surface.periods)
            return max(EVERY, PART * self.natural_time) if rounds else None
        spin = longest(self.start.w_WB)
        # A body that turns freely does so evenly, however fast; samples at the usual rate then show its turns.
        fast = max(EVERY, PART * 2 * np.pi / spin) if spin else np.inf
        loaded = np.any(self.mechanism.gravity) or self.mechanism.links or self.mechanism.forces
        return float(min(fast, PART * self.natural_time if loaded or not spin else np.inf))

    @cached_property
    def speed(self) -> float:
        """Largest speed at the start or after a fall by its length; if none, length over natural time [m/s]."""
        moving = max(longest(self.start.v_WB), longest(self.start.w_WB) * self.length)
        fall = float(np.sqrt(self.length * np.linalg.norm(self.mechanism.gravity)))
        return max(moving, fall) or self.length / self.natural_time

    @cached_property
    def sizes(self) -> dict[str, float]:
        """Unit -> natural size, see :meth:`Mechanism.natural_sizes`."""
        return self.mechanism.natural_sizes(self.length, self.speed)

    @property
    def force(self) -> float:
        """Weight, or if larger the centripetal force of its mass at its speed and length [N]."""
        return self.sizes["N"]

    @property
    def conservative(self) -> bool:
        """True if nothing in it drives or dissipates."""
        return self.mechanism.conservative

    @cached_property
    def on_wall(self) -> BodyOnWall | None:
        """Its ball on a wall, if it is described in the local frame of that wall."""
        return None if self.local is None else read_only(body_on_wall(self.mechanism, self.local))

    @cached_property
    def observables(self) -> tuple[Observable, ...]:
        """See the protocol; those of the local frame alone if it is described in one."""
        if self.on_wall is not None:
            return local_observables(self.on_wall, self.first_motion.acceleration)
        # A point at rest has no size but that of its motion, see `scales`.
        least = {unit: _LEAST * size if self.own_length else 0.0 for unit, size in self.sizes.items()}
        a, force, turn = least["m"], least["N"], _LEAST * self.speed / self.length
        what = "tracked points" if self.mechanism.points else "centres of mass"
        moves = followed_moves(self.mechanism, self._solution.motion, self.length)
        table = [Observable("positions", "m", f"the {what}", Role.MOTION, floor=a, headline=moves, decides=moves)]
        table += [
            Observable(f"{point.name}.{axis}", "m", f"{axis} of the point {point.name}", Role.MOTION, floor=a)
            for point in self.mechanism.points
            for axis in _AXES
        ]
        for joint in self.mechanism.joints:
            if joint.nq == 1:
                unit, floor = (joint.unit, _LEAST if joint.unit == "rad" else a)
                table.append(
                    Observable(f"q.{joint.name}", unit, f"coordinate of {joint.name}", Role.MOTION, floor=floor)
                )
        more: dict[str, Any] = {"role": Role.MOTION, "asked_for": False, "watched": True}
        for key, unit, of in (("p_WB", "m", "places"), ("v_WB", "m/s", "velocities")):
            table.append(Observable(key, unit, f"{of} of the origins of the bodies' frames", floor=least[unit], **more))
        table.append(Observable("w_WB", "rad/s", "angular velocities of the bodies", floor=turn, **more))
        turns: dict[str, Any] = dict.fromkeys(("asked_for", "headline", "decides"), not moves)
        turns["watched"] = True
        table.append(Observable("attitudes", "1", "quaternions of the bodies", Role.MOTION, floor=1.0, **turns))
        of_forces, of_torques = (
            tuple(np.nonzero(self.analysis.determinate[:, part])[0].tolist()) for part in (slice(3), slice(3, None))
        )
        if of_forces:
            meaning = "determinate components of the forces on children"
            told: dict[str, Any] = {"floor": force, "headline": True, "vectors": of_forces}
            table.append(Observable("forces", "N", meaning, Role.REACTION, **told))
        if of_torques:
            meaning = "determinate components of the moments on children at their joints"
            told = {"floor": least["N m"], "vectors": of_torques}
            table.append(Observable("torques", "N m", meaning, Role.REACTION, **told))
        table += contact_observables(self.mechanism, self.sizes, _LEAST)
        table += event_observables(self.mechanism)
        for item in named_forces(self.mechanism):
            told = {"floor": least[str(item.unit)]}
            told["watched"] = item.field != "stop"  # what softened stops give in an impact is their own
            told["at_impacts"] = item.field != "friction"
            table.append(Observable(item.name, str(item.unit), item.meaning, Role.REACTION, **told))
        table += link_observables(self.mechanism, least)
        if self.conservative:
            fields: dict[str, Any] = {"hangs_on_events": False, "difference_of": "energy", "floor": least["J"]}
            fields |= {"symbol": "ΔE", "role": Role.RESIDUAL}
            table.append(Observable("energy_error", "J", "energy now minus energy at the start", **fields))
        fields = {"hangs_on_events": False, "difference_of": "p_WB", "floor": a, "asked_for": False}
        table.append(Observable("drift", "m", "how far joints and loops are open", Role.RESIDUAL, **fields))
        return tuple(table)

    def step_numbers(self, h: float, truth: xr.Dataset | None) -> Sequence[StepNumber]:
        """See the protocol."""
        return step_numbers(self, h, truth)

    @property
    def first_motion(self) -> FirstMotion:
        """See the protocol."""
        motion = self._solution.motion
        rates = self._solution.acceleration if self._pressed is None else self._pressed.acceleration
        acceleration = (motion.J @ rates + motion.bias)[:-1]
        scale = max(longest(acceleration[:, :3]), self.speed**2 / self.length)
        lasts = first_change(self._equations.switched, *self.mechanism.start(), rates)
        if self._pressed is not None and self._touching is not None:
            lasts = min(lasts, self._pressed.lasts(self._touching[1][: len(self.mechanism.contacts)]))
        elif self._switches:
            acceleration, lasts = np.full_like(acceleration, np.nan), 0.0
        moment = _PART * min(self.natural_time, lasts or np.inf)
        return FirstMotion(acceleration[:, :3], acceleration[:, 3:], scale, moment, lasts=lasts)

    @cached_property
    def first_wrench(self) -> FloatArray:
        """Wrench of each joint and loop on its child at the start: force [N] and moment [N m], (joints + loops, 6)."""
        return read_only(self._first["wrench"])

    @property
    def first_press(self) -> FloatArray:
        """Forces of contacts on their first bodies at the start [N], (contacts, 3); NaN where not determinate."""
        pressed, count = self._pressed, len(self.mechanism.contacts)
        unknown = np.full((count, 3), np.nan)
        return unknown if pressed is None else np.where(pressed.determinate, pressed.force, np.nan)[:count]

    @cached_property
    def first_named(self) -> FloatArray:
        """The named forces at the start [N, N m], see :mod:`proofroll.elements.mechanism.dynamics.named_forces`."""
        return read_only(self._first["named"])

    @cached_property
    def _first(self) -> dict[str, FloatArray]:
        start = self.mechanism.start()
        if self._touching is not None:
            with contextlib.suppress(Refused):  # what holds a joint twice has no determinate forces
                return self._touching[0].sample(*start, self._touching[1])[0]
        sample = self._equations.sample(*start)
        if not self._switches:
            return sample
        of_state = np.array([item.field == "effort" for item in named_forces(self.mechanism)], dtype=bool)
        named = np.where(of_state, sample["named"], np.nan)
        return sample | {"wrench": np.full_like(sample["wrench"], np.nan), "named": named}

    def variables(self, times: FloatArray, samples: Sequence[MechanismSample]) -> Columns:
        """See the protocol; the variables are those of :mod:`proofroll.elements.mechanism.run.dataset`."""
        return from_samples(self, times, samples)

    def lacks(self, samples: Sequence[MechanismSample], asks: Sequence[str]) -> str | None:  # noqa: ARG002 -- the protocol's
        """See the protocol."""
        lacking = any(sample.q_WB is None for sample in samples)
        return "the engine does not give the orientation of the bodies" if lacking else None

    def observe(self, dataset: xr.Dataset) -> dict[str, FloatArray]:
        """See the protocol; reactions that an engine gives in part only are left out."""
        if self.on_wall is not None:
            return observe_locally(self.on_wall, dataset)
        observed = {}
        if self.mechanism.has_events and "event_kind" in dataset:
            observed["event_times"] = np.array([event.time for event in events_of(dataset)])
        variables = dataset.variables  # indexing a dataset would make coordinates, too
        for item in (item_observable for item_observable in self.observables if item_observable.name in variables):
            values = variables[item.name].values
            values = values[1:] if item.role == Role.REACTION else values
            if not np.any(np.isnan(values)):
                observed[item.name] = values
        return observed

    def scales(self, truth: xr.Dataset) -> dict[str, float]:
        """See the protocol and :func:`proofroll.elements.mechanism.run.scales.scales`."""
        if self.on_wall is not None:
            return local_sizes(self.on_wall, truth)
        return scales(self, truth, _LEAST)

    def watch(self, asks: Sequence[str]) -> RunWatch:  # noqa: ARG002 -- the protocol's
        """See :class:`proofroll.core.element_abilities.WatchesRuns`."""
        from proofroll.elements.mechanism.run.contacts.events import ContactWatch

        return ContactWatch(self)

    def common_span(
        self, truth: xr.Dataset, runs: Mapping[Any, xr.Dataset]
    ) -> tuple[xr.Dataset, dict[Any, xr.Dataset]]:
        """Truth and runs, with a ball that rolls held where it flies: no event of a mechanism ends a run."""
        if self.on_wall is None or self.on_wall.flies:
            return truth, dict(runs)
        return held_in_flight(truth), {key: held_in_flight(run) for key, run in runs.items()}

    def certify(self, built: Any, sample: MechanismSample) -> list[Line]:
        """See the protocol."""
        return certify(self, built, sample)

    def signs(self, dataset: xr.Dataset, truth: xr.Dataset | None) -> list[Sign]:  # noqa: ARG002 -- the protocol's
        """See the protocol."""
        shown = [Sign(OPENED, dataset["drift"].to_numpy() > OPEN * self.length)]
        if self.conservative:
            energy = dataset["energy"].to_numpy()
            shown.append(Sign(ENERGY_GAIN, energy - energy[0] > GAIN * self.force * self.length))
        return shown

    def failure_program(self, failed: FailedRun, engine: str | None) -> str:
        """See :class:`proofroll.core.element_abilities.WritesPrograms`."""
        gain = GAIN * self.force * self.length if self.conservative else 0.0
        return program(self, failed, engine, gain, OPEN * self.length)

    def optional_terms(self, parameters: Mapping[str, float], truth: xr.Dataset) -> list[OptionalTerm]:  # noqa: ARG002 -- the protocol's
        """See the protocol."""
        return optional_terms(self.mechanism, parameters)


def the_mechanism(scene: Scene) -> MechanismElement:
    """The mechanism of a scene that has no other element."""
    (element,) = scene.elements
    assert isinstance(element, MechanismElement)
    return element
