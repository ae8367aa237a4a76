"""What every model in MuJoCo needs around its steps."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged, Refused

_FATAL = (
    (mujoco.mjtWarning.mjWARN_BADQPOS, "positions are not finite or huge"),
    (mujoco.mjtWarning.mjWARN_BADQVEL, "velocities are not finite or huge"),
    (mujoco.mjtWarning.mjWARN_BADQACC, "accelerations are not finite or huge"),
    (mujoco.mjtWarning.mjWARN_CONTACTFULL, "there are more contacts than MuJoCo holds"),
    (mujoco.mjtWarning.mjWARN_CNSTRFULL, "there are more constraints than MuJoCo holds"),
)


def compiled(spec: Any) -> Any:
    """The model; MuJoCo takes no mass or inertia below 1e-15, for example, in whatever units.

    Raises:
        Refused: MuJoCo does not accept the numbers.
    """
    try:
        return spec.compile()
    except ValueError as error:
        raise Refused(f"MuJoCo does not accept the model: {' '.join(str(error).split())}") from None


def forget_callbacks() -> None:
    """Callbacks belong to the process: one that somebody else left would act in our models too."""
    for name in ("act_bias", "act_dyn", "act_gain", "contactfilter", "control", "passive", "sensor"):
        getattr(mujoco, f"set_mjcb_{name}")(None)


class silent:  # noqa: N801 -- used as a statement; a generator's context would cost as much as a step
    """Keeps MuJoCo from printing, and from writing MUJOCO_LOG.TXT; warnings are read from MjData instead."""

    __slots__ = ("_before",)

    def __enter__(self) -> None:
        self._before = mujoco.get_mju_user_warning()
        mujoco.set_mju_user_warning(_nothing)

    def __exit__(self, *_: object) -> None:
        mujoco.set_mju_user_warning(self._before)


def _nothing(_: str) -> None:
    pass


def raise_if_fatal(data: Any, t: float) -> None:
    """Looks at MuJoCo's warnings after steps up to ``t`` [s].

    Raises:
        Diverged: one of them means that the state is worthless.
    """
    warnings = data.warning
    if not any(warnings.number.tolist()):
        return
    for kind, meaning in _FATAL:
        if warnings[kind].number:
            raise Diverged(f"MuJoCo gave up before {t:g} s: {meaning}")


def mass_matrix(model: Any, data: Any) -> FloatArray:
    """The whole mass matrix in the present configuration, shape (nv, nv)."""
    M = np.zeros((model.nv, model.nv))
    try:
        mujoco.mj_fullM(model, data, M)
    except TypeError:  # before 3.10
        mujoco.mj_fullM(model, M, data.qM)
    return M
