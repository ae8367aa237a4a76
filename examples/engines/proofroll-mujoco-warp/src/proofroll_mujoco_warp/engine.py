"""Engine MuJoCo Warp: MuJoCo's equations as kernels of Warp, in single precision; one world, or many."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Iterable, Mapping, Sequence
from typing import ClassVar

import mujoco_warp
import numpy as np
import warp

from proofroll.adapter import (
    Array,
    Diverged,
    MechanismBuilt,
    MechanismSample,
    MujocoArrays,
    Scene,
    drive,
    mechanism_of,
    targets_at,
    whole_steps,
)
from proofroll_mujoco_warp.batch import MujocoWarpBatch
from proofroll_mujoco_warp.settings import LACKING, PRESETS, PROVIDES, MujocoWarpSettings
from proofroll_mujoco_warp.start import SeenData, rows_of, start_of

warp.config.quiet = True


class MujocoWarp:
    """MuJoCo Warp. See :class:`proofroll.core.engine.Engine`."""

    name: ClassVar[str] = "mujoco_warp"
    title: ClassVar[str] = "MuJoCo Warp"
    witness: ClassVar[bool] = False
    provides: ClassVar[Mapping[str, frozenset[str]]] = dict.fromkeys(PRESETS, PROVIDES)
    lacking: ClassVar[Mapping[str, Mapping[str, str]]] = dict.fromkeys(PRESETS, LACKING)
    settings: ClassVar[type[MujocoWarpSettings]] = MujocoWarpSettings
    presets: ClassVar[Mapping[str, Mapping[str, MujocoWarpSettings]]] = PRESETS

    @staticmethod
    def version() -> str:
        """Version of the package."""
        return importlib.metadata.version("mujoco-warp")

    @classmethod
    def build(cls, scene: Scene, settings: MujocoWarpSettings) -> MujocoWarp:
        """See :class:`proofroll.core.engine.Engine`."""
        return cls(scene, settings)

    @classmethod
    def build_batch(
        cls, scenes: Sequence[Scene], pattern: Sequence[int], settings: MujocoWarpSettings
    ) -> MujocoWarpBatch:
        """See :class:`proofroll.core.engine_abilities.RunsBatches`."""
        return MujocoWarpBatch(scenes, pattern, settings)

    def __init__(self, scene: Scene, settings: MujocoWarpSettings) -> None:
        self._mechanism, self._dt, self._count = mechanism_of(scene), settings.dt, 0
        host, start = start_of(scene, settings)
        self._arrays = MujocoArrays.of(self._mechanism, host)
        self._model, rows = mujoco_warp.put_model(host), rows_of(host)
        mujoco_warp.step(self._model, mujoco_warp.put_data(host, start, njmax=rows))  # compiles
        self._data, scratch = (mujoco_warp.put_data(host, start, njmax=rows) for _ in range(2))
        self._seen = SeenData(self._model, scratch)
        warp.synchronize()

    def drive(self, values: Iterable[float]) -> None:
        """See :class:`proofroll.core.engine_abilities.TakesTargets`."""
        drive(self._mechanism, values)
        controls, targets = self._data.ctrl.numpy(), targets_at(self._mechanism, self._count * self._dt)
        controls[0, : len(targets)] = targets
        self._data.ctrl.assign(controls)

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        for _ in range(whole_steps(self._count * self._dt, t, self._dt)):
            mujoco_warp.step(self._model, self._data)
            self._count += 1
        warp.synchronize()
        if not np.isfinite(self._data.qvel.numpy()).all():
            raise Diverged(f"MuJoCo Warp's velocities are not finite at t = {t:g} s")

    def sample(self) -> MechanismSample:
        """See :class:`proofroll.core.engine.Engine`."""
        seen = self._seen.of(self._data)
        return self._arrays.sample(lambda name: seen(name)[0])

    def built(self) -> MechanismBuilt:
        """See :class:`proofroll.core.engine.Engine`."""
        return self._arrays.built(lambda name: _first(getattr(self._model, name)), _first(self._model.opt.gravity))


def _first(values: object) -> Array:
    """Values of the first world."""
    return np.asarray(values.numpy()[0])  # type: ignore[attr-defined]
