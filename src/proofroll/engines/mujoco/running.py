"""Parts that every model in MuJoCo shares: compiling, writing MJCF, stepping, reading a state, fatal warnings."""

import ctypes
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.engine import whole_steps
from proofroll.core.errors import Diverged, Refused
from proofroll.engines.mujoco.settings import MujocoSettings

_FATAL = (
    (mujoco.mjtWarning.mjWARN_BADQPOS, "positions are not finite or huge"),
    (mujoco.mjtWarning.mjWARN_BADQVEL, "velocities are not finite or huge"),
    (mujoco.mjtWarning.mjWARN_BADQACC, "accelerations are not finite or huge"),
    (mujoco.mjtWarning.mjWARN_CONTACTFULL, "there are more contacts than MuJoCo holds"),
    (mujoco.mjtWarning.mjWARN_CNSTRFULL, "there are more constraints than MuJoCo holds"),
)

# A function of MuJoCo's library that sets the digits of MJCF; digits of a double; MuJoCo's default.
_DIGITS, _ALL, _USUAL = "_mjPRIVATE__set_xml_precision", 17, 6
# Change of accelerations, relative to the largest, that counts as none.
_SETTLED = 1e-12


def compiled(spec: Any) -> Any:
    """Compiles a spec into an MjModel. Raises Refused if MuJoCo does not accept it: a mass below 1e-15, for example."""
    try:
        return spec.compile()
    except ValueError as error:
        raise Refused(f"MuJoCo does not accept the model: {' '.join(str(error).split())}") from None


def written(spec: Any) -> str:
    """MJCF of a compiled spec, with all digits of a double; MuJoCo by itself writes six.

    Its number of digits is a function of its library that Python does not show; where it is gone, six are left and
    the first line says so.
    """
    folder = Path(mujoco.__file__).parent
    library = next((file for file in folder.iterdir() if file.name.removeprefix("lib").startswith("mujoco.")), None)
    digits = getattr(ctypes.CDLL(str(library)), _DIGITS, None) if library else None
    if digits is None:
        return f"<!-- {_USUAL} digits: MuJoCo {mujoco.__version__} has no function that sets them -->\n{spec.to_xml()}"
    digits(_ALL)
    try:
        return str(spec.to_xml())
    finally:
        digits(_USUAL)


def forget_callbacks() -> None:
    """Clears MuJoCo's callbacks: they are global to the process, and one left by other code would act here too."""
    for name in ("act_bias", "act_dyn", "act_gain", "contactfilter", "control", "passive", "sensor"):
        getattr(mujoco, f"set_mjcb_{name}")(None)


class silent:  # noqa: N801 -- used as a statement; a generator's context would cost as much as a step
    """Keeps MuJoCo from printing, and from writing MUJOCO_LOG.TXT; warnings are read from MjData instead."""

    __slots__ = ("_before",)

    def __enter__(self) -> None:
        self._before = mujoco.get_mju_user_warning()
        mujoco.set_mju_user_warning(lambda _: None)

    def __exit__(self, *_: object) -> None:
        mujoco.set_mju_user_warning(self._before)


class SteppedModel:
    """A compiled model that MuJoCo steps; samples read a copy of its state."""

    def __init__(self, model: Any, settings: MujocoSettings) -> None:
        self._model, self._settings = model, settings
        self._data, self._scratch = mujoco.MjData(model), mujoco.MjData(model)
        self._steps = 0

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        dt = self._settings.dt
        # Counted, because the sum that MjData.time keeps drifts from the grid by round-off.
        steps = whole_steps(self._steps * dt, t, dt)
        if steps == 0:
            return
        with silent():
            self._run(steps)
        self._steps += steps
        raise_if_fatal(self._data, t)

    @property
    def native(self) -> tuple[Any, Any]:
        """MuJoCo's own model and data, for further use with MuJoCo itself."""
        return self._model, self._data

    def _run(self, steps: int) -> None:
        """Makes ``steps`` steps."""
        mujoco.mj_step(self._model, self._data, steps)

    def _evaluate(self, data: Any) -> None:
        """Computes forces and accelerations of the state in ``data``, as a step would."""
        mujoco.mj_forward(self._model, data)

    def _evaluated(self) -> Any:
        """A copy of the present state with its own forces: after a step MjData holds those of the last stage."""
        mujoco.mj_copyData(self._scratch, self._model, self._data)
        with silent():
            self._evaluate(self._scratch)
        return self._scratch


def raise_if_fatal(data: Any, t: float) -> None:
    """Raises Diverged if MuJoCo's warnings after steps up to ``t`` [s] mean that the state is no longer valid."""
    warnings = data.warning
    if not any(warnings.number.tolist()):
        return
    for kind, meaning in _FATAL:
        if warnings[kind].number:
            raise Diverged(f"MuJoCo gave up before {t:g} s: {meaning}")


def evaluate_behind(data: Any, evaluate: Callable[[Any], None], lag: float, share: float, rounds: int) -> None:
    """Takes the velocities of ``data`` back by ``lag`` [s], by accelerations that ``evaluate`` computes there.

    Args:
        data: MuJoCo's data, with velocities of its own time and accelerations to begin with.
        evaluate: computes forces and accelerations, as a step would.
        lag: time [s]; 0 to only evaluate.
        share: part of an error of the accelerations that an evaluation leaves along the rows of contacts.
        rounds: of evaluations at most, an odd number; they end where a plain one changes nothing any more.
    """
    now = data.qvel.copy()
    for index in range(rounds):
        last_rates = data.qacc.copy()
        data.qvel[:] = now - lag * last_rates
        evaluate(data)
        change = np.abs(data.qacc - last_rates)
        if not index % 2 and (change <= _SETTLED * np.abs(data.qacc).max(initial=0.0)).all():
            return
        if lag and index % 2:
            # In a plain round the error contracts by ``share`` along the contact's rows and vanishes elsewhere.
            # Extrapolation removes the first and brings errors elsewhere back with the other sign, so it
            # alternates with plain rounds, and the last round is plain.
            data.qacc[:] = (data.qacc - share * last_rates) / (1 - share)


def mass_matrix(model: Any, data: Any) -> FloatArray:
    """The whole mass matrix in the present configuration, shape (nv, nv)."""
    M = np.zeros((model.nv, model.nv))
    try:
        mujoco.mj_fullM(model, data, M)
    except TypeError:  # before 3.10
        mujoco.mj_fullM(model, M, data.qM)
    return M
