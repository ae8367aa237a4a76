"""Formulation ``chart``: run of a ball that rolls in a cylinder in MuJoCo."""

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from proofroll.core.engine_abilities import Level
from proofroll.core.formulations import Formulation
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.engines.mujoco.running import SteppedModel, compiled, forget_callbacks, silent
from proofroll.engines.mujoco.settings import check
from proofroll.papers.blajer_2006.ball.as_body import RunOnBody, on_body, rolling_ball
from proofroll.papers.blajer_2006.ball.mechanics import natural_acceleration
from proofroll.papers.blajer_2006.ball.model import ALL_OF_A_BALL, NO_OTHER_BODIES, RollingBall
from proofroll.papers.blajer_2006.ball.sampling import BallBuilt, BallSample, terms_held
from proofroll.papers.blajer_2006.mujoco.certificate_bounds import softness
from proofroll.papers.blajer_2006.mujoco.chart import Chart
from proofroll.papers.blajer_2006.mujoco.contact import contact_coefficient, contact_force
from proofroll.papers.blajer_2006.mujoco.model import read_spec, write_physics
from proofroll.papers.blajer_2006.mujoco.settings import PRESETS, ROLLS, TERMS, ChartSettings
from proofroll.papers.blajer_2006.mujoco.start import EVALUATIONS, accelerations, start

# Part of the natural force above which a normal force is more than round-off.
_PRESSED = 1e-6


class MujocoBall(SteppedModel):
    """A ball in a cylinder.

    The ball's orientation is in every model, asked for or not: the ball's joint has it in its state.
    """

    _settings: ChartSettings

    def __init__(self, scene: Scene, settings: ChartSettings) -> None:
        """Ball of the scene at time 0. Raises InputError or Refused for settings that it cannot have."""
        body = rolling_ball(scene)
        check(settings)
        forget_callbacks()
        self._scene = scene
        model = compiled(_spec(scene, body, settings))
        super().__init__(model, settings)
        self._body = body
        self._formulation = Chart(model, body)
        self._ball = model.body("ball").id
        self._geom = model.geom("ball").id
        self._geoms = (model.geom("wall").id, self._geom)
        with silent():
            start(model, self._data, body, settings, self._formulation)

    def spec(self) -> Any:
        """MjSpec of the scene, whose keyframe ``start`` is the present state."""
        spec = _spec(self._scene, self._body, self._settings)
        for key in list(spec.keys):
            spec.delete(key)
        spec.add_key(name="start", qpos=self._data.qpos, qvel=self._data.qvel)
        compiled(spec)
        return spec

    def _run(self, steps: int) -> None:
        self._formulation.run(self._data, steps)

    def _evaluate(self, data: Any) -> None:
        for _ in range(EVALUATIONS if self._body.contact.rolling_resistance else 1):
            self._formulation.evaluate(data)

    def sample(self) -> BallSample:
        """See :class:`proofroll.core.engine.Engine`."""
        data = self._evaluated()
        force = contact_force(self._model, data, self._geom)
        velocity = np.zeros(6)
        mujoco.mj_objectVelocity(self._model, data, mujoco.mjtObj.mjOBJ_BODY, self._ball, velocity, 0)
        return BallSample(
            p_WB=data.xpos[self._ball].copy(),
            v_WB=velocity[3:],
            w_WB=velocity[:3],
            q_WB=data.xquat[self._ball].copy(),
            force=force,
        )

    def built(self) -> BallBuilt:
        """See :class:`proofroll.core.engine.Engine`."""
        model = self._model
        data = self._evaluated()
        mu = contact_coefficient(model, data, self._geoms)
        gap = min(data.contact.dist) if data.ncon else None
        acceleration, turning = accelerations(model, data)
        return BallBuilt(
            mass=float(model.body_mass[self._ball]),
            inertia=model.body_inertia[self._ball].copy(),
            gravity=model.opt.gravity.copy(),
            ball_radius=float(model.geom_size[self._geom, 0]),
            rolling_resistance=self._lever(data),
            mu_static=mu,
            mu_kinetic=mu,
            gap=None if gap is None else float(gap),
            acceleration=acceleration,
            angular_acceleration=turning,
            terms=terms_held(
                # a contact of six dimensions resists rolling by itself
                resists=self._formulation.resists or int(model.geom_condim[self._geom]) >= ROLLS,
                turns=int(model.joint("spin").type[0]) == mujoco.mjtJoint.mjJNT_BALL,
            ),
            regularised=softness(self._body, self._settings),
        )

    def _lever(self, data: Any) -> float:
        """Lever arm f of the rolling resistance [m]: applied torque by normal force; else from the torque's own law.

        The law is read at a start at depth zero, which may have no normal force yet.
        """
        torque = float(np.linalg.norm(data.xfrc_applied[self._ball, 3:]))
        N = -float(contact_force(self._model, data, self._geom) @ self._body.surface.normal(data.xpos[self._ball]))
        least = _PRESSED * self._body.ball.mass * natural_acceleration(self._body)
        if least < N:
            return torque / N
        return self._formulation.resistance.lever()


def _spec(scene: Scene, body: RollingBall, settings: ChartSettings) -> Any:
    """The model with all its numbers, before it is compiled."""
    spec = read_spec(scene, body)
    write_physics(spec, body, settings)
    Chart.write(spec, body)
    return spec


def _run(scene: Scene, settings: ChartSettings) -> RunOnBody:
    return on_body(MujocoBall(scene, settings), scene)


FORMULATIONS: Mapping[str, Formulation] = {
    "chart": Formulation(
        presets=PRESETS,
        provides=ALL_OF_A_BALL,
        level=Level.CONTACT,
        build=_run,
        lacking=NO_OTHER_BODIES,
        inherent={MechanismCapability.ORIENTATION: "the ball's joint has it in qpos"},
        terms=TERMS,
    )
}
