"""Engine MJX: MuJoCo's equations in JAX, in double or single precision; one copy."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Iterable, Mapping
from typing import ClassVar

import jax
import mujoco
import numpy as np
from mujoco import mjx

from proofroll.adapter import (
    Diverged,
    MechanismBuilt,
    MechanismCapability,
    MechanismSample,
    MujocoArrays,
    Scene,
    drive,
    mechanism_of,
    targets_at,
    whole_steps,
)
from proofroll.engines.mujoco import mjspec
from proofroll_mjx.settings import LACKING, PRESETS, PROVIDES, MjxSettings

_steps = jax.jit(lambda model, data, count: jax.lax.fori_loop(0, count, lambda _, state: mjx.step(model, state), data))
_forward = jax.jit(mjx.forward)


class Mjx:
    """MJX. See :class:`proofroll.core.engine.Engine`."""

    name: ClassVar[str] = "mjx"
    title: ClassVar[str] = "MJX"
    provides: ClassVar[Mapping[str, frozenset[str]]] = dict.fromkeys(PRESETS, PROVIDES)
    lacking: ClassVar[Mapping[str, Mapping[str, str]]] = dict.fromkeys(PRESETS, LACKING)
    settings: ClassVar[type[MjxSettings]] = MjxSettings
    presets: ClassVar[Mapping[str, Mapping[str, MjxSettings]]] = PRESETS

    @staticmethod
    def version() -> str:
        """Version of the package."""
        return importlib.metadata.version("mujoco-mjx")

    @staticmethod
    def lowered(settings: MjxSettings) -> Mapping[str, int]:
        """RK4 turns bodies of ball and free joints to order 2."""
        turning = (MechanismCapability.SPHERICAL, MechanismCapability.FREE)
        return dict.fromkeys(turning, 2) if settings.integrator == "RK4" else {}

    @classmethod
    def build(cls, scene: Scene, settings: MjxSettings) -> Mjx:
        """See :class:`proofroll.core.engine.Engine`."""
        return cls(scene, settings)

    def __init__(self, scene: Scene, settings: MjxSettings) -> None:
        wide = settings.formulation == "f64"
        if jax.config.jax_enable_x64 != wide:
            jax.config.update("jax_enable_x64", wide)
            jax.clear_caches()
        self._mechanism, self._dt, self._count = mechanism_of(scene), settings.dt, 0
        host = mjspec(scene, portable=True, sensors=False, dt=settings.dt, integrator=settings.integrator).compile()
        start = mujoco.MjData(host)
        mujoco.mj_resetDataKeyframe(host, start, host.key("start").id)
        mujoco.mj_forward(host, start)
        self._arrays = MujocoArrays.of(self._mechanism, host)
        self._model, data = mjx.put_model(host), mjx.put_data(host, start)
        kinds = jax.eval_shape(mjx.step, self._model, data)  # of integers a step makes others than put_data
        data = jax.tree.map(lambda array, kind: jax.numpy.asarray(array, kind.dtype), data, kinds)
        self._data = jax.block_until_ready(_steps(self._model, data, 0))  # compiles

    def drive(self, values: Iterable[float]) -> None:
        """See :class:`proofroll.core.engine_abilities.TakesTargets`."""
        drive(self._mechanism, values)
        targets = targets_at(self._mechanism, self._count * self._dt)
        self._data = self._data.replace(ctrl=self._data.ctrl.at[: len(targets)].set(targets))

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        count = whole_steps(self._count * self._dt, t, self._dt)
        self._data = jax.block_until_ready(_steps(self._model, self._data, count))
        self._count += count
        if not np.isfinite(np.array(self._data.qvel)).all():
            raise Diverged(f"MJX's velocities are not finite at t = {t:g} s")

    def sample(self) -> MechanismSample:
        """See :class:`proofroll.core.engine.Engine`."""
        data = _forward(self._model, self._data)
        return self._arrays.sample(lambda name: getattr(data, name))

    def built(self) -> MechanismBuilt:
        """See :class:`proofroll.core.engine.Engine`."""
        return self._arrays.built(lambda name: getattr(self._model, name), self._model.opt.gravity)
