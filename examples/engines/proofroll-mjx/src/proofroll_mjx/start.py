"""A scene at its start as a model and data of MJX, in the precision of the settings."""

from __future__ import annotations

import dataclasses
from typing import Any, NamedTuple

import jax
import mujoco
import numpy as np
from mujoco import mjx

from proofroll.adapter import Mechanism, MujocoArrays, Scene, mechanism_of
from proofroll.engines.mujoco import mjspec
from proofroll_mjx.settings import MjxSettings

_step = jax.jit(mjx.step)  # traced once for all starts of one structure


class Start(NamedTuple):
    """A mechanism, the rows of its bodies in arrays, and model and data at time 0."""

    mechanism: Mechanism
    arrays: MujocoArrays
    model: Any
    data: Any


def set_precision(settings: MjxSettings) -> None:
    """Sets JAX's precision, which is one for the whole process; what was compiled for another one goes."""
    wide = settings.formulation == "f64"
    if jax.config.jax_enable_x64 != wide:
        jax.config.update("jax_enable_x64", wide)
        jax.clear_caches()


def start_of(scene: Scene, settings: MjxSettings) -> Start:
    """Start of a scene in the precision that is set."""
    mechanism = mechanism_of(scene)
    host = mjspec(scene, portable=True, sensors=False, dt=settings.dt, integrator=settings.integrator).compile()
    start = mujoco.MjData(host)
    mujoco.mj_resetDataKeyframe(host, start, host.key("start").id)
    mujoco.mj_forward(host, start)
    model = mjx.put_model(host)
    # JAX compiles anew for other keyframes, and the start is in the data.
    keys = {item.name: getattr(model, item.name) for item in dataclasses.fields(model) if item.name.startswith("key_")}
    model = model.replace(**{name: np.zeros_like(values) for name, values in keys.items()})
    return Start(mechanism, MujocoArrays.of(mechanism, host), model, mjx.put_data(host, start))


def kinds_of_step(start: Start) -> Any:
    """Types of the data after a step, which makes of integers others than ``put_data``."""
    return jax.eval_shape(_step, start.model, start.data)
