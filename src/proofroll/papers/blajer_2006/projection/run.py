"""Formulations ``euler`` and ``rotating_frame``: run of a ball by the projection method, as in the article."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.engine_abilities import Level
from proofroll.core.errors import Diverged, Refused
from proofroll.core.formulations import Formulation
from proofroll.core.integrators import INTEGRATORS, Integrator
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.engines.projection.adapter import ELIMINATION
from proofroll.papers.blajer_2006.ball.as_body import RunOnBody, on_body, rolling_ball
from proofroll.papers.blajer_2006.ball.model import ALL_OF_A_BALL, NO_OTHER_BODIES, RollingBall
from proofroll.papers.blajer_2006.ball.sampling import BallBuilt, BallSample, terms_held
from proofroll.papers.blajer_2006.projection.geometry import Uniform, matrix
from proofroll.papers.blajer_2006.projection.method import ProjectedBall, start_and_scales
from proofroll.papers.blajer_2006.projection.orientation import EulerAngles, FollowedFrame, Orientation, RotatingFrame
from proofroll.papers.blajer_2006.projection.settings import PRESETS, ProjectionBallSettings
from proofroll.papers.blajer_2006.projection.taylor import TaylorSeries

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
