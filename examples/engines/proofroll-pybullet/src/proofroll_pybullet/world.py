"""A world of PyBullet for one model: connected, and closed with the model."""

from __future__ import annotations

import contextlib
import weakref
from collections.abc import Sequence
from typing import Any

import numpy as np
import pybullet

from proofroll_pybullet.settings import PybulletSettings


def connected(owner: Any, gravity: Sequence[float], settings: PybulletSettings) -> int:
    """Number of a world that ends with its owner."""
    client: int = pybullet.connect(pybullet.DIRECT)
    weakref.finalize(owner, _disconnect, client)
    pybullet.setGravity(*gravity, physicsClientId=client)
    pybullet.setTimeStep(settings.dt, physicsClientId=client)
    pybullet.setPhysicsEngineParameter(
        numSolverIterations=settings.iterations, enableFileCaching=0, physicsClientId=client
    )
    if settings.preset == "matched":  # nothing is soft, and nothing is corrected in two ways
        pybullet.setPhysicsEngineParameter(
            erp=1, contactERP=1, frictionERP=0, contactSlop=0, globalCFM=0, useSplitImpulse=0,
            solverResidualThreshold=0, physicsClientId=client,
        )  # fmt: skip
    return client


def gravity_of(client: int) -> Any:
    """As PyBullet has it [m/s²], shape (3,)."""
    told = pybullet.getPhysicsEngineParameters(physicsClientId=client)
    return np.array([told[f"gravityAcceleration{axis}"] for axis in "XYZ"])


def _disconnect(client: int) -> None:
    with contextlib.suppress(pybullet.error):  # the interpreter may be ending
        pybullet.disconnect(client)
