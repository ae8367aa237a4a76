"""Sample of a ball with the reaction of the wall, and the model of a ball read back from the engine."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from proofroll.core.arrays import FloatArray
from proofroll.core.engine import Regularised, Sample
from proofroll.elements.mechanism.run.capabilities import MechanismCapability


@dataclass(frozen=True, slots=True)
class BallSample(Sample):
    """State of a ball and reaction of the wall; the ball's frame is at its centre, unturned at time 0.

    Attributes:
        force: of the wall on the ball at the contact point, -N e1 + F2 e2 + F3 e3 [N], shape (3,). None only at time 0,
            from engines that define reactions only after a first step.
    """

    widths: ClassVar[Mapping[str, int]] = {**Sample.widths, "force": 3}

    force: FloatArray | None = None


@dataclass(frozen=True)
class BallBuilt:
    """Model of a ball read back from the engine (never from the scene). None: the engine does not know it.

    Attributes:
        mass: of the ball [kg].
        inertia: central inertia of the ball, principal values [kg m²], shape (3,).
        gravity: acceleration of gravity in the world [m/s²], shape (3,).
        ball_radius: [m].
        rolling_resistance: f [m]; 0 if none was built. None counts as missing where the scene's f > 0.
        mu_static, mu_kinetic: coefficients of friction that stand for unbounded friction [1]; None: none does.
        gap: distance of the ball from the engine's own wall at time 0 [m].
        acceleration: of the ball's centre at time 0 [m/s²], shape (3,).
        angular_acceleration: of the ball at time 0 in the world [rad/s²], shape (3,).
        terms: optional terms in the built model: rolling resistance, orientation.
        regularised: names of certificate quantities (``gap``, ``slip``, ``spin``, ``acceleration``, ``N``, ``F2``, …)
            that the model softens, with tolerance and reason; mass, inertia, gravity, radius and position along the
            wall are never soft. Tolerances of acceleration, N, F2 and F3 are relative to
            :func:`mechanics.natural_acceleration`. A tolerance of ``1 / static friction``, for an engine that needs a
            number where the scene has no bound, is one of 1/mu.
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


def terms_held(*, resists: object, turns: object = False) -> frozenset[str]:
    """Optional terms of a model, for :attr:`BallBuilt.terms`: truth values of the arguments as capabilities.

    ``resists``: rolling resistance; ``turns``: orientation of the ball.
    """
    capability = MechanismCapability
    there = {capability.TURNING_FRICTION: bool(resists), capability.ORIENTATION: bool(turns)}
    return frozenset(need for need, is_there in there.items() if is_there)
