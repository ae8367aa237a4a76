"""Formulation ``chart``: a ball on joints along the surface's coordinates, in MuJoCo's contact with a tangent plane."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import mujoco
import numpy as np

from proofroll.core.errors import Refused
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.papers.blajer_2006.mujoco.contact import Resistance, foreseen_normal_force
from proofroll.papers.blajer_2006.mujoco.model import pose, quaternion_of, tangent_plane


class Chart:
    """Joints ``u1`` (about the axis), ``u2`` (along it), ``normal`` (the depth) and ``spin`` (a ball joint).

    In these coordinates the contact's Jacobian is constant along the surface, so the term J̇v that MuJoCo leaves out
    of contact rows vanishes. Contact, friction and the normal degree of freedom remain MuJoCo's own. The site
    ``touch`` rides on ``u1`` and ``u2`` at the wall; the plane takes its pose, and stays a fixed body for MuJoCo.

    Attributes:
        resistance: the torque of rolling resistance that its steps apply.
    """

    def __init__(self, model: Any, body: RollingBall) -> None:
        self._model, self._ball = model, model.body("ball").id
        self.resistance = Resistance(body.contact.rolling_resistance)
        self._wall = model.geom("wall").id
        self._touch = model.site("touch").id
        self._depth = int(model.joint("normal").dofadr[0])

    @staticmethod
    def write(spec: Any, body: RollingBall) -> None:
        """Writes one joint for each coordinate of the surface: a hinge about the cylinder's axis, and a slide along it.

        Raises:
            Refused: the file's joints are of another kind.
        """
        surface = body.surface
        origin = np.zeros(2)
        frame = surface.frame(origin)
        centre = frame.T @ surface.position(origin)
        pose(spec.body("chart"), np.zeros(3), quaternion_of(frame))
        spec.body("carriage").pos = centre
        hinge, slide = mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE
        for name, kind, text, position in (
            ("u1", hinge, "rotation", -centre),
            ("u2", slide, "translation", np.zeros(3)),
        ):
            joint = spec.joint(name)
            if joint.type != kind:
                raise Refused(f"joint {name} of mujoco_chart.xml is not the {text} that the surface has")
            joint.axis, joint.pos = np.array([0.0, 0.0, 1.0]), position
        spec.site("touch").pos = [body.ball.radius, 0.0, 0.0]
        pose(spec.geom("wall"), *tangent_plane(body))

    @property
    def resists(self) -> bool:
        """True if the callback that applies the torque of rolling resistance is set in MuJoCo."""
        with self._callbacks(mujoco.MjData(self._model)):
            return mujoco.get_mjcb_passive() is not None

    def run(self, data: Any, steps: int) -> None:
        """Makes ``steps`` steps."""
        with self._callbacks(data):
            mujoco.mj_step(self._model, data, nstep=steps)

    def evaluate(self, data: Any) -> None:
        """Computes forces and accelerations of the present state, as a step would."""
        with self._callbacks(data):
            mujoco.mj_forward(self._model, data)

    @contextmanager
    def _callbacks(self, data: Any) -> Iterator[None]:
        """Sets MuJoCo's callbacks, which are global to the process, only while this run computes with ``data``."""
        mujoco.set_mjcb_contactfilter(self._wall_poser(data))
        mujoco.set_mjcb_passive(self._resister(data) if self.resistance.f else None)
        try:
            yield
        finally:
            mujoco.set_mjcb_contactfilter(None)
            mujoco.set_mjcb_passive(None)

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
