"""Numbers that a trajectory is judged by: observables, their scales, the energy balance and the force audit.

Everything here sees a trajectory and the scene's ball, never an engine.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from proofroll.events import events_of
from proofroll.mechanics import resistance_moment
from proofroll.scene import RollingBall
from proofroll.surfaces import FloatArray

if TYPE_CHECKING:
    import xarray as xr

# Observables besides the coordinates of the scene's surface.
_UNITS = {
    "N": "N",
    "F2": "N",
    "F3": "N",
    "needed_friction": "1",
    "energy_balance": "J",
    "force_audit": "N",
    "gap": "m",
    "slip": "m/s",
    "creep": "m",
    "first_slip": "s",
    "event_times": "s",
    "event_order": "events",
}
OBSERVABLES = tuple(_UNITS)
# Observables that have no size of their own to which a percentage could refer.
WITHOUT_SCALE = frozenset({"first_slip", "event_times", "event_order"})


# Degree of the splines through the samples. Sampled twenty times per oscillation of z, a derivative of degree 7 is
# good to about 1e-6 of its size; what is left is measured on the truth and reported as the error bar.
_DEGREE = 7
# The ends of an interpolating spline's derivative are worse than its middle; the audit leaves them out.
_ENDS = 5


@dataclass(frozen=True)
class Observable:
    """A curve that can be held against the truth.

    Attributes:
        name: as in the comparison file.
        unit: of its values.
        values: over time, shape (time,); zero is perfect where the truth is zero by definition.
    """

    name: str
    unit: str
    values: FloatArray


def observables(body: RollingBall, dataset: xr.Dataset) -> dict[str, Observable]:
    """All curves that the trajectory allows, by name; what the engine cannot say is absent.

    Coordinates of the surface, ``N``, ``F2``, ``F3`` [N] and ``needed_friction`` [-] as they are, without time 0,
    where the certificate judges reactions; ``energy_balance`` [J], ``gap`` [m], ``slip`` [m/s] and ``force_audit``
    [N], which are zero for a perfect run. With bounded friction ``slip`` is not zero; ``creep`` [m] is, the way
    slipped while sticking, and ``first_slip`` [s] is one value, or none if the ball never slips.
    """
    curves: dict[str, Observable] = {}

    def put(name: str, unit: str, values: FloatArray) -> None:
        curves[name] = Observable(name, unit, values)

    for name, unit in zip(body.surface.coordinates, body.surface.units, strict=True):
        put(name, unit, dataset[name].to_numpy())
    if "N" in dataset:
        for name in ("N", "F2", "F3", "needed_friction"):
            put(name, dataset[name].attrs["units"], dataset[name].to_numpy()[1:])
    put("gap", "m", dataset["gap"].to_numpy())
    put("slip", "m/s", np.hypot(dataset["slip2"].to_numpy(), dataset["slip3"].to_numpy()))
    if dataset.sizes["time"] > 2 * (_DEGREE + 1) + 2 * _ENDS:
        if "N" in dataset or not body.contact.rolling_resistance:
            put("energy_balance", "J", energy_balance(body, dataset))
        if "N" in dataset:
            audited = force_audit(body, dataset)
            if audited.size:
                put("force_audit", "N", audited)
    if "event_kind" in dataset:
        put("event_times", "s", np.array([event.time for event in events_of(dataset)]))
    if "sticking" in dataset:
        slips = [event.time for event in events_of(dataset) if event.kind == "slip"]
        put("first_slip", "s", np.array(slips[:1]))
        put("creep", "m", np.array([_creep(curves["slip"].values, dataset)]))
    return curves


def _creep(slip: FloatArray, dataset: xr.Dataset) -> float:
    """Way slipped while sticking [m]; an interval counts if the ball sticks at both of its ends."""
    sticking, t = dataset["sticking"].to_numpy().astype(bool), dataset["time"].to_numpy()
    both = sticking[1:] & sticking[:-1]
    return float(np.sum(both * np.diff(t) * (slip[1:] + slip[:-1]) / 2))


def units(body: RollingBall) -> dict[str, str]:
    """Unit of every observable that a comparison may name."""
    return dict(zip(body.surface.coordinates, body.surface.units, strict=True)) | _UNITS


def scales(body: RollingBall, truth: xr.Dataset) -> dict[str, float]:
    """Size of each observable in this case, to which a relative tolerance refers.

    A coordinate's range; the largest normal force for every force; the largest needed friction; the initial kinetic
    energy; the ball's radius for the gap; the initial speed for slip. Never zero.
    """
    normal = float(np.max(np.abs(truth["N"].to_numpy())))
    speed = float(np.linalg.norm(body.v0))
    kinetic = 0.5 * body.ball.mass * speed**2 + 0.5 * body.ball.inertia * float(body.w0 @ body.w0)
    sizes = {name: float(np.ptp(truth[name].to_numpy())) for name in body.surface.coordinates}
    sizes |= dict.fromkeys(("N", "F2", "F3", "force_audit"), normal)
    sizes["needed_friction"] = float(np.nanmax(truth["needed_friction"].to_numpy()))
    sizes |= {"energy_balance": kinetic, "gap": body.ball.radius, "slip": speed, "creep": body.ball.radius}
    return {name: size if np.isfinite(size) and size > 0 else 1.0 for name, size in sizes.items()}


def energy_balance(body: RollingBall, dataset: xr.Dataset) -> FloatArray:
    """Energy now plus what resistance and friction took, minus the energy at the start [J], shape (time,).

    Rolling resistance takes -M · ω from the ball per second (N f V / a while it rolls), friction -F · u; N, F, ω, V
    and the slip u are the engine's own.
    """
    balance = dataset["energy"].to_numpy() - float(dataset["energy"][0])
    t, f = dataset["time"].to_numpy(), body.contact.rolling_resistance
    bounded = "sticking" in dataset
    power, rests = np.zeros_like(t), False
    if f:
        e1 = body.surface.normal(dataset["p_WB"].to_numpy())
        rests = not np.all(np.any(dataset["v_WB"].to_numpy(), axis=-1))
        moment = resistance_moment(f, dataset["N"].to_numpy(), e1, dataset["v_WB"].to_numpy())
        power -= np.einsum("ti,ti->t", moment, dataset["w_WB"].to_numpy())
    if bounded:
        power -= sum(dataset[f"F{i}"].to_numpy() * dataset[f"slip{i}"].to_numpy() for i in (2, 3))
    if np.any(power):
        from scipy.interpolate import make_interp_spline

        # The power has kinks where slip begins and ends and where the ball stops, at which a smooth spline would ring.
        work = make_interp_spline(t, power, k=1 if bounded or rests else _DEGREE).antiderivative()
        balance = balance + work(t) - work(t[0])
    return np.asarray(balance)


def force_audit(body: RollingBall, dataset: xr.Dataset) -> FloatArray:
    """Reported minus recomputed contact force, largest of the components N, F2, F3 [N], shape (samples,).

    Newton's law along e1, e2, e3 with the acceleration from the engine's own motion: the rates of the surface
    coordinates are differentiated (they turn slowly, unlike the world components), the rest is geometry. Forces jump
    where slip begins or ends, so each stretch between events is taken by itself, without its first and last samples;
    stretches of few samples are left out.
    """
    t = dataset["time"].to_numpy()
    inner = [event.time for event in events_of(dataset)]
    cuts = [0, *np.searchsorted(t, inner).tolist(), len(t)]
    stretches = [dataset.isel(time=slice(start, end)) for start, end in itertools.pairwise(cuts)]
    audited = [_audited(body, stretch) for stretch in stretches if stretch.sizes["time"] > _DEGREE + 2 * _ENDS]
    return np.concatenate(audited) if audited else np.zeros(0)


def _audited(body: RollingBall, dataset: xr.Dataset) -> FloatArray:
    """The audit of a stretch without events, shape (time - 10,)."""
    from scipy.interpolate import make_interp_spline

    surface, t = body.surface, dataset["time"].to_numpy()
    u = np.stack([dataset[name].to_numpy() for name in surface.coordinates], axis=-1)
    rates = np.stack([dataset[f"{name}_rate"].to_numpy() for name in surface.coordinates], axis=-1)
    second = make_interp_spline(t, rates, k=_DEGREE).derivative()(t)
    acceleration = np.einsum("tij,tj->ti", surface.tangents(u), second)
    acceleration += np.einsum("tijk,tj,tk->ti", surface.second(u), rates, rates)
    force = body.ball.mass * (acceleration - body.gravity)
    local = np.einsum("tij,ti->tj", surface.frame(u), force) * [-1.0, 1.0, 1.0]
    reported = np.stack([dataset[name].to_numpy() for name in ("N", "F2", "F3")], axis=-1)
    return np.asarray(np.max(np.abs(reported - local), axis=-1)[_ENDS:-_ENDS])
