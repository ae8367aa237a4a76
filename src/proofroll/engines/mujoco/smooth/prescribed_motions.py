"""Motions of joints in MuJoCo: equality constraints whose place moves in every step."""

from typing import Any

import mujoco

from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.scene.prescribed import moved
from proofroll.engines.mujoco.smooth.mechanism_model import motion_name

# Rounds of the fixed point of a lead: each leaves a tenth of the error, as an impedance changes by a tenth at most.
_ROUNDS = 15


class PrescribedMotions:
    """Motions of joints, as equality constraints with a place that moves; false if there are none.

    MuJoCo's row of an equality with the place p asks for the acceleration −b q̇ − k d(q − p) (q − p), as if p stood
    still: a joint lags behind a p that moves. So p leads the motion r by what makes that r̈ where q = r and q̇ = ṙ. How
    far the joint follows is left to the softness of the row. The velocities of Euler's methods are those from the step
    before to this one: there ṙ and r̈ are differences over steps, so that the joint comes to r.
    """

    def __init__(self, model: Any, mechanism: Mechanism) -> None:
        self._model = model
        self._motions = [(joint.motion, model.equality(motion_name(joint)).id) for joint, _, _ in mechanism.prescribed]

    def __bool__(self) -> bool:
        return bool(self._motions)

    def apply(self, data: Any) -> None:
        """Sets the places for the time of ``data``."""
        option, time = self._model.opt, float(data.time)
        staged = option.integrator == mujoco.mjtIntegrator.mjINT_RK4 or time == 0.0
        for signal, equality in self._motions:
            assert signal is not None  # as of all prescribed ones
            if staged:
                place, rate, acceleration = (float(part) for part in moved(signal, time))
            else:
                h = option.timestep
                last_place, place, next_place = (float(moved(signal, time + part * h).place) for part in (-1, 0, 1))
                rate, acceleration = (place - last_place) / h, (next_place - 2 * place + last_place) / h**2
            self._model.eq_data[equality, 0] = place + self._lead(equality, rate, acceleration)

    def apply_in_step(self, data: Any) -> None:
        """Sets the places in MuJoCo's callback, which comes after the rows are made: makes the rows anew."""
        if self:
            self.apply(data)
            mujoco.mj_makeConstraint(self._model, data)
            mujoco.mj_projectConstraint(self._model, data)
            mujoco.mj_referenceConstraint(self._model, data)

    def _lead(self, equality: int, rate: float, acceleration: float) -> float:
        """Distance x with k d(x) x = r̈ + b ṙ, for MuJoCo's own stiffness k, damping b and impedance d of the row."""
        time, ratio = self._model.eq_solref[equality].tolist()
        least, most, width, *_ = self._model.eq_solimp[equality].tolist()
        if time > 0:
            time = max(time, 2 * self._model.opt.timestep)
            stiffness, damping = 1 / (most * time * ratio) ** 2, 2 / (most * time)
        else:
            stiffness, damping = -time / most**2, -ratio / most
        lead, aim = 0.0, (acceleration + damping * rate) / stiffness
        for _ in range(_ROUNDS):
            x = min(abs(lead) / width, 1.0)
            share = 2 * x * x if x < 0.5 else 1 - 2 * (1 - x) ** 2  # of MuJoCo's default midpoint and power
            lead = aim / (least + share * (most - least))
        return lead
