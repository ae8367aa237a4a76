"""Sample of a ball on a surface: its state with the wall's reaction; and the model read back from the engine."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from proofroll.core.arrays import FloatArray
from proofroll.core.engine import Regularised, Sample
from proofroll.elements.ball_on_surface.model import BallCapability


@dataclass(frozen=True, slots=True)
class BallSample(Sample):
    """State of a ball, whose frame has its origin at the centre and is not turned at time 0, and reaction of the wall.

    Attributes:
        force: of the wall on the ball at the contact point, -N e1 + F2 e2 + F3 e3 [N], shape (3,). None at time 0
            alone: the engine defines reactions only after a first step.
        sticking: whether the contact holds by static friction; only where friction is bounded.
    """

    widths: ClassVar[Mapping[str, int]] = {**Sample.widths, "force": 3}

    force: FloatArray | None = None
    sticking: bool | None = None


@dataclass(frozen=True)
class BallBuilt:
    """Model of a ball read back from the engine (never from the scene). None: the engine cannot say.

    Attributes:
        mass: of the ball [kg].
        inertia: central inertia of the ball, principal values [kg m²], shape (3,).
        gravity: acceleration of gravity in the world [m/s²], shape (3,).
        ball_radius: [m].
        rolling_resistance: f [m]; 0 where nothing of the kind was built. None counts as missing where f > 0.
        mu_static, mu_kinetic: coefficients of friction [1]; inf where friction has no bound. None counts as missing
            where friction is bounded.
        gap: distance of the ball from the engine's own wall at time 0 [m].
        acceleration: of the ball's centre at time 0 [m/s²], shape (3,).
        angular_acceleration: of the ball at time 0 in the world [rad/s²], shape (3,).
        terms: the optional parts that are in the built model: rolling resistance, bounded friction, orientation.
        regularised: names of certificate quantities (``gap``, ``slip``, ``spin``, ``acceleration``, ``N``, ``F2``, …)
            that the model softens, with tolerance and reason, as far as :data:`certificate.CAPS` lets it:
            mass, inertia, gravity, radius and position along the wall are never soft. Tolerances of acceleration, N,
            F2 and F3 are relative to :func:`mechanics.natural_acceleration`; one of ``1 / static friction``,
            where the scene has no bound and the engine needs a number, to 1/mu.
    """

    mass: float | None = None
    inertia: FloatArray | None = None
    gravity: FloatArray | None = None
    ball_radius: float | None = None
    rolling_resistance: float | None = None
    mu_static: float | None = None
    mu_kinetic: float | None = None
    gap: float | None = None
    acceleration: FloatArray | None = None
    angular_acceleration: FloatArray | None = None
    terms: frozenset[str] | None = None
    regularised: Mapping[str, Regularised] = field(default_factory=dict)


def terms_held(*, resists: object, slips: object = False, turns: object = False) -> frozenset[str]:
    """Terms of a model besides rolling, for :attr:`BallBuilt.terms`.

    Rolling resistance, friction that is bounded, and the ball's orientation.
    """
    held = {"ROLLING_RESISTANCE": resists, "BOUNDED_FRICTION": slips, "ORIENTATION": turns}
    return frozenset(BallCapability[name] for name, is_there in held.items() if is_there)
