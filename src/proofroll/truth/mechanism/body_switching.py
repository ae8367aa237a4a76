"""Route 2 for mechanisms with dry friction, stops or effort limits: maximal coordinates, modes by trial."""

import itertools
from collections.abc import Iterator, Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import NotUnique, Refused
from proofroll.elements.mechanism.drives import MODES
from proofroll.elements.mechanism.rotations import Array
from proofroll.elements.mechanism.switches import HOLDING, REDUNDANT, STOPPED, Mode, SwitchedJoint
from proofroll.truth.hybrid import Stretch, StretchLaw, Transition
from proofroll.truth.mechanism.joint_stretches import JointStretches, guard_values, near_stops, noise_of, reversed_mode
from proofroll.truth.mechanism.maximal_coordinates import NumericEquations
from proofroll.truth.mechanism.maximal_equations import Switched

_MOST = 6  # largest number of joints at rest of which all modes are tried: each has up to three
_ROUNDS = 20  # exchanges of modes at most, for each joint at rest
SLACK = 1e-9  # violation of an inequality, relative to the forces involved, up to which it counts as kept


class SwitchedBodies(JointStretches):
    """Stretches of a mechanism in the coordinates of its separate bodies; the last component of a state is the time.

    Implements :class:`proofroll.truth.hybrid.HybridRoute`.
    """

    def __init__(self, equations: NumericEquations, joints: tuple[SwitchedJoint, ...], tolerance: float) -> None:
        self.equations, self.joints = equations, joints
        mechanism = equations.equations.mechanism
        self._numbers = [joint.number for joint in joints]
        self._limited = [k for k, actuator in enumerate(mechanism.actuators) if actuator.limit is not None]
        self.limited = tuple(mechanism.actuators[k] for k in self._limited)
        self._driven = [mechanism.joint_index[actuator.joint] for actuator in self.limited]
        super().__init__(len(equations.equations.start()) + 1, tolerance)

    @property
    def start(self) -> Array:
        """State at time 0."""
        return np.append(self.equations.equations.start(), 0.0)

    def bodies(self, state: Array) -> tuple[Array, Array, Array, Array]:
        """Places, velocities, quaternions and angular velocities of all bodies, world axes."""
        views = self.equations.equations.at(self.equations.normalised(state[:-1]).tolist()).views[:-1]
        R, r, v, w = (np.array([getattr(view, name) for view in views], float) for name in ("R", "r", "v", "w"))
        coms = np.array([body.com for body in self.equations.equations.mechanism.bodies])
        arm = np.einsum("nij,nj->ni", R, coms)
        return r - arm, v - np.cross(w, arm), Rotation.from_matrix(R).as_quat(scalar_first=True), w

    def begin(self) -> Transition[Mode]:
        """See the protocol."""
        state = self.start
        # on a body that moves, rates of joints at rest are of round-off
        joints = self.equations.equations.mechanism.joints
        mode, margin = self._decided(state, [not any(joints[number].v0) for number in self._numbers])
        return Transition(state, mode, (), margin)

    def _law(self, state: Array, mode: Mode) -> StretchLaw:
        equations = self.equations.switched(state[:-1], self.switched(mode))
        return StretchLaw(
            rates=lambda y: np.append(equations.rate(float(y[-1]), y[:-1]), 1.0),
            guards=lambda y: self._guards(equations, y, mode),
            corrected=lambda y: np.append(equations.eliminated(y[:-1]), y[-1]),
            noise=noise_of(self.joints, self.limited, mode, *self._along(state), self._wanted(state)),
            near=near_stops(self.joints, mode),
        )

    def _at_rest(self, stretch: Stretch[Mode], state: Array, stopped: Sequence[int]) -> tuple[Array, Mode, float]:
        still = [own in HOLDING or k in stopped for k, own in enumerate(stretch.mode[: len(self.joints)])]
        return state, *self._decided(state, still, stopped)

    def _hit(self, stretch: Stretch[Mode], state: Array, which: int, _: float) -> tuple[Array, Mode, float, float]:
        last, joint, delay = state, self.joints[which], 0.0
        speed = abs(float(self._along(last)[1][which]))
        state, margin = self._struck(last, stretch.mode, which, joint.restitution)
        if self._settles(which, speed, joint.restitution):
            laws = (
                self.equations.switched(state[:-1], self.switched(m))
                for m in (reversed_mode(stretch.mode, which), stretch.mode)
            )
            pull, falling = (abs(float(self._accelerations(law, state)[which])) for law in laws)
            delay = self._bouncing(joint.name, speed * joint.restitution, pull, joint.restitution, falling)
            state, margin = self._struck(last, stretch.mode, which, 0.0)
        rates = self._along(state)[1]
        still = [
            (own in {"low", "high"} and abs(rates[k]) <= SLACK * speed)
            or (k == which and (delay > 0 or not joint.restitution))
            for k, own in enumerate(stretch.mode[: len(self.joints)])
        ]
        decided, after = self._decided(state, still)
        return state, decided, min(margin, after), delay

    def switched(self, mode: Mode) -> Switched:
        """Changes of the equations in a mode."""
        pairs = list(zip(self.joints, mode, strict=False))
        held = tuple(joint.number for joint, own in pairs if own in HOLDING)
        stopped = tuple(joint.number for joint, own in pairs if own in STOPPED)
        push = {joint.number: joint.push(own) for joint, own in pairs if joint.push(own)}
        actuators = zip(self._limited, self.limited, mode[len(self.joints) :], strict=True)
        clamped = {k: actuator.bound * (MODES.index(own) - 1) for k, actuator, own in actuators if own != "linear"}
        return Switched(held, stopped, push, clamped)

    def holding(self, equations: NumericEquations, state: Array, mode: Mode) -> Array:
        """Force of dry friction or of a stop along each switched joint's coordinate, N or N m."""
        held = [number for number, own in enumerate(mode) if own in HOLDING]
        force = np.array([joint.push(own) for joint, own in zip(self.joints, mode, strict=False)])
        if held:
            solved = equations.solve(equations.normalised(state[:-1]), float(state[-1]))
            force[held] = solved.multipliers[-len(held) :]
        return force

    def _guards(self, equations: NumericEquations, state: Array, mode: Mode) -> FloatArray:
        q, v = self._along(np.append(equations.normalised(state[:-1]), state[-1]))
        force = self.holding(equations, state, mode)
        return guard_values(self.joints, self.limited, mode, q, v, force, self._wanted(state))

    def _along(self, state: Array) -> tuple[Array, Array]:
        return self.equations.along(state[:-1], self._numbers)

    def _wanted(self, state: Array) -> list[float]:
        """Efforts of the actuators that have a limit, before it is applied, N or N m."""
        q, v = self.equations.along(self.equations.normalised(state[:-1]), self._driven)
        return [float(m.wanted(state[-1], *at)) for m, *at in zip(self.limited, q, v, strict=True)]

    def _accelerations(self, equations: NumericEquations, state: Array) -> Array:
        """Accelerations of all switched joints along their coordinates, m/s² or rad/s²."""
        acceleration = equations.solve(state[:-1], float(state[-1])).acceleration
        rows = self.equations.equations.rate_rows(state[:-1].tolist(), self._numbers)
        return np.array([sum(c * acceleration[k] for k, c in r.coefficients.items()) + r.bias for r in rows], float)

    def _decided(self, state: Array, still: Sequence[bool], stopped: Sequence[int] = ()) -> tuple[Mode, float]:
        """Mode that satisfies all inequalities, and its margin: relative distance from violating one.

        Args:
            state: with velocity zero, within round-off, of the joints at rest.
            still: True for switched joints at rest; those with velocity zero count too.
            stopped: joints just stopped by friction: they are not at a stop, even if close to one.

        Raises:
            Refused: no mode does, too many joints are at rest, or friction and joints hold a coordinate twice.
        """
        state = np.append(self.equations.normalised(state[:-1]), state[-1])
        q, v = self._along(state)
        modes = zip(self.limited, self._wanted(state), strict=True)
        efforts = tuple(actuator.mode_of(wanted) for actuator, wanted in modes)
        choices = [
            list(_candidates(joint, float(q[k]), still[k], k in stopped))
            if still[k] or v[k] == 0
            else [joint.moving(float(v[k]))]
            for k, joint in enumerate(self.joints)
        ]
        open_ = [k for k, choice in enumerate(choices) if len(choice) > 1]
        if not open_:
            return tuple(choice[0] for choice in choices) + efforts, np.inf
        if len(open_) > _MOST:
            return self._exchanged(state, choices, efforts, open_)
        best, redundant = tuple[float, Mode]((-np.inf, ())), False
        for joints in itertools.product(*choices):
            mode = joints + efforts
            equations = self.equations.switched(state[:-1], self.switched(mode))
            if equations.rank < self.equations.rank + sum(own in HOLDING for own in mode):
                redundant = True  # where joints that share one degree of freedom hold it; they may turn together
                continue
            force, acceleration = self.holding(equations, state, mode), self._accelerations(equations, state)
            kept = min(self._kept(k, mode[k], float(force[k]), float(acceleration[k]), state) for k in open_)
            best = max(best, (kept, mode))
        if redundant and best[0] <= SLACK:
            raise Refused(REDUNDANT)
        if best[0] < -SLACK:
            raise Refused("no mode of the joints with friction or stops keeps all its inequalities")
        return best[1], max(best[0], 0.0)

    def _exchanged(
        self, state: Array, choices: Sequence[Sequence[str]], efforts: Mode, open_: Sequence[int]
    ) -> tuple[Mode, float]:
        """Mode and margin of many joints at rest, found by changing one joint's mode at a time.

        The first joint whose inequality is violated starts to move, or is held again (Murty's least index).

        Raises:
            Refused: no mode is found, or friction and joints hold a coordinate twice.
        """
        joints = [choice[0] for choice in choices]
        for _ in range(_ROUNDS * len(open_)):
            mode = (*joints, *efforts)
            equations = self.equations.switched(state[:-1], self.switched(mode))
            if equations.rank < self.equations.rank + sum(own in HOLDING for own in mode):
                raise Refused(REDUNDANT)
            force, acceleration = self.holding(equations, state, mode), self._accelerations(equations, state)
            kept = {k: self._kept(k, mode[k], float(force[k]), float(acceleration[k]), state) for k in open_}
            wrong = next((k for k in open_ if kept[k] < -SLACK), None)
            if wrong is None:
                return mode, max(min(kept.values()), 0.0)
            held = joints[wrong] in HOLDING
            pushed = self.joints[wrong].moving(1.0 if float(force[wrong]) < 0 else -1.0)
            joints[wrong] = pushed if held and pushed in choices[wrong] else choices[wrong][0 if not held else -1]
        raise Refused(f"no mode of {len(open_)} joints with friction or stops at rest keeps all its inequalities")

    def _kept(self, which: int, mode: str, force: float, acceleration: float, state: Array) -> float:
        """Margin of a joint's inequality, relative to the forces involved; negative: it is violated."""
        joint = self.joints[which]
        if mode in HOLDING:
            low, high = joint.bounds(mode)
            size = abs(force) + sum(abs(bound) for bound in (low, high) if np.isfinite(bound))
            return min(high - force, force - low) / size if size else np.inf
        q = float(self._along(state)[0][which])
        away = 1.0 if abs(q - joint.low) < abs(q - joint.high) else -1.0  # direction away from the nearer stop
        direction = {"forward": 1.0, "backward": -1.0}.get(mode, away)
        stuck = self.equations.switched(state[:-1], Switched((joint.number,)))
        needed = abs(float(stuck.solve(state[:-1], float(state[-1])).multipliers[-1]))
        response = self._accelerations(self.equations.switched(state[:-1], Switched(push={joint.number: 1.0})), state)
        free = self._accelerations(self.equations.switched(state[:-1], Switched()), state)
        inertia = 1.0 / float((response - free)[which])
        size = needed + abs(acceleration) * inertia + joint.friction
        return direction * acceleration * inertia / size if size else np.inf

    def _struck(self, last: Array, before: Mode, which: int, restitution: float) -> tuple[Array, float]:
        """State after an impact of one joint on its stop, and the margin of this outcome.

        Joints that rest on their stops are pressed on, or leave.

        Raises:
            Refused: no outcome satisfies all inequalities.
            NotUnique: the outcome depends on the order of several impacts.
        """
        state = np.append(self.equations.normalised(last[:-1]), last[-1])
        _, v = self._along(state)
        resting = [k for k, own in enumerate(before) if own in STOPPED and k != which]
        joints, e = self.joints, self.equations.equations
        side = {k: 1.0 if before[k] == "low" else -1.0 for k in resting} | {which: -float(np.sign(v[which]))}
        best: tuple[float, Array, int] = (-np.inf, state, 0)
        for count in range(len(resting) + 1):
            for pressed in itertools.combinations(resting, count):
                held = [which, *pressed]
                after = [-restitution * float(v[which]), *([0.0] * count)]
                u, impulse = self.equations.struck(state[:-1], [joints[k].number for k in held], after)
                trial = state.copy()
                trial[e.nx : e.nx + e.nu] = u
                rates = self._along(trial)[1]
                speed = max(abs(float(v[which])), np.finfo(float).tiny)
                largest = float(np.abs(impulse).max())
                kept = [side[k] * float(p) / largest for k, p in zip(held, impulse, strict=True)]
                kept += [side[k] * float(rates[k]) / speed for k in resting if k not in pressed]
                if min(kept) > best[0]:
                    best = min(kept), trial, count
        if best[0] < -SLACK:
            raise Refused("no outcome of an impact on several stops keeps all its inequalities")
        if best[2] and (restitution or any(joints[k].restitution for k in resting)):
            raise NotUnique(
                "an impact presses several stops at once: with restitution its outcome depends on their order"
            )
        return best[1], max(best[0], 0.0)


def _candidates(joint: SwitchedJoint, q: float, came: bool, turns: bool) -> Iterator[str]:
    """Modes that a joint at rest may take; one that came to rest has the errors of its motion."""
    stop = joint.stop_at(q, SLACK * max(1.0, abs(joint.low)) if came else 0.0)
    if turns:
        yield from ("stick", "forward", "backward")
    elif stop:
        yield from (stop, joint.moving(1.0 if stop == "low" else -1.0))
    elif joint.friction:
        yield from ("stick", "forward", "backward")
    else:
        yield "free"
