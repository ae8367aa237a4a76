"""Formulations of a ball that rolls in a cylinder in Exudyn, what each has, and their settings."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.engine import presets_of
from proofroll.core.engine_abilities import Level
from proofroll.core.formulations import Formulation
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.engines.exudyn.adapter import NEW_JACOBIAN, require_frames
from proofroll.engines.exudyn.integration import ExudynModel, Integration
from proofroll.engines.exudyn.native import Output, items
from proofroll.engines.exudyn.settings import OWN, VELOCITIES, ExudynSettings
from proofroll.papers.blajer_2006.ball.as_body import RunOnBody, on_body, rolling_ball
from proofroll.papers.blajer_2006.ball.model import ALL_OF_A_BALL, NO_OTHER_BODIES, RollingBall
from proofroll.papers.blajer_2006.ball.sampling import BallBuilt, BallSample
from proofroll.papers.blajer_2006.exudyn.ball import add_ball
from proofroll.papers.blajer_2006.exudyn.carrier import Carrier


class RollingDisc(ExudynModel):
    """A rigid ball and one re-aimed ``ObjectJointRollingDisc``; needs no generators of the surface.

    The joint constrains the velocity of the contact point of a disc on a plane. Re-aiming the plane's normal and the
    disc's axis before every Newton residual makes the disc's lowest point the ball's contact point.
    """

    def __init__(self, body: RollingBall, settings: ExudynSettings) -> None:
        super().__init__()
        ground = self.system.AddObject(items.ObjectGround())
        self.ball = add_ball(self.system, body)
        plane = self.system.AddMarker(items.MarkerBodyRigid(bodyNumber=ground))
        frame = body.surface.frame(body.u0)
        self.joint = self.system.AddObject(
            items.ObjectJointRollingDisc(
                markerNumbers=[plane, self.ball.marker],
                discRadius=body.ball.radius,
                discAxis=frame[:, 1],
                planeNormal=-frame[:, 0],
            )
        )
        self.system.SetPreNewtonResidualUserFunction(self._aiming(body))
        self.system.Assemble()
        # d/dt (v + a ω × e1) = v̇ + a ω̇ × e1 + a ω × ė1, in the directions of the joint's rows; the last term comes
        # from the re-aiming, which Exudyn does not differentiate.
        turning = body.ball.radius * np.cross(body.w0, body.surface.normal_gradient(body.p0) @ body.v0)
        self.integration = Integration(self.system, settings, {self.joint: -self._directions().T @ turning})

    def _aiming(self, body: RollingBall) -> Any:
        """User function that turns the joint to the wall's tangent plane at the ball; called at every iterate."""
        frame = body.surface.triad
        node, joint = self.ball.node, self.joint
        position, rotation = Output.Position, Output.RotationMatrix

        def aim(system: Any, t: float, newton_iteration: int, discontinuous_iteration: int) -> None:  # noqa: ARG001 -- Exudyn's signature
            x, y, z = system.GetNodeOutput(node, position).tolist()
            x1, y1, z1, x2, y2, z2, _, _, _ = frame(x, y, z)
            xx, xy, xz, yx, yy, yz, zx, zy, zz = system.GetNodeOutput(node, rotation).tolist()
            axis = [x2 * xx + y2 * yx + z2 * zx, x2 * xy + y2 * yy + z2 * zy, x2 * xz + y2 * yz + z2 * zz]
            system.SetObjectParameter(joint, "planeNormal", [-x1, -y1, -z1])
            system.SetObjectParameter(joint, "discAxis", axis)  # e2 in the ball's frame

        return aim

    def _directions(self) -> FloatArray:
        """Lateral, longitudinal and normal direction of the joint in the world, as columns."""
        return np.asarray(self.system.GetObjectOutput(self.joint, Output.RotationMatrix).reshape(3, 3))

    def sample(self) -> BallSample:
        """See :class:`proofroll.core.engine.Engine`."""
        return self.ball.sample(self._directions() @ self.system.GetObjectOutput(self.joint, Output.ForceLocal))

    def built(self) -> BallBuilt:
        """See :class:`proofroll.core.engine.Engine`. The joint holds velocities only and knows no distance."""
        return self.ball.built(self.system.GetObject(self.joint)["discRadius"], None)


RUNS: Mapping[str, Callable[[RollingBall, ExudynSettings], ExudynModel]] = {
    "carrier": Carrier,
    "rolling_disc": RollingDisc,
}


@dataclass(frozen=True)
class ExudynBallSettings(ExudynSettings):
    """Settings of a ball that rolls in a cylinder.

    Attributes:
        formulation: ``carrier`` (rigid ball on a massless carrier, built-in joints only) or ``rolling_disc`` (the
            engine's rolling-disc joint, re-aimed at every iterate).
    """

    formulation: Literal["carrier", "rolling_disc"] = "carrier"

    @staticmethod
    def _presets() -> Mapping[str, Mapping[str, ExudynSettings]]:
        return PRESETS


# Exudyn's own step, a hundredth of the simulated time, would be 1e-2 s for one second, in which the ball turns by 1.6
# rad. So ``default`` shows Exudyn's options, not a script that sets no step.
# Its tolerance of 1e-8 matters: with rolling resistance it moves z by about 1e-6 m at dt = 1e-3, and leaves noise of
# 0.3 N in the carrier's F2. With rigid bodies, ρ = 0.9 stops being stable where the ball turns by more than about 0.3
# rad per step.
_FINE: Mapping[str, Any] = {"dt": 1e-4, "newton_tolerance": 1e-10, "jacobian": "step"}
_DAMPED: Mapping[str, Any] = {**OWN, **_FINE, "spectral_radius": 0.8}
PRESETS: Mapping[str, Mapping[str, ExudynBallSettings]] = presets_of(
    ExudynBallSettings,
    {
        "carrier": {
            "default": OWN,
            # A new Jacobian at every step costs less than the seven iterations per step that an old one needs.
            "matched": {**VELOCITIES, **_FINE},
            # Index 3 keeps the gap closed to round-off (index 2 lets it open by 1e-7 m), slips less and is a little
            # more accurate without rolling resistance. ρ = 0.8 damps the multipliers enough to stay stable up to half a
            # radian of spin per step (0.9: up to 0.3) at the price of a tenth more energy error; 0.6 costs twice the
            # energy error.
            "tuned": _DAMPED,
        },
        "rolling_disc": {
            "default": OWN,
            # The joint is a constraint on velocities only, and its re-aiming disturbs the multipliers a little at every
            # step: the damping of generalized-alpha keeps them quiet (ρ as above), the trapezoidal rule lets them ring
            # (F2 is off by 1e-3 N instead of 2e-5 N, and z by twice as much).
            "matched": _DAMPED,
        },
    },
)


def _run(scene: Scene, settings: ExudynBallSettings) -> RunOnBody:
    """Run of the scene's ball. Raises Refused: this Exudyn is too old for the carrier's joints."""
    if settings.formulation == "carrier":
        require_frames(settings.formulation)
    return on_body(RUNS[settings.formulation](rolling_ball(scene), settings), scene)


FORMULATIONS: Mapping[str, Formulation] = {
    name: Formulation(
        presets=PRESETS[name],
        provides=ALL_OF_A_BALL,
        level=Level.CONSTRAINT,
        build=_run,
        lacking=NO_OTHER_BODIES,
        inherent={MechanismCapability.ORIENTATION: "the rigid body's Euler parameters are coordinates of its node"},
        terms=(NEW_JACOBIAN,),
    )
    for name in RUNS
}
