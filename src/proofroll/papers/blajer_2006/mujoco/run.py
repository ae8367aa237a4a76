"""Formulation ``chart``: run of a ball that rolls in a cylinder in MuJoCo."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

import mujoco
import numpy as np

from proofroll.core.engine import Regularised
from proofroll.core.engine_abilities import Level
from proofroll.core.formulations import Formulation
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.engines.mujoco.running import SteppedModel, compiled, forget_callbacks, silent
from proofroll.engines.mujoco.settings import check
from proofroll.papers.blajer_2006.ball.as_body import RunOnBody, on_body, rolling_ball
from proofroll.papers.blajer_2006.ball.mechanics import natural_acceleration, newton_euler
from proofroll.papers.blajer_2006.ball.model import ALL_OF_A_BALL, NO_OTHER_BODIES, RollingBall
from proofroll.papers.blajer_2006.ball.sampling import BallBuilt, BallSample, terms_held
from proofroll.papers.blajer_2006.mujoco.chart import Chart
from proofroll.papers.blajer_2006.mujoco.contact import contact_coefficient, contact_force
from proofroll.papers.blajer_2006.mujoco.model import read_spec, write_physics
from proofroll.papers.blajer_2006.mujoco.settings import PRESETS, ROLLS, TERMS, ChartSettings
from proofroll.papers.blajer_2006.mujoco.start import EVALUATIONS, accelerations, start

_FORCES = ("acceleration", "N", "F2", "F3")
_MORE = "friction against turning or rolling, which the scene does not ask for, turns the ball otherwise"
# The bounds below are asymptotic in depth/a, and MuJoCo's Newton solver stops at a relative 1e-8.
_MARGIN = 1.1
_SOLVER = 1e-8
_ROUND_OFF = 1e-12


def softness(body: RollingBall, settings: ChartSettings) -> Mapping[str, Regularised]:
    """Certificate quantity -> its tolerance with the reason."""
    a = body.ball.radius
    bend = abs(float(body.v0 @ body.surface.normal_gradient(body.p0) @ body.v0))
    gravity = float(np.linalg.norm(body.gravity))
    load = bend + gravity
    least, most = settings.impedances
    scale = natural_acceleration(body)
    # Normal acceleration missing at depth zero: the share 1 - d of the load, which the impedance does not carry.
    missing = (1 - least) * load
    why = "the impedance of a soft contact is below 1"
    result = dict(_computed(body, settings))
    if settings.start == "touching":
        # Friction is bounded by the little normal force of a contact at depth zero.
        lost = _law_of_friction(body, settings, least * bend * body.ball.mass)
        why += "; the ball starts at depth zero, where no depth makes up for it"
        if lost:
            why += " and the normal force that remains does not hold the friction"
        soft = _MARGIN * (missing + lost) / scale + _SOLVER
        if soft >= 1:
            why += ": accelerations and forces at time 0 are not checked"
        return result | _dynamics(body, settings, soft, why)
    # At the depth of a settled start, the reference acceleration k depth, k = d / (dmax tc)², of which the impedance
    # turns the part d into acceleration, supplies what is missing.
    depth = _MARGIN * missing * (most * settings.contact_time / least) ** 2 / a
    sunk = f"a soft contact carries the load only at a depth, {depth:.1e} of the radius at most"
    rolls = "MuJoCo's contact point, at which it rolls, lies midway in that depth"
    # The depth shortens the lever of friction, which balances gravity along the wall.
    soft = (2 * (1 - least) * load + depth * gravity) / scale + _SOLVER
    return result | {
        "position": Regularised(depth, sunk),
        "gap": Regularised(depth, sunk),
        "gap in the engine": Regularised(depth, sunk),
        "spin": Regularised(depth / 2 + _SOLVER, rolls),
        "slip": Regularised(depth / 2, rolls),
        **_dynamics(body, settings, soft, why),
    }


def _dynamics(body: RollingBall, settings: ChartSettings, soft: float, why: str) -> dict[str, Regularised]:
    """Tolerances of accelerations and forces; ``soft`` is that of the centre, relative to the natural acceleration.

    An error F of friction changes the acceleration by F/m, and a times the angular acceleration by a² F/J: m a²/J times
    as much. Rolling resistance adds f to the lever a. A contact's own friction against turning and rolling adds moments
    of at most N times the coefficient.
    """
    a = body.ball.radius
    turning = soft * (1 + body.contact.rolling_resistance / a) / body.ball.inertia_ratio
    _, about_normal, rolling = settings.friction_coefficients(1.0)
    if about_normal or rolling:
        # Relative to the natural force, which N does not exceed by more than gravity.
        why += "; " + _MORE
        soft += 2 * rolling / a
        turning += 2 * (about_normal + rolling) / a / body.ball.inertia_ratio
    return dict.fromkeys(_FORCES, Regularised(soft, why)) | {"angular acceleration": Regularised(turning, why)}


def _computed(body: RollingBall, settings: ChartSettings) -> Iterator[tuple[str, Regularised]]:
    """Tolerances of the coefficient that stands for unbounded friction, of rolling resistance and of the velocity."""
    stands = f"MuJoCo has no unbounded friction: a coefficient of {settings.friction:g} stands for it"
    for name in ("1 / static friction", "1 / kinetic friction"):
        yield name, Regularised((1 + _ROUND_OFF) / settings.friction, stands)
    if body.contact.rolling_resistance:
        yield "rolling resistance", Regularised(_SOLVER, "its torque uses the normal force of the evaluation before")


def _law_of_friction(body: RollingBall, settings: ChartSettings, N: float) -> float:
    """Bound of the error of the acceleration at time 0 from MuJoCo's law of friction [m/s²]; 0 if the ball sticks.

    ``N`` is the normal force of a contact at depth zero, which has not its full load yet [N].
    """
    ball, mu = body.ball, settings.friction
    e1 = body.surface.normal(body.p0)
    force = newton_euler(body, body.p0, body.v0, body.w0)[2]
    loaded = -float(force @ e1)
    needed = float(np.linalg.norm(force + loaded * e1))
    if needed > mu * loaded:
        return 0.0  # a ball that slips under its full load shows a coefficient that is too small, not softness
    pyramidal = settings.cone == "pyramidal"
    if needed * (math.sqrt(2) if pyramidal else 1.0) <= mu * N:
        return 0.0
    slip_rate = max(needed - mu * N, 0.0) * (1 / ball.mass + ball.radius**2 / ball.inertia)
    # Friction of the unloaded contact is wrong altogether; that of a pyramid also has a wrong direction.
    return mu * slip_rate + (needed + (mu * N if pyramidal else 0.0)) / ball.mass


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

    def spec(self, portable: bool = False) -> Any:  # noqa: ARG002
        """MjSpec of the scene, whose keyframe ``start`` is the present state; nothing is set from outside."""
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
