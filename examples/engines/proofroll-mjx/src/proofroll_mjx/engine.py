"""Engine MJX: MuJoCo's equations in JAX, in double or single precision; one copy, or many."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Iterable, Mapping, Sequence
from typing import ClassVar

import jax
import numpy as np
from mujoco import mjx

from proofroll.adapter import (
    Diverged,
    MechanismBuilt,
    MechanismCapability,
    MechanismSample,
    Scene,
    drive,
    targets_at,
    whole_steps,
)
from proofroll_mjx.batch import MjxBatch
from proofroll_mjx.settings import LACKING, PRESETS, PROVIDES, MjxSettings
from proofroll_mjx.start import kinds_of_step, set_precision, start_of

_steps = jax.jit(lambda model, data, count: jax.lax.fori_loop(0, count, lambda _, state: mjx.step(model, state), data))
_forward = jax.jit(mjx.forward)


class Mjx:
    """MJX. See :class:`proofroll.core.engine.Engine`."""

    name: ClassVar[str] = "mjx"
    title: ClassVar[str] = "MJX"
    witness: ClassVar[bool] = False
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

    @classmethod
    def build_batch(cls, scenes: Sequence[Scene], pattern: Sequence[int], settings: MjxSettings) -> MjxBatch:
        """See :class:`proofroll.core.engine_abilities.RunsBatches`."""
        return MjxBatch(scenes, pattern, settings)

    def __init__(self, scene: Scene, settings: MjxSettings) -> None:
        set_precision(settings)
        start = start_of(scene, settings)
        self._mechanism, self._arrays, self._model, data = start
        self._dt, self._count = settings.dt, 0
        data = jax.tree.map(lambda array, kind: jax.numpy.asarray(array, kind.dtype), data, kinds_of_step(start))
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
