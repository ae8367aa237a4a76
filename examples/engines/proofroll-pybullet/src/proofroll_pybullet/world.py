"""PyBullet's functions and constants, bound to one physics server."""

from __future__ import annotations

import contextlib
import functools
import weakref
from collections.abc import Sequence
from typing import Any

import numpy as np
import pybullet

from proofroll_pybullet.settings import PybulletSettings


class World:
    """A physics server of its own, with the functions of the module ``pybullet``; disconnects with this object."""

    def __init__(self, gravity: Sequence[float], settings: PybulletSettings) -> None:
        self._number = pybullet.connect(pybullet.DIRECT)
        weakref.finalize(self, _disconnect, self._number)
        self.setGravity(*gravity)
        self.setTimeStep(settings.dt)
        self.setPhysicsEngineParameter(numSolverIterations=settings.iterations, enableFileCaching=0)
        if settings.preset == "matched":  # hard contacts and constraints, errors corrected fully in each step
            self.setPhysicsEngineParameter(
                erp=1, contactERP=1, frictionERP=0, contactSlop=0, globalCFM=0, useSplitImpulse=0,
                solverResidualThreshold=0,
            )  # fmt: skip

    def __getattr__(self, name: str) -> Any:
        found = getattr(pybullet, name)
        return functools.partial(found, physicsClientId=self._number) if callable(found) else found

    def gravity(self) -> Any:
        """Gravity read back from PyBullet [m/s²], shape (3,)."""
        told = self.getPhysicsEngineParameters()
        return np.array([told[f"gravityAcceleration{axis}"] for axis in "XYZ"])


def _disconnect(number: int) -> None:
    with contextlib.suppress(pybullet.error):  # the interpreter may be ending
        pybullet.disconnect(number)
