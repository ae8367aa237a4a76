"""Steps of a mechanism in parts of its time constants, and the longest step that servos allow."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.element import StepNumber
from proofroll.elements.mechanism.scene.rotations import Array

if TYPE_CHECKING:
    import xarray as xr

    from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
    from proofroll.elements.mechanism.run.element import MechanismElement


@dataclass(frozen=True)
class ServoSteps:
    """Longest stable steps of a semi-implicit Euler scheme with linear servos about a pose.

    Attributes:
        explicit: with kp and kd at the state before the step [s].
        implicit: with kd at the velocity after the step [s]; inf: every step is stable.
    """

    explicit: float
    implicit: float

    def sentence(self, steps: Iterable[float]) -> str:
        """Clause on the bounds and on the steps that engines take [s]."""
        taken = sorted(set(steps))
        bound = f"explicit PD needs h ≤ {self.explicit:.2g} s with these gains and masses"
        if math.isfinite(self.implicit):
            bound += f" (implicit kd: {self.implicit:.2g} s)"
        if not taken:
            return bound
        shown = f"{taken[0]:g}" if len(taken) == 1 else f"{taken[0]:g} to {taken[-1]:g}"
        ratio = taken[-1] / self.explicit
        return f"{bound}; you have {shown} s" + (f", {ratio:.2g} times too much" if ratio > 1 else "")


def step_numbers(element: MechanismElement, h: float, truth: xr.Dataset | None) -> tuple[StepNumber, ...]:
    """Step ``h`` [s] in parts of the time constants of a mechanism."""
    spin = float(np.max(np.linalg.norm(element.start.w_WB, axis=-1)))
    fastest = None if truth is None else float(np.max(np.linalg.norm(truth["w_WB"].to_numpy(), axis=-1)))
    fall = float(np.sqrt(np.linalg.norm(element.mechanism.gravity) / element.length))
    damper, spring = (float(rates.max(initial=0.0)) for rates in element.law_rates)
    laws = [
        StepNumber("damper", "hc/m", "step in parts of the time constant of a joint's damper or servo", damper * h),
        StepNumber("servo", "h√(k/m)", "angle [rad] of a joint on its spring or servo in a step", spring * h),
    ]
    return (
        StepNumber("spin", "|ω0|h", "largest angle [rad] by which a body turns in the first step", spin * h),
        StepNumber("rotation", "h|ω|", "largest angle [rad] by which a body turns in a step", fastest and fastest * h),
        StepNumber("fall", "h√(g/L)", "step in parts of the time of a fall by the mechanism's size", fall * h),
        *(number for number in laws if number.value),
    )


def law_rates(equations: JointCoordinates) -> tuple[Array, Array]:
    """Rates of the joints' dampers [1/s] and springs [rad/s] at the start, servos included; ascending, (freedoms).

    Loops and couplings are taken into account: a servo behind a gear moves the reflected inertia, too.
    """
    of_joints, of_servos = equations.joint_gains(), equations.servo_gains()
    damping, stiffness = of_joints[0] + of_servos[0], of_joints[1] + of_servos[1]
    if not (damping.any() or stiffness.any()):
        return damping[equations.rank :], stiffness[equations.rank :]
    dampers, springs = (np.asarray(np.linalg.eigvalsh(law), float) for law in _modal(equations, damping, stiffness))
    return dampers, np.asarray(np.sqrt(np.maximum(springs, 0.0)), float)


def servo_steps(equations: JointCoordinates) -> ServoSteps | None:
    """Longest stable steps of a mechanism's servos at the start; None: it has none.

    The step map v⁺ = v - h M⁻¹(Kd v + Kp q), q⁺ = q + h v⁺ leaves the unit circle at -1, where
    4 M - 2 h Kd - h² Kp is singular; with kd at v⁺ it is 4 M + 2 h Kd - h² Kp. Limits of efforts are left
    out. None also where the mass matrix is singular.
    """
    damping, stiffness = equations.servo_gains()
    if not (damping.any() or stiffness.any()):
        return None
    try:
        C, K = _modal(equations, damping, stiffness)
    except np.linalg.LinAlgError:  # the mass matrix is singular: massless bodies
        return None
    return ServoSteps(_first_root(C, K), _first_root(-C, K))


def _first_root(C: Array, K: Array) -> float:
    """Smallest h above 0 for which 4 - 2 h C - h² K is singular [s], by 1/h as an eigenvalue; inf: there is none."""
    count = len(C)
    rates = np.linalg.eigvals(np.block([[C / 2, K / 4], [np.eye(count), np.zeros((count, count))]]))
    scale = float(np.abs(rates).max(initial=0.0))
    largest = max((float(rate.real) for rate in rates if abs(rate.imag) <= _REAL * scale), default=0.0)
    return 1 / largest if largest > _REAL * scale else math.inf


_REAL = 1e-7  # part of the largest eigenvalue that is round-off: of double eigenvalues it has half of the digits


def _modal(equations: JointCoordinates, *laws: Array) -> list[Array]:
    """Gains along velocities, each (nv,), as matrices in independent coordinates with the mass matrix 1."""
    motion = equations.tree.at(*equations.mechanism.start())
    M, rows = equations.inertial(motion)[1], equations.tree.loop_rows(motion).C
    matrices = [np.diag(law) for law in laws]
    if equations.rank:
        free = np.linalg.svd(rows)[2][equations.rank :].T
        M, *matrices = (free.T @ matrix @ free for matrix in (M, *matrices))
    into = np.linalg.inv(np.linalg.cholesky(M))
    return [into @ matrix @ into.T for matrix in matrices]
