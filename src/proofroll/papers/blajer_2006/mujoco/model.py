"""MuJoCo model of a ball's scene: structure from the scene's MJCF file, all physical numbers from the scene.

A scene without a file gets the structure that is written here.
"""

from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Refused
from proofroll.core.scene import Scene
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.papers.blajer_2006.mujoco.contact import MEMORY
from proofroll.papers.blajer_2006.mujoco.settings import ChartSettings

# How much of the wall's tangent plane is drawn, in radii of the ball; for MuJoCo it has no end.
_SEEN = 4.0

# The masses of carriage and slider are the least that MuJoCo accepts, and do not count.
_CHART = """
<mujoco model="{name}, chart">
  <worldbody>
    <light pos="0 0 1"/>
    <geom name="wall" type="plane" size="{seen} {seen} 0.01"/>
    <body name="chart">
      <body name="carriage">
        <inertial pos="0 0 0" mass="1e-13" diaginertia="1e-14 1e-14 1e-14"/>
        <joint name="u1" type="hinge"/>
        <joint name="u2" type="slide"/>
        <site name="touch" zaxis="-1 0 0" size="0.003"/>
        <body name="slider">
          <inertial pos="0 0 0" mass="1e-13" diaginertia="1e-14 1e-14 1e-14"/>
          <joint name="normal" type="slide" axis="1 0 0"/>
          <body name="ball">
            <joint name="spin" type="ball"/>
            <geom name="ball" type="sphere" size="{radius}"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def read_spec(scene: Scene, body: RollingBall) -> Any:
    """MjSpec of the scene's MJCF file; without a file, a model of the same structure.

    Raises:
        Refused: the scene does not name the file, or MuJoCo cannot read it.
    """
    path = scene.folder / "mujoco_chart.xml"
    if scene.folder == Path() or not path.is_file():
        numbers = {"radius": body.ball.radius, "seen": _SEEN * body.ball.radius}
        return mujoco.MjSpec.from_string(_CHART.format(name=scene.name, **numbers))
    if path.name not in scene.files:
        raise Refused(f'the scene does not name the model beside it; write files = ["{path.name}"] into scene.toml')
    try:
        return mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        raise Refused(f"MuJoCo cannot read {path.name}: {' '.join(str(error).split())}") from None


def write_physics(spec: Any, body: RollingBall, settings: ChartSettings) -> None:
    """Sets the numbers of ball, gravity, contact and solver."""
    ball = spec.body("ball")
    ball.explicitinertial = True
    ball.mass = body.ball.mass
    ball.inertia = np.full(3, body.ball.inertia)
    ball.ipos = np.zeros(3)
    spec.geom("ball").size = [body.ball.radius, 0.0, 0.0]
    option = spec.option
    option.gravity = body.gravity
    option.timestep = settings.dt
    option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{settings.integrator.upper()}")
    option.cone = getattr(mujoco.mjtCone, f"mjCONE_{settings.cone.upper()}")
    spec.nuserdata = MEMORY if body.contact.rolling_resistance else 0
    # A diverging run must be seen: by default MuJoCo resets the model to its initial state and goes on.
    option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    for geom in spec.geoms:
        geom.condim = settings.condim
        geom.friction = settings.friction_coefficients(settings.friction)
        # MuJoCo's defaults are written too: the file may hold others.
        geom.solref = [settings.contact_time, 1.0]
        geom.solimp = settings.solimp


def pose(element: Any, position: FloatArray, quaternion: FloatArray) -> None:
    """Puts an element of a spec at ``position`` [m] with ``quaternion``.

    An orientation that the file gives in another form (``zaxis``, ``xyaxes``, ``euler``) would silently win over the
    quaternion when the spec is compiled, so it is taken away.
    """
    element.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
    element.pos = position
    element.quat = quaternion


def tangent_plane(body: RollingBall) -> tuple[FloatArray, FloatArray]:
    """Point [m] and quaternion of the plane that touches the ball at its start; its z axis points to the ball."""
    e1 = body.surface.normal(body.p0)
    quaternion = np.zeros(4)
    mujoco.mju_quatZ2Vec(quaternion, -e1)
    return body.p0 + body.ball.radius * e1, quaternion


def quaternion_of(axes: FloatArray) -> FloatArray:
    """MuJoCo's quaternion of a frame whose axes are the columns of ``axes``, shape (4,)."""
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(axes).ravel())
    return quaternion
