"""MuJoCo: soft contact at the level of accelerations, generalised coordinates, one first- or fourth-order step."""

from proofroll.engines.mujoco.adapter import Mujoco, mjspec

__all__ = ["Mujoco", "mjspec"]
