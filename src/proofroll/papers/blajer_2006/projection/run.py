"""Formulations ``euler`` and ``rotating_frame``: run of a ball by the projection method, as in the article."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from typing_extensions import override

from proofroll.core.arrays import FloatArray
from proofroll.core.engine import presets_of
from proofroll.core.engine_abilities import Level
from proofroll.core.errors import Diverged, Refused
from proofroll.core.formulations import Formulation
from proofroll.core.heyoka_library import TIGHTEST, require_heyoka
from proofroll.core.integrators import INTEGRATORS, Integrator
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.engines.projection.adapter import ELIMINATION
from proofroll.engines.projection.settings import ProjectionSettings
from proofroll.papers.blajer_2006.ball.as_body import RunOnBody, on_body, rolling_ball
from proofroll.papers.blajer_2006.ball.compiled.projection import Formulation as Unknowns
from proofroll.papers.blajer_2006.ball.compiled.projection import parameters, projected, structure
from proofroll.papers.blajer_2006.ball.compiled.series import Renewed, Series, still_moving
from proofroll.papers.blajer_2006.ball.model import ALL_OF_A_BALL, NO_OTHER_BODIES, RollingBall
from proofroll.papers.blajer_2006.ball.sampling import BallBuilt, BallSample, terms_held
from proofroll.papers.blajer_2006.projection.geometry import Uniform, matrix
from proofroll.papers.blajer_2006.projection.method import ProjectedBall, start_and_scales
from proofroll.papers.blajer_2006.projection.orientation import EulerAngles, FollowedFrame, Orientation, RotatingFrame


@dataclass(frozen=True)
class ProjectionBallSettings(ProjectionSettings):
    """Settings of the projection method for a ball.

    In ``rotating_frame`` no step leaves a violation of the rolling constraints, for there they are linear with constant
    coefficients, but round-off does, and it grows.

    Attributes:
        formulation: ``euler``, the paper's angles, with a singularity, or ``rotating_frame``, the angular velocity
            along the local axes, without. The angles are always part of the equations; in the rotating frame the
            orientation is followed, as a quaternion, only for a scene that asks for it.
        singularity: action of ``euler`` near θ = 0 and π: ``renew``, choose the body's axes anew and say so, or
            ``stop``, as the paper's equations do by themselves.
    """

    formulation: Literal["euler", "rotating_frame"] = "euler"
    singularity: Literal["renew", "stop"] = "renew"

    @override
    def _rules(self) -> Iterator[tuple[bool, str, str]]:
        yield from super()._rules()
        advice = "only mechanisms have compiled equations; leave it out, or take integrator=taylor"
        yield self.equations == "compiled", "equations", advice
        advice = f"{self.formulation} has no angles, hence no singularity; leave it out, or take formulation=euler"
        yield self.singularity == "stop" and self.formulation != "euler", "singularity", advice

    @property
    @override
    def unused(self) -> tuple[str, ...]:
        without = () if self.formulation == "euler" else ("singularity",)
        return (*super().unused, *without, "equations")


_SETTINGS: Mapping[str, Mapping[str, object]] = {
    "default": {"integrator": "rk4"},
    "matched": {},
    "tuned": {"integrator": "taylor", "rtol": TIGHTEST},
}


PRESETS: Mapping[str, Mapping[str, ProjectionBallSettings]] = presets_of(
    ProjectionBallSettings, dict.fromkeys(("euler", "rotating_frame"), _SETTINGS)
)


# Components of the state without the ball's orientation: two coordinates and five velocities.
_WITHOUT_ORIENTATION = 7
_ANGLES = {MechanismCapability.ORIENTATION.value: "the Euler angles are coordinates of the equations of motion"}


class ProjectionBall:
    """A ball on any surface that guides it; see :class:`proofroll.core.engine.Engine` for the methods."""

    def __init__(self, body: RollingBall, settings: ProjectionBallSettings, *, follow: bool = False) -> None:
        """Ball at time 0; ``follow``: integrate its orientation too if the formulation does not need it."""
        self._surface = body.surface
        self._orientation: Orientation
        if settings.formulation == "euler":
            self._orientation = EulerAngles(renews=settings.singularity == "renew")
        else:
            self._orientation = FollowedFrame() if follow else RotatingFrame()
        self._coordinates = 2 + self._orientation.size
        periodic = [True, False, *self._orientation.periodic]
        self._angles = [index for index, whole in enumerate(periodic) if whole]
        self._ball = ProjectedBall(body, Uniform(body.surface), self._orientation)
        self._eliminate = settings.eliminates
        self._fixed_step = settings.dt if settings.resolution == "dt" else 0.0
        resolution, (x, scales) = getattr(settings, settings.resolution), start_and_scales(body, self._orientation)
        self._motion: Integrator | TaylorSeries
        if settings.integrator == "taylor":
            self._motion = TaylorSeries(body, settings.formulation, x, resolution, self._check, self._accepted)
        else:
            self._motion = INTEGRATORS[settings.integrator](resolution)
            self._motion.begin(0.0, x, self._ball.rates, self._accept, scales)

    def _check(self, t: float, x: FloatArray) -> None:
        n = self._coordinates
        if not math.isfinite(float(x.sum())):
            raise Diverged(f"the state is not finite (NaN or overflow) at t = {t:.6g} s")
        self._orientation.check(t, x[2:n], x[n + 2 :], self._fixed_step)

    def _accept(self, t: float, x: FloatArray) -> FloatArray:
        self._check(t, x)
        return self._accepted(t, x)

    def _accepted(self, t: float, x: FloatArray) -> FloatArray:
        """State from which the motion goes on, without violations and away from the singularity."""
        x = self._ball.eliminated(x) if self._eliminate else x
        renewed = self._renewed(t, x)
        return self._within_a_turn(x if renewed is None else renewed)

    def _within_a_turn(self, x: FloatArray) -> FloatArray:
        """State with each angle less than a turn from zero.

        Nothing depends on whole turns, but round-off and the tolerance of a step are relative to the largest component
        of the state: after ten thousand turns the angles would be accurate to eleven digits only, and so would the
        rolling.
        """
        beyond = [index for index in self._angles if abs(x.item(index)) > math.tau]
        if beyond:
            x = x.copy()
            x[beyond] -= math.tau * np.trunc(x[beyond] / math.tau)
        return x

    def _renewed(self, t: float, x: FloatArray) -> FloatArray | None:
        """State in other angles, or None if these are kept; see :meth:`Orientation.renewed`."""
        n = self._coordinates
        renewed = self._orientation.renewed(t, x[2:n], x[n + 2 :])
        return None if renewed is None else np.concatenate([x[:2], renewed[0], x[n : n + 2], renewed[1]])

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        start = self._motion.t
        try:
            with np.errstate(over="ignore", invalid="ignore"):  # detected by _check, and raised as Diverged
                self._motion.advance(t)
        except ArithmeticError as error:
            raise Diverged(f"{error}, between t = {start:.6g} s and {t:.6g} s") from None

    def remarks(self) -> Sequence[str]:
        """See :class:`proofroll.core.engine_abilities.TellsRemarks`."""
        times = self._orientation.renewals if isinstance(self._orientation, EulerAngles) else []
        if not times:
            return ()
        often = "once, at" if len(times) == 1 else f"{len(times)} times, first at"
        return (f"near the Euler-angle singularity the body's axes were chosen anew {often} t = {times[0]:.6g} s",)

    def sample(self) -> BallSample:
        """See :class:`proofroll.core.engine.Engine`."""
        x = self._motion.x
        kin = self._ball.kinematics(x)
        frame = matrix(kin.frame)
        if isinstance(self._motion, TaylorSeries):
            force = self._motion.force
        else:
            force = self._ball.contact_force(self._ball.response(kin))
        return BallSample(
            p_WB=self._surface.position(x[:2]),
            v_WB=frame @ kin.v[:3],
            w_WB=frame @ kin.v[3:],
            q_WB=self._orientation.quaternion(x[2 : self._coordinates]),
            force=frame @ force,
        )

    def built(self) -> BallBuilt:
        """See :class:`proofroll.core.engine.Engine`."""
        ball, x = self._ball, self._motion.x
        kin = ball.kinematics(x)
        frame = matrix(kin.frame)
        rates = self._motion.rates if isinstance(self._motion, TaylorSeries) else ball.rates(x)
        acceleration = ball.velocity_rate(kin, rates[self._coordinates : self._coordinates + 5].tolist())
        return BallBuilt(
            mass=ball.mass,
            inertia=np.full(3, ball.inertia),
            gravity=frame @ ball.weight(kin),
            ball_radius=ball.radius,
            rolling_resistance=ball.rolling_resistance,
            acceleration=frame @ acceleration[:3],
            angular_acceleration=frame @ acceleration[3:],
            terms=terms_held(resists=ball.rolling_resistance, turns=len(x) > _WITHOUT_ORIENTATION),
        )


def _run(scene: Scene, settings: ProjectionBallSettings) -> RunOnBody:
    """Run of the scene's ball. Raises Refused: the compiled series do not follow the orientation."""
    follow = MechanismCapability.ORIENTATION in scene.requires
    if follow and settings.integrator == "taylor" and settings.formulation == "rotating_frame":
        raise Refused("the compiled series do not follow the orientation; use integrator=dop853")
    return on_body(ProjectionBall(rolling_ball(scene), settings, follow=follow), scene)


