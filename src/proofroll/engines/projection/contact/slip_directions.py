"""Directions of slips from step to step, and their last step, in which the direction is kept."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from proofroll.core.arrays import cross
from proofroll.elements.mechanism.contact.modes import Acting, slip_velocity
from proofroll.elements.mechanism.contact.touching import Touching
from proofroll.elements.mechanism.scene.rotations import Array

_ANGLE = 1e-13  # accuracy of the angle between a slip and the direction that forces give to it [rad]
_NUDGE = 1e-4  # second guess of that angle [rad]
_GENTLE = 0.1  # rate of a slip that forces lead, relative to what friction makes of it


def balanced(against: Array, along: Array) -> bool:
    """True if friction nearly balances what drives a slip, from the rates where it acts against and along it."""
    return bool(np.linalg.norm(against) <= _GENTLE * np.linalg.norm(along - against) / 2)


def led_direction(heading: Array, normal: Array, rate: Callable[[Array], Array]) -> Array:
    """Direction, near a first one, in which a slip changes in size only; unit vectors, shape (3,).

    Args:
        heading: the first direction.
        normal: of the contact.
        rate: rate of the slip if friction acts against a direction, (3,).
    """
    from scipy.optimize import newton

    aside = cross(normal, heading)
    aside /= np.linalg.norm(aside)
    ahead = cross(aside, normal)

    def at(angle: float) -> Array:
        return np.asarray(math.cos(angle) * ahead + math.sin(angle) * aside)

    def turning(angle: float) -> float:
        return float(rate(at(angle)) @ (math.cos(angle) * aside - math.sin(angle) * ahead))

    return at(float(newton(turning, 0.0, x1=_NUDGE, tol=_ANGLE, disp=False)))


class SlipDirections:
    """Unit vector of each slip at the start of a step.

    A slip that stops turns infinitely fast in the stages of a step that pass the stop, and a fixed step would let it
    circle about zero for good. A slip that a fixed step ends, by the rate of the step before, keeps its direction.

    Friction turns the velocity of a slip the more quickly, the slower it is, towards the direction that the forces
    change in size only; explicit steps would get ever shorter towards rest. Where steps adapt, a slow slip has that
    direction, which is wrong by the square of its speed: one from rest, and one that gently comes near it.
    """

    def __init__(self, step: float, least: Array, slow: Array, near: float) -> None:
        """Takes the size of a fixed step [s], 0 if it adapts, and speeds of each contact [m/s].

        Args:
            step: 0: steps adapt.
            least: speeds that count as rest.
            slow: speeds up to which forces may lead a slip.
            near: its angle from the direction that they give, up to which they do [rad].
        """
        self._step, self._still, self._slow, self._near = step, least, slow, near
        self._toward: list[Array] = []
        self._speeds: list[float] = []
        self._time = 0.0
        self._last_step: list[bool] = []
        self._led: list[bool] = []

    def begin(self, mode: Sequence[Acting]) -> None:
        """Starts with the directions of a mode, one for each contact."""
        self._toward = [np.array(contact_mode.heading or (0.0, 0.0, 0.0)) for contact_mode in mode]
        self._speeds, self._last_step = [0.0] * len(mode), [False] * len(mode)
        self._led = [contact_mode.heading is not None and contact_mode.along is None for contact_mode in mode]

    def look(
        self, t: float, mode: Sequence[Acting], touching: Sequence[Touching], leading: Callable[[int], Array]
    ) -> None:
        """Stores the directions of slips at the time ``t`` [s]; ``leading``: the one that forces give to a contact."""
        span, self._time = t - self._time, t
        for k, (contact_mode, touch) in enumerate(zip(mode, touching, strict=True)):
            if contact_mode.kind != "slip":
                continue
            speed = float(np.linalg.norm(slip_velocity(touch)))
            self._last_step[k] = False
            self._toward[k] = self.heading(k, touch)
            self._last_step[k] = 0.0 < speed * span <= (self._speeds[k] - speed) * self._step
            self._speeds[k] = speed
            toward = self._toward[k]
            slow = speed <= self._slow[k] and contact_mode.along is None and bool(toward.any())
            self._led[k] = slow and (self._led[k] or float(toward @ leading(k)) >= math.cos(self._near))

    def led(self, k: int) -> bool:
        """True if forces lead a slip in this step."""
        return self._led[k]

    def goes_on(self, k: int, slip: Sequence[float]) -> bool:
        """True if a slip has the direction of its velocity [m/s]: it does not end, and forces do not lead it."""
        (x, y, z), (u, v, w) = slip, self._toward[k].tolist()
        ends = self._last_step[k] or self._led[k] or math.hypot(x, y, z) <= self._still[k]
        return not ends and x * u + y * v + z * w >= 0

    def passed(self, k: int, touch: Touching) -> float:
        """Speed against the direction at the start of the step [m/s]; positive: the slip has ended."""
        return -float(slip_velocity(touch) @ self._toward[k])

    def heading(self, k: int, touch: Touching) -> Array:
        """Direction of a slip; of one that counts as rest, and after its end within a step, the direction before."""
        slip, toward = slip_velocity(touch), self._toward[k]
        speed = float(np.linalg.norm(slip))
        if self._last_step[k] or speed <= self._still[k]:
            return toward
        return np.asarray(slip / speed if slip @ toward >= 0 else -slip / speed)
