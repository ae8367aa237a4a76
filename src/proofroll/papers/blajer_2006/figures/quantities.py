"""Quantities of figures and statements by name: curves over time from a trajectory."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.papers.blajer_2006.ball.model import RollingBall

if TYPE_CHECKING:
    import xarray as xr

# Rotation, nutation and precession, in the order in which scipy gives them last, second and first.
ANGLES = ("psi", "theta", "phi")
TIME = "time"
# Variables of a trajectory on any surface.
_STORED = {
    "omega1": "rad/s", "omega2": "rad/s", "omega3": "rad/s", "slip2": "m/s", "slip3": "m/s", "N": "N", "F2": "N",
    "F3": "N", "needed_friction": "1", "gap": "m", "energy": "J",
}  # fmt: skip


@dataclass(frozen=True)
class Derived:
    """A curve that is computed from a trajectory.

    Attributes:
        unit: unit of its values.
        values: (the scene's ball, trajectory) -> values, shape (time,); raises KeyError if the engine lacks a variable.
    """

    unit: str
    values: Callable[[RollingBall, xr.Dataset], FloatArray]


def _component(name: str, index: int) -> Callable[[RollingBall, xr.Dataset], FloatArray]:
    return lambda _, dataset: np.asarray(dataset[name].to_numpy()[:, index])


def _length(name: str, components: int = 3) -> Callable[[RollingBall, xr.Dataset], FloatArray]:
    return lambda _, dataset: np.asarray(np.linalg.norm(dataset[name].to_numpy()[:, :components], axis=1))


_DERIVED = {
    "x": Derived("m", _component("p_WB", 0)),
    "y": Derived("m", _component("p_WB", 1)),
    "z": Derived("m", _component("p_WB", 2)),
    "axis_distance": Derived("m", _length("p_WB", 2)),  # of the centre from the world's z axis
    "horizontal_speed": Derived("m/s", _length("v_WB", 2)),
    "vertical_speed": Derived("m/s", _component("v_WB", 2)),
    "speed": Derived("m/s", _length("v_WB")),
    "angular_speed": Derived("rad/s", _length("w_WB")),
    "slip": Derived("m/s", lambda _, dataset: np.hypot(dataset["slip2"].to_numpy(), dataset["slip3"].to_numpy())),
}


def known(body: RollingBall) -> dict[str, str]:
    """Unit of every quantity of a ball on this surface, by name."""
    coordinates = dict(zip(body.surface.coordinates, body.surface.units, strict=True))
    rates = {f"{name}_rate": f"{unit}/s" for name, unit in coordinates.items()}
    derived = {name: item.unit for name, item in _DERIVED.items()}
    return {TIME: "s"} | coordinates | rates | _STORED | derived | dict.fromkeys(ANGLES, "rad")


def quantity(name: str, body: RollingBall, dataset: xr.Dataset, start: Sequence[float]) -> FloatArray | None:
    """Values of a quantity at the trajectory's samples, shape (time,); None: the trajectory does not have it.

    Args:
        name: one of :func:`known`.
        body: the scene's ball.
        dataset: the trajectory.
        start: Euler angles φ, θ, ψ of the body's axes at time 0 [rad], where every run's quaternion is the identity.
    """
    if name in ANGLES:
        return euler_angles(dataset["q_WB"].to_numpy(), start)[ANGLES.index(name)] if "q_WB" in dataset else None
    try:
        if name in _DERIVED:
            return _DERIVED[name].values(body, dataset)
        return np.asarray(dataset[name].to_numpy(), dtype=np.float64)
    except KeyError:
        return None


def euler_angles(q_WB: FloatArray, start: Sequence[float]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Precession ψ, nutation θ and rotation φ of the body's axes [rad], each of shape (time,), ψ and φ unwrapped.

    Classical angles z-x-z as in Blajer (2006), section 2.1. The samples must be so close that neither ψ nor φ turns
    by π between two of them.

    Args:
        q_WB: orientation, scalar first, identity at time 0, shape (time, 4).
        start: φ, θ, ψ at time 0 [rad].
    """
    from scipy.spatial.transform import Rotation  # half a second, which every page would pay

    phi, theta, psi = start
    turned = Rotation.from_quat(np.roll(q_WB, -1, axis=1)) * Rotation.from_euler("ZXZ", [psi, theta, phi])
    with warnings.catch_warnings():  # near θ = 0 one of φ and ψ is arbitrary, which the figure shows by itself
        warnings.filterwarnings("ignore", message="Gimbal lock")
        angles = np.asarray(turned.as_euler("ZXZ"))
    # scipy's branch may be a whole turn away from the one that the motion begins on.
    whole = 2 * math.pi * np.round((np.array([psi, theta, phi]) - angles[0]) / (2 * math.pi))
    unwrapped = np.unwrap(angles, axis=0) + whole
    return unwrapped[:, 0], angles[:, 1], unwrapped[:, 2]
