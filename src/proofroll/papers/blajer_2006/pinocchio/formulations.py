"""Formulation ``composite`` of a ball that rolls in a cylinder with Pinocchio: its run and what it has."""

import dataclasses
from collections.abc import Callable, Mapping

import numpy as np
import pinocchio as pin

from proofroll.core.engine_abilities import Level, Term
from proofroll.core.errors import Refused
from proofroll.core.formulations import Formulation
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.papers.blajer_2006.ball.as_body import RunOnBody, on_body, rolling_ball
from proofroll.papers.blajer_2006.ball.model import ALL_OF_A_BALL, NO_OTHER_BODIES, RollingBall
from proofroll.papers.blajer_2006.ball.sampling import BallBuilt, BallSample, terms_held
from proofroll.papers.blajer_2006.pinocchio.composite import Composite
from proofroll.papers.blajer_2006.pinocchio.integrators import (
    Adaptive,
    SemiImplicitEuler,
    TangentIntegrator,
    TangentRungeKutta4,
)
from proofroll.papers.blajer_2006.pinocchio.settings import PRESETS, CompositeSettings

_INTEGRATORS: Mapping[str, Callable[[Composite, CompositeSettings], TangentIntegrator]] = {
    "dop853": Adaptive,
    "semi_implicit_euler": SemiImplicitEuler,
    "rk4": TangentRungeKutta4,
    "rk4_dexpinv": TangentRungeKutta4,
}
_ORIENTATION = Term(
    name="orientation",
    formulations=("composite",),
    on={"orientation": True},
    off={"orientation": False},
    because="turns the ball's own axes; its inertia is the same about all of them, so the motion does not ask for it",
)


class RowsRun:
    """Run of a ball with constraint rows; see :class:`proofroll.core.engine.Engine` for the methods."""

    def __init__(self, body: RollingBall, settings: CompositeSettings) -> None:
        """Starts at time 0; ``settings.orientation`` decides if the orientation is integrated, not the scene."""
        self.mechanism = Composite(body, bool(settings.orientation))
        self.motion = _INTEGRATORS[settings.integrator](self.mechanism, settings)
        self._looked_at = self.mechanism.model.createData()  # for sampling, which leaves the running data alone

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        self.motion.advance(t)

    def sample(self) -> BallSample:
        """See :class:`proofroll.core.engine.Engine`; no orientation unless it is integrated."""
        model, ball, data = self.mechanism.model, self.mechanism.ball, self._looked_at
        force = self.motion.reaction(data)[1]
        velocity = pin.getVelocity(model, data, ball, pin.LOCAL_WORLD_ALIGNED)
        pose = data.oMi[ball]
        return BallSample(
            p_WB=pose.translation.copy(),
            v_WB=velocity.linear.copy(),
            w_WB=velocity.angular.copy(),
            q_WB=np.roll(pin.Quaternion(pose.rotation).coeffs(), 1) if self.motion.turns else None,
            force=force,
        )

    def built(self) -> BallBuilt:
        """See :class:`proofroll.core.engine.Engine`: from the model, and from rows and torques at the present state."""
        mechanism, q, v = self.mechanism, self.motion.q, self.motion.v
        model, data, ball = mechanism.model, mechanism.model.createData(), mechanism.ball
        inertia = model.inertias[ball]
        # The spin comes last, in orthonormal axes: there the row of slip has the norm a, and
        # rolling resistance the norm f. At rest the resistance has no direction, so it is evaluated for a motion along
        # that row.
        row = mechanism.rows(data, q, v).rows[-2].copy()
        torque = mechanism.rows(data, q, row).resistance
        acceleration = self.motion.reaction(data)[0]
        pin.forwardKinematics(model, data, q, v, acceleration)
        of_ball = pin.getClassicalAcceleration(model, data, ball, pin.LOCAL_WORLD_ALIGNED)
        return BallBuilt(
            mass=float(inertia.mass),
            inertia=np.linalg.eigvalsh(inertia.inertia),
            gravity=model.gravity.linear.copy(),
            ball_radius=float(np.linalg.norm(row[-3:])),
            rolling_resistance=float(np.linalg.norm(torque[-3:])),
            gap=None,  # the joints hold the ball on the wall
            acceleration=of_ball.linear.copy(),
            angular_acceleration=of_ball.angular.copy(),
            terms=terms_held(resists=torque.any(), turns=self.motion.turns),
        )


def _run(scene: Scene, settings: CompositeSettings) -> RunOnBody:
    """Run of the scene's ball, with the orientation if the scene requires it.

    Raises:
        Refused: the scene requires the orientation, and the settings exclude it.
    """
    asked = MechanismCapability.ORIENTATION in scene.requires
    if asked and settings.orientation is False:
        raise Refused(f"needs {MechanismCapability.ORIENTATION}, which orientation=false leaves out")
    if settings.orientation is None:
        settings = dataclasses.replace(settings, orientation=asked)
    return on_body(RowsRun(rolling_ball(scene), settings), scene)


FORMULATIONS: Mapping[str, Formulation] = {
    "composite": Formulation(
        presets=PRESETS["composite"],
        provides=ALL_OF_A_BALL,
        level=Level.CONSTRAINT,
        build=_run,
        lacking=NO_OTHER_BODIES,
        terms=(_ORIENTATION, "projection"),
    )
}
