"""Formulation ``chart``: a ball on joints along the surface's coordinates, in MuJoCo's contact with a tangent plane."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import mujoco
import numpy as np

from proofroll.core.errors import Refused
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.engines.mujoco.ball.contact import foreseen_normal_force
from proofroll.engines.mujoco.ball.formulation import Formulation
from proofroll.engines.mujoco.ball.friction import BoundedFriction, corrects
from proofroll.engines.mujoco.ball.model import pose, quaternion_of, tangent_plane
from proofroll.engines.mujoco.settings import MujocoSettings


class Chart(Formulation):
    """Joints ``u1``, ``u2`` (the surface's own motions), ``normal`` (the depth) and ``spin`` (a ball joint).

    In these coordinates the contact's Jacobian is constant along the surface, so the term J̇v that MuJoCo leaves out
    of contact rows vanishes. Contact, friction and the normal degree of freedom remain MuJoCo's own. The site
    ``touch`` rides on ``u1`` and ``u2`` at the wall; the plane takes its pose, and stays a fixed body for MuJoCo.
    """

    def __init__(
        self, model: Any, body: RollingBall, settings: MujocoSettings, friction: BoundedFriction | None
    ) -> None:
        super().__init__(model, body, settings, friction)
        self._corrects = corrects(body.contact, settings)
        self._wall = model.geom("wall").id
        self._touch = model.site("touch").id
        self._depth = int(model.joint("normal").dofadr[0])

    @staticmethod
    def write(spec: Any, body: RollingBall) -> None:
        """Writes one joint for each of the two rigid motions that map the surface onto itself.

        Raises:
            Refused: the file's joints are of another kind.
        """
        surface = body.surface
        origin = np.zeros(2)
        frame = surface.frame(origin)
        centre = frame.T @ surface.position(origin)
        pose(spec.body("chart"), np.zeros(3), quaternion_of(frame))
        spec.body("carriage").pos = centre
        for name, generator in zip(("u1", "u2"), surface.generators, strict=True):
            joint = spec.joint(name)
            hinge = generator.kind == "rotation"
            if joint.type != (mujoco.mjtJoint.mjJNT_HINGE if hinge else mujoco.mjtJoint.mjJNT_SLIDE):
                raise Refused(f"joint {name} of mujoco_chart.xml is not the {generator.kind} that the surface has")
            joint.axis = frame.T @ np.asarray(generator.axis)
            joint.pos = -centre if hinge else np.zeros(3)
        spec.site("touch").pos = [body.ball.radius, 0.0, 0.0]
        pose(spec.geom("wall"), *tangent_plane(body))

    @property
    def resists(self) -> bool:
        """See :class:`Formulation`: True if the callback that applies the torque is set in MuJoCo."""
        with self._callbacks(mujoco.MjData(self._model)):
            return mujoco.get_mjcb_passive() is not None

    def run(self, data: Any, steps: int) -> None:
        """Makes ``steps`` steps."""
        with self._callbacks(data):
            if self._friction is None:
                mujoco.mj_step(self._model, data, nstep=steps)
                return
            for _ in range(steps):
                self._friction.step(data)

    def evaluate(self, data: Any) -> None:
        """Computes forces and accelerations of the present state, as a step would."""
        with self._callbacks(data):
            mujoco.mj_forward(self._model, data)

    @contextmanager
    def _callbacks(self, data: Any) -> Iterator[None]:
        """Sets MuJoCo's callbacks, which are global to the process, only while this run computes with ``data``."""
        mujoco.set_mjcb_contactfilter(self._wall_poser(data))
        mujoco.set_mjcb_passive(self._resister(data) if self.resistance.f else None)
        mujoco.set_mjcb_control(self._correct if self._corrects else None)
        try:
            yield
        finally:
            mujoco.set_mjcb_contactfilter(None)
            mujoco.set_mjcb_passive(None)
            mujoco.set_mjcb_control(None)

    def _wall_poser(self, data: Any) -> Callable[[Any, Any, int, int], int]:
        """Contact filter that poses the wall: MuJoCo calls it between kinematics and collision at each stage of RK4.

        It returns 0, which lets the pair collide.
        """
        # Views of MjData's memory: to look them up at every stage would cost half as much as the stage.
        position, axes = data.geom_xpos[self._wall], data.geom_xmat[self._wall]
        touch, touch_axes = data.site_xpos[self._touch], data.site_xmat[self._touch]

        def pose_wall(model: Any, data: Any, geom1: int, geom2: int) -> int:  # noqa: ARG001 -- MuJoCo's signature
            position[:] = touch
            axes[:] = touch_axes
            return 0

        return pose_wall

    def _resister(self, data: Any) -> Callable[[Any, Any], None]:
        """Passive callback that applies rolling resistance: MuJoCo calls it between velocities and accelerations."""
        reaction, axes, velocity = data.qfrc_constraint, data.site_xmat[self._touch], data.cvel[self._ball, 3:]
        torque, depth, apply = data.xfrc_applied[self._ball, 3:], self._depth, self.resistance.apply

        def resist(model: Any, data: Any) -> None:  # noqa: ARG001 -- MuJoCo's signature
            N = foreseen_normal_force(data, -float(reaction[depth]))
            _, _, e1x, _, _, e1y, _, _, e1z = axes.tolist()
            apply(torque, N, (-e1x, -e1y, -e1z), velocity.tolist())

        return resist

    def _correct(self, model: Any, data: Any) -> None:  # noqa: ARG002 -- MuJoCo's signature
        """Control callback that corrects slip: MuJoCo calls it after reference accelerations and before forces."""
        if self._friction is not None:
            self._friction.correct(data, -float(data.qfrc_constraint[self._depth]))
