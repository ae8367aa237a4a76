"""Source of a program that repeats a run of a mechanism with MuJoCo alone, without proofroll."""

import inspect
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import mujoco
import numpy as np

from proofroll.core.program_text import assignment
from proofroll.elements.mechanism import Mechanism

_HEAD = "from __future__ import annotations\nimport mujoco\nimport numpy as np\n\n\n"
_RUN = '''

def run(times):
    """Places [m], energy [J] and how far loops are open [m] at each time."""
    yield from followed(MODEL, PLACES, times)
'''


def mechanism_source(xml: str, mechanism: Mechanism) -> str:
    """Part of the program that runs a mechanism, given as MJCF whose first keyframe is the start."""
    places = [(body, [float(x) for x in position]) for body, position in mechanism.followed]
    asks = "# Places that are followed: body, and where on it [m].\n" + assignment(PLACES=places)
    steps = "\n\n".join(map(inspect.getsource, (stepped, followed)))
    return f'{_HEAD}{steps}\n\nMODEL = """{xml}"""\n{asks}{_RUN}'


def stepped(model: Any, data: Any, times: Iterable[float]) -> Iterator[float]:
    """Steps the state from time 0 to each time [s], which it then yields.

    Raises:
        RuntimeError: MuJoCo warns.
    """
    last = 0.0
    for t in times:
        steps = round((t - last) / model.opt.timestep)
        if steps:
            mujoco.mj_step(model, data, steps)
        last = t
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
    bodies, places_on_bodies = [model.body(name).id for name, _ in places], np.array([place for _, place in places])
    for _ in stepped(model, data, times):
        mujoco.mj_copyData(now, model, data)
        mujoco.mj_forward(model, now)
        seen = now.xpos[bodies] + np.einsum("nij,nj->ni", now.xmat[bodies].reshape(-1, 3, 3), places_on_bodies)
        yield seen, float(now.energy.sum()), float(np.abs(now.efc_pos[: now.ne]).max(initial=0.0))
