"""Protocol of a contact mode: its own state y and equations, and the margins that end it."""

from __future__ import annotations

import math
from enum import Enum, auto
from typing import NamedTuple, Protocol

from proofroll.core.arrays import FloatArray

# Slower than this part of the pace of the motion, a contact point or a centre stands still: 1e-14 s before it does.
_STILL = 1e-13
# Slower than this part of the pace, a ball that could rest where it is comes to rest: it has some 1e-11 m to go.
_SETTLED = 1e-5
# Differences over this part of the time scale: 1e-12 of round-off and 1e-4 of curvature in the rate of a force.
DIFFERENCE = 1e-4


class Exit(Enum):
    """Reason that a mode ends."""

    CONE = auto()  # sticking: the needed friction left the static cone
    HALT = auto()  # sticking with rolling resistance: the centre stands still
    STILL = auto()  # slipping: the contact point stands still
    LIFTOFF = auto()  # slipping: the normal force reached zero
    CHANGE = auto()  # slipping: the other description is due


class Survey(NamedTuple):
    """Survey of a mode after a step.

    Attributes:
        margins: one per exit of the mode; the mode holds while none is negative.
        trend: rate of the margin number ``dips``, the one that may turn negative and recover within one step; 0 where
            it is too large for that.
        longest: bound on the next step [s].
        slaved: whether the direction of the slip may be slaved from here on.
    """

    margins: tuple[float, ...]
    trend: float = 0.0
    dips: int = 0
    longest: float = math.inf
    slaved: bool = False


class Pace(NamedTuple):
    """Natural scales of the motion, and limits of the integrator.

    Attributes:
        speed, time: natural size of speeds [m/s] and times [s].
        stability, reach: of the integrator, see :class:`proofroll.core.integrators.Integrator`.
    """

    speed: float
    time: float
    stability: float
    reach: float

    @property
    def still(self) -> float:
        """Below this speed [m/s] a contact point, or a centre, stands still."""
        return _STILL * self.speed

    @property
    def settled(self) -> float:
        """Below this speed [m/s] of the centre a ball that could rest where it is comes to rest."""
        return _SETTLED * self.speed


class ContactMode(Protocol):
    """One mode of contact."""

    @property
    def sticking(self) -> bool:
        """True if the contact holds by static friction."""

    @property
    def exits(self) -> tuple[Exit, ...]:
        """Exits that can end it, in the order of :attr:`Survey.margins`."""

    def rates(self, y: FloatArray) -> FloatArray:
        """ẏ."""

    def x(self, y: FloatArray) -> FloatArray:
        """Coordinates and velocities [q, s]."""

    def eliminated(self, y: FloatArray) -> FloatArray:
        """The state with C v brought to the slip that y says."""

    def survey(self, y: FloatArray) -> Survey:
        """Margins of the mode to its end."""

    def force(self, y: FloatArray) -> FloatArray:
        """Force of the wall on the ball along the local axes [N], shape (3,)."""


def time_left(size: float, growth: float) -> float:
    """Time until a size reaches zero at its present rate."""
    return size / -growth if growth < 0 else math.inf
