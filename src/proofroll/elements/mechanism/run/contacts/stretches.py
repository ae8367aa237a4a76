"""Stretches of samples between events, long enough for splines, with accelerations and rotations."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.dataset import BETWEEN
from proofroll.core.events import EventKind, events_of
from proofroll.elements.mechanism.run.contacts.on_wall import BodyOnWall, LocalCoordinates

if TYPE_CHECKING:
    import xarray as xr
    from scipy.spatial.transform import Rotation

# Degree of the splines through the samples. With twenty samples per oscillation of z, a derivative of degree 7 has a
# relative error of about 1e-6, which is measured on the truth and reported as the error bar.
DEGREE = 7
# The ends of an interpolating spline's derivative are worse than its middle; they are left out.
ENDS = 5
# Components of the wall's force on a ball in the local frame.
FORCES = ("N", "F2", "F3")


def with_sticking(body: BodyOnWall, dataset: xr.Dataset) -> xr.Dataset:
    """The run with ``sticking`` at each sample, as its events show it, where friction is bounded and it has events.

    A sample at an event belongs to what follows it.
    """
    if np.isinf(body.contact.mu_static) or "event_kind" not in dataset:
        return dataset
    kinds = {EventKind.SLIP: False, EventKind.STICK: True, EventKind.REST: True}
    changes = [(event.time, kinds[EventKind(event.kind)]) for event in events_of(dataset) if event.kind in kinds]
    stuck = not changes or not changes[0][1]  # what sticks first has slipped
    reached = np.searchsorted([time for time, _ in changes], dataset["time"].to_numpy(), side="right")
    sticks = np.array([stuck, *(sticks for _, sticks in changes)])[reached]
    return dataset.assign(sticking=("time", sticks))


def held_in_flight(dataset: xr.Dataset) -> xr.Dataset:
    """The run with no gap and no slip from each lift-off to the next impact: in flight they are no errors."""
    if "event_kind" not in dataset:
        return dataset
    kinds = {EventKind.LIFT_OFF: True, EventKind.IMPACT: False, EventKind.BOUNCE: True, EventKind.SETTLE: False}
    changes = [(event.time, kinds[EventKind(event.kind)]) for event in events_of(dataset) if event.kind in kinds]
    instants, flies = [time for time, _ in changes], np.array([False, *(flies for _, flies in changes)])
    if not flies.any():
        return dataset
    held = {}
    for axis, prefix in (("time", ""), (BETWEEN, f"{BETWEEN}.")):  # and samples off the grid
        for name in (prefix + name for name in ("gap", "slip", "slip2", "slip3") if prefix + name in dataset):
            aloft = flies[np.searchsorted(instants, dataset[axis].to_numpy(), side="right")]
            held[name] = dataset[name].where(~aloft, 0.0).assign_attrs(dataset[name].attrs)
    return dataset.assign(held)


def stretches(dataset: xr.Dataset) -> list[xr.Dataset]:
    """Parts of a run between its events that have enough samples for the splines."""
    t = dataset["time"].to_numpy()
    cuts = [0, *np.searchsorted(t, [event.time for event in events_of(dataset)]).tolist(), len(t)]
    if len(cuts) == 2:  # a cut of all variables would take longer than the use of the parts
        parts = [dataset]
    else:
        parts = [dataset.isel(time=slice(start, end)) for start, end in itertools.pairwise(cuts)]
    return [part for part in parts if part.sizes["time"] > DEGREE + 2 * ENDS]


def accelerations(
    surface: LocalCoordinates, dataset: xr.Dataset, moments: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """Surface coordinates, (time, 2), and accelerations of the centre [m/s²], (time, 3), in a stretch without events.

    They come from the rates of the coordinates, which vary slowly, unlike velocities in the world. They are given at
    the samples, or ``moments`` other times [s].
    """
    from scipy.interpolate import make_interp_spline

    t = dataset["time"].to_numpy()
    moments = t if moments is None else moments
    u = np.stack([dataset[name].to_numpy() for name in surface.coordinates], axis=-1)
    rates = np.stack([dataset[f"{name}_rate"].to_numpy() for name in surface.coordinates], axis=-1)
    curve = make_interp_spline(t, rates, k=DEGREE)
    second = curve.derivative()(moments)
    if moments is not t:
        u, rates = make_interp_spline(t, u, k=DEGREE)(moments), curve(moments)
    acceleration = np.einsum("tij,tj->ti", surface.tangents(u), second)
    acceleration += np.einsum("tijk,tj,tk->ti", surface.second(u), rates, rates)
    return u, acceleration


def carried(
    start: Rotation, t: FloatArray, w_WB: FloatArray, substeps: int, spans: tuple[FloatArray, FloatArray] | None = None
) -> Rotation:
    """Orientations ``start`` turned by the spin over the spans of time, or without ``spans`` to the next sample.

    The ball may turn more than once from sample to sample, so ω is integrated, by Magnus steps of fourth order
    (Blanes, Casas, Oteo & Ros, Phys. Rep. 470, 2009, section 5.4).

    Args:
        start: orientations at the begin of each span, or at all samples but the last.
        t: times of the samples [s].
        w_WB: spin at the samples [rad/s], shape (time, 3).
        substeps: Magnus steps in each span.
        spans: begins and ends of the spans [s].
    """
    from scipy.interpolate import make_interp_spline
    from scipy.spatial.transform import Rotation

    begin, end = (t[:-1], t[1:]) if spans is None else spans
    spin, h = make_interp_spline(t, w_WB, k=min(DEGREE, len(t) - 1)), (end - begin)[:, None] / substeps
    for step in range(substeps):
        early, late = (spin(begin + (step + 0.5 + side / np.sqrt(12)) * h[:, 0]) for side in (-1, 1))
        start = Rotation.from_rotvec(h * (early + late) / 2 - np.sqrt(3) / 12 * h**2 * np.cross(early, late)) * start
    return start
