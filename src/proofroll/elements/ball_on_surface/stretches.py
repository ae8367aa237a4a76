"""What a run's own samples say between events: stretches long enough for splines, accelerations, turns."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.events import events_of
from proofroll.elements.ball_on_surface.surfaces import Surface

if TYPE_CHECKING:
    import xarray as xr
    from scipy.spatial.transform import Rotation

# Degree of the splines through the samples. Sampled twenty times per oscillation of z, a derivative of degree 7 is
# good to about 1e-6 of its size; what is left is measured on the truth and reported as the error bar.
DEGREE = 7
# The ends of an interpolating spline's derivative are worse than its middle; they are left out.
ENDS = 5


def stretches(dataset: xr.Dataset) -> list[xr.Dataset]:
    """The samples between events, where they are enough for the splines."""
    t = dataset["time"].to_numpy()
    cuts = [0, *np.searchsorted(t, [event.time for event in events_of(dataset)]).tolist(), len(t)]
    if len(cuts) == 2:  # to cut each of the many variables would take longer than what follows
        parts = [dataset]
    else:
        parts = [dataset.isel(time=slice(start, end)) for start, end in itertools.pairwise(cuts)]
    return [part for part in parts if part.sizes["time"] > DEGREE + 2 * ENDS]


def accelerations(surface: Surface, dataset: xr.Dataset) -> tuple[FloatArray, FloatArray]:
    """Surface coordinates, shape (time, 2), and accelerations of the centre [m/s²], (time, 3), without events between.

    The rates of the coordinates are differentiated, for they turn slowly, unlike velocities in the world.
    """
    from scipy.interpolate import make_interp_spline

    t = dataset["time"].to_numpy()
    u = np.stack([dataset[name].to_numpy() for name in surface.coordinates], axis=-1)
    rates = np.stack([dataset[f"{name}_rate"].to_numpy() for name in surface.coordinates], axis=-1)
    second = make_interp_spline(t, rates, k=DEGREE).derivative()(t)
    acceleration = np.einsum("tij,tj->ti", surface.tangents(u), second)
    acceleration += np.einsum("tijk,tj,tk->ti", surface.second(u), rates, rates)
    return u, acceleration


def carried(start: Rotation, t: FloatArray, w_WB: FloatArray, substeps: int) -> Rotation:
    """Where the spin [rad/s], shape (time, 3), turns ``start`` from each sample to the next.

    The ball may turn more than once from sample to sample, so ω is integrated, by Magnus steps of fourth order
    (Blanes, Casas, Oteo & Ros, Phys. Rep. 470, 2009, section 5.4).

    ``start`` are the orientations at all samples but the last, ``t`` the times of the samples [s].
    """
    from scipy.interpolate import make_interp_spline
    from scipy.spatial.transform import Rotation

    spin, h = make_interp_spline(t, w_WB, k=min(DEGREE, len(t) - 1)), np.diff(t)[:, None] / substeps
    for step in range(substeps):
        one, two = (spin(t[:-1] + (step + 0.5 + side / np.sqrt(12)) * h[:, 0]) for side in (-1, 1))
        start = Rotation.from_rotvec(h * (one + two) / 2 - np.sqrt(3) / 12 * h**2 * np.cross(one, two)) * start
    return start
