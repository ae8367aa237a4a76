"""Copies of scenes in MuJoCo Warp: its worlds, with numbers of their own."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import mujoco
import mujoco_warp
import numpy as np
import warp

from proofroll.adapter import MechanismSample, MujocoArrays, Refused, Scene, mechanism_of, whole_steps
from proofroll_mujoco_warp.settings import MujocoWarpSettings
from proofroll_mujoco_warp.start import SeenData, rows_of, start_of

# Arrays of a state at time 0 that scenes have with their own numbers.
_KEYS = "key_"  # beginning of names of keyframes, which the start was read from
_STATE = ("qpos", "qvel", "ctrl", "qacc_warmstart")


class MujocoWarpBatch:
    """Copies of a few scenes. See :class:`proofroll.core.engine_abilities.Batch`."""

    def __init__(self, scenes: Sequence[Scene], pattern: Sequence[int], settings: MujocoWarpSettings) -> None:
        self.device, self._dt, self._count = str(warp.get_device()), settings.dt, 0
        starts = [start_of(scene, settings) for scene in scenes]
        host = starts[0][0]
        self._arrays, self._pattern = MujocoArrays.of(mechanism_of(scenes[0]), host), np.array(pattern)
        self._model = self._merged([mujoco_warp.put_model(model) for model, _ in starts])
        self._data = self._state([data for _, data in starts], host)
        mujoco_warp.step(self._model, self._data)  # compiles
        self._data, scratch = (self._state([data for _, data in starts], host) for _ in range(2))
        self._seen = SeenData(self._model, scratch)
        warp.synchronize()

    def _merged(self, records: Sequence[Any]) -> Any:
        """Model of all copies: the first, with arrays of every copy in place of those in which scenes differ.

        Raises:
            Refused: scenes differ in what copies share.
        """
        changes: dict[str, Any] = {}
        for item in dataclasses.fields(records[0]):
            values = [getattr(record, item.name) for record in records]
            if dataclasses.is_dataclass(values[0]):
                changes[item.name] = self._merged(values)
            elif isinstance(values[0], warp.array) and not item.name.startswith(_KEYS):
                arrays = [value.numpy() for value in values]
                if all(np.array_equal(array, arrays[0]) for array in arrays[1:]):
                    continue
                alike = len({array.shape for array in arrays}) == 1
                if not alike or getattr(item.type, "shape", ())[:1] != ("*",):
                    raise Refused(f"the worlds of MuJoCo Warp share {item.name}, in which these scenes differ")
                copies = np.concatenate(arrays)[self._pattern]
                changes[item.name] = warp.array(copies, dtype=values[0].dtype, device=values[0].device)
        return dataclasses.replace(records[0], **changes)

    def _state(self, starts: Sequence[mujoco.MjData], host: mujoco.MjModel) -> Any:
        """Data of all copies at time 0."""
        data = mujoco_warp.put_data(host, starts[0], nworld=len(self._pattern), njmax=rows_of(host))
        for name in _STATE:
            values = np.stack([getattr(start, name) for start in starts])
            getattr(data, name).assign(values[self._pattern].astype(np.float32))
        return data

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine_abilities.Batch`."""
        for _ in range(whole_steps(self._count * self._dt, t, self._dt)):
            mujoco_warp.step(self._model, self._data)
            self._count += 1
        warp.synchronize()

    def sample(self) -> MechanismSample:
        """See :class:`proofroll.core.engine_abilities.Batch`."""
        return self._arrays.sample(self._seen.of(self._data))
