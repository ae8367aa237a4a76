"""MuJoCo's model of a scene that has no MJCF file: its structure; numbers are set from the scene, as in any file."""

from __future__ import annotations

from proofroll.core.errors import Refused
from proofroll.elements.ball_on_surface.model import RollingBall

# How much of the wall's tangent plane is drawn, in radii of the ball; for MuJoCo it has no end.
_SEEN = 4.0

_FREE = """
<mujoco model="{name}, free">
  <worldbody>
    <light pos="0 0 1"/>
    <body name="wall" mocap="true">
      <geom name="wall" type="plane" size="{seen} {seen} 0.01"/>
    </body>
    <body name="ball">
      <freejoint name="spin"/>
      <geom name="ball" type="sphere" size="{radius}"/>
    </body>
  </worldbody>
</mujoco>
"""
# The masses of carriage and slider are the least that MuJoCo accepts, and do not count.
_CHART = """
<mujoco model="{name}, chart">
  <worldbody>
    <light pos="0 0 1"/>
    <geom name="wall" type="plane" size="{seen} {seen} 0.01"/>
    <body name="chart">
      <body name="carriage">
        <inertial pos="0 0 0" mass="1e-13" diaginertia="1e-14 1e-14 1e-14"/>
        <joint name="u1" type="{first}"/>
        <joint name="u2" type="{second}"/>
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
_JOINTS = {"rotation": "hinge", "translation": "slide"}


def written(body: RollingBall, name: str, formulation: str) -> str:
    """The model as MJCF.

    Raises:
        Refused: the formulation needs what only an author's file can say, or motions that the surface does not have.
    """
    known = {"name": name, "radius": body.ball.radius, "seen": _SEEN * body.ball.radius}
    if formulation == "free":
        return _FREE.format(**known)
    if formulation != "chart":
        raise Refused(f"{formulation} needs a wall made of MuJoCo's shapes, mujoco_{formulation}.xml beside the scene")
    if body.surface.generators is None:
        raise Refused(
            "chart moves the ball by two joints in a row that slide its wall along itself, as those of planes and "
            "cylinders do: on a sphere they are singular at the bottom, elsewhere they would not follow the wall's "
            "curvature, and the J̇v that MuJoCo leaves out would remain; use free"
        )
    first, second = (_JOINTS[generator.kind] for generator in body.surface.generators)
    return _CHART.format(**known, first=first, second=second)
