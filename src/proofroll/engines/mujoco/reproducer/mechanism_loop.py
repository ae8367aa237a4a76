"""A mechanism by MuJoCo alone: the text of programs, and the loop that measures what an adapter costs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import mujoco
import numpy as np


def stepped(model: Any, data: Any, times: Iterable[float]) -> Iterator[float]:
    """Moves the state to each time [s], from 0 on."""
    before = 0.0
    for t in times:
        steps = round((t - before) / model.opt.timestep)
        if steps:
            mujoco.mj_step(model, data, steps)
        before = t
        if data.warning.number.any():
            raise RuntimeError(f"MuJoCo warns before {t:g} s that the state is not finite or huge")
        yield t


def followed(
    xml: str, places: Sequence[tuple[str, Sequence[float]]], times: Iterable[float]
) -> Iterator[tuple[Any, float, float]]:
    """Places on bodies [m], energy [J] and how far loops are open [m] at each time [s]."""
    model = mujoco.MjModel.from_xml_string(xml)
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    data, now = mujoco.MjData(model), mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    bodies, at = [model.body(name).id for name, _ in places], np.array([place for _, place in places])
    for _ in stepped(model, data, times):
        mujoco.mj_copyData(now, model, data)
        mujoco.mj_forward(model, now)
        seen = now.xpos[bodies] + np.einsum("nij,nj->ni", now.xmat[bodies].reshape(-1, 3, 3), at)
        yield seen, float(now.energy.sum()), float(np.abs(now.efc_pos[: now.ne]).max(initial=0.0))