FORMULATIONS: Mapping[str, Formulation] = {
    name: Formulation(
        presets=presets,
        provides=ALL_OF_A_BALL,
        level=Level.PROJECTION,
        build=_run,
        lacking=NO_OTHER_BODIES,
        inherent=_ANGLES if name == "euler" else {},
        terms=(ELIMINATION,),
    )
    for name, presets in PRESETS.items()
}


class TaylorSeries(Series):
    """Motion of a ball that rolls without slip, in the state x = [q, s], with steps as long as the tolerance allows.

    A step is exact to the last digits, and the equations keep C v constant, so only round-off violates the constraints.
    It accumulates over thousands of oscillations, and is removed like any other violation.
    """

    def __init__(
        self,
        body: RollingBall,
        formulation: Unknowns,
        x: FloatArray,
        rtol: float,
        check: Callable[..., None],
        accepted: Renewed,
    ) -> None:
        """Starts at time 0 in the state x, with the relative tolerance ``rtol`` of a step [1].

        After each step ``check`` is called with time [s] and state, and raises Diverged if it is not reliable;
        ``accepted`` gives the state from which the motion goes on, see ``Renewed`` of :mod:`compiled.series`.

        Raises:
            Missing: heyoka is not installed.
        """
        require_heyoka("integrator=taylor")
        model = projected(structure(body, formulation), rtol)
        self._pars, self._evaluate = parameters(body), model.evaluate
        self._trust, self._resistance = check, body.contact.rolling_resistance > 0
        self._scales, self._mass = np.array(body.surface.length_scales), body.ball.mass
        pars = np.array(self._pars[: len(model.integrator.pars)])
        super().__init__(model.integrator, pars, x, self._look, accepted)

    def _look(self, old_state: FloatArray, t: float, x: FloatArray) -> None:
        self._trust(t, x)
        if self._resistance:
            still_moving(self._along(old_state), t, self._along(x))

    def _along(self, x: FloatArray) -> FloatArray:
        """Velocity of the centre along the coordinates [m/s], shape (2,)."""
        return np.asarray(x[-5:-3] * self._scales)

    @property
    def rates(self) -> FloatArray:
        """Present time derivative ẋ."""
        return self._evaluate(self.x, self._pars)[:-3]

    @property
    def force(self) -> FloatArray:
        """Present force of the wall on the ball in local axes, (-N, -λ1, -λ2) [N], shape (3,)."""
        return -self._mass * self._evaluate(self.x, self._pars)[-3:]
