"""Balances of a ball on its wall: energy against work, forces against accelerations, velocities against positions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.dataset import BETWEEN
from proofroll.elements.mechanism.run.contacts.on_wall import BodyOnWall, energy, wall_velocity
from proofroll.elements.mechanism.run.contacts.stretches import DEGREE, ENDS, FORCES, accelerations, carried, stretches

if TYPE_CHECKING:
    import xarray as xr

# Number of steps that integrate the turning from one sample to the next.
_SUBSTEPS = 16


def energy_balance(body: BodyOnWall, dataset: xr.Dataset) -> FloatArray:
    """Energy now plus the work that resistance and friction took, minus the energy at the start [J], shape (time,).

    The moment M of the rolling resistance takes the power -M · ω (N f V / a while rolling), friction -F · u, and a wall
    that moves at the velocity w adds F · w; N, F, ω, V and the slip u are the engine's own. Work counts from the first
    sample after time 0, where the certificate judges forces and soft contacts have none, and the shape is then (time -
    1,). Samples off the grid come last.
    """
    bounded, f = "sticking" in dataset, body.contact.rolling_resistance
    if bounded or f or body.wall_rate is not None:
        dataset = dataset.isel(time=slice(1, None))
    balance = dataset["energy"].to_numpy() - float(dataset["energy"][0])
    t = dataset["time"].to_numpy()
    between, few = np.zeros(0), np.zeros(0)
    if BETWEEN in dataset:
        between = dataset[BETWEEN].to_numpy()
        few = _energy(body, dataset, f"{BETWEEN}.") - float(_energy(body, dataset, "")[0])
        between, few = between[between > t[0]], few[between > t[0]]
    power, rests = np.zeros_like(t), False
    if f:
        e1 = body.surface.normal(dataset["p_WB"].to_numpy())
        rests = not np.all(np.any(dataset["v_WB"].to_numpy(), axis=-1))
        motion = (dataset[name].to_numpy() for name in ("p_WB", "v_WB", "w_WB"))
        moment = body.resisting(dataset["N"].to_numpy(), e1, *motion)
        power -= np.einsum("ti,ti->t", moment, dataset["w_WB"].to_numpy())
    if body.wall_rate is not None:
        p_WB = dataset["p_WB"].to_numpy()
        frame = body.surface.frame(body.surface.locate(p_WB))
        carried = np.einsum("tij,ti->tj", frame, wall_velocity(body, p_WB, frame[..., 0]))
        power -= sum(dataset[f"F{i}"].to_numpy() * carried[:, i - 1] for i in (2, 3))
    if bounded:
        power -= sum(dataset[f"F{i}"].to_numpy() * dataset[f"slip{i}"].to_numpy() for i in (2, 3))
    if np.any(power):
        from scipy.interpolate import make_interp_spline

        # Power has kinks where slip begins or ends and where the ball stops; a smooth spline would ring there.
        work = make_interp_spline(t, power, k=1 if bounded or rests else DEGREE).antiderivative()
        balance, few = balance + work(t) - work(t[0]), few + work(between) - work(t[0])
    return np.concatenate([balance, few])


def _energy(body: BodyOnWall, dataset: xr.Dataset, prefix: str) -> FloatArray:
    """Energy of the ball at samples whose variables have a prefix [J]."""
    return energy(body, *(dataset[f"{prefix}{name}"].to_numpy() for name in ("p_WB", "v_WB", "w_WB")))


def force_audit(body: BodyOnWall, dataset: xr.Dataset) -> FloatArray:
    """Reported minus recomputed contact force, largest of the components N, F2, F3 [N], shape (samples,).

    Newton's law along e1, e2, e3 with the acceleration of the engine's own motion: rates of the surface coordinates,
    which vary slowly unlike velocities in the world, are differentiated. Forces jump where slip begins or ends, so that
    each stretch between events is audited separately, without its first and last samples; short stretches are left out.
    :func:`rate_audit` checks that the rates belong to the positions.
    """
    return _joined(_audited(body, stretch) for stretch in stretches(_with_forces(dataset)))


def rate_audit(body: BodyOnWall, dataset: xr.Dataset) -> FloatArray:
    """Differences of the velocities from the rates of the positions, in stretches as :func:`force_audit` [m/s].

    At every sample v is compared with the derivative of the positions and, if an orientation is given, a ω with its
    rate times the radius a. Samples off the grid (:func:`proofroll.core.time_grid.off_grid`) are compared with curves
    through the others: velocity and spin directly, position and orientation over the time from the nearest sample.
    """
    return _joined(_rates_audited(body, stretch) for stretch in stretches(dataset))


def _with_forces(dataset: xr.Dataset) -> xr.Dataset:
    """Values without time 0, if the engine defines reactions only after a first step."""
    late = "N" in dataset and bool(np.isnan(dataset["N"][0]))
    return dataset.isel(time=slice(1, None)) if late else dataset


def _joined(audited: Iterable[FloatArray]) -> FloatArray:
    return np.concatenate([np.zeros(0), *audited])


def _audited(body: BodyOnWall, dataset: xr.Dataset) -> FloatArray:
    """Audit of forces in a stretch without events [N]: on the grid but for its ends, then off it."""

    def apart(columns: Mapping[str, FloatArray], instants: FloatArray) -> FloatArray:
        u, acceleration = accelerations(body.surface, dataset, instants)
        force = body.ball.mass * (acceleration - body.gravity)
        local = np.einsum("tij,ti->tj", body.surface.frame(u), force) * [-1.0, 1.0, 1.0]
        reported = np.stack([columns[name] for name in FORCES], axis=-1)
        return np.asarray(np.max(np.abs(reported - local), axis=-1))

    t, (few, between) = dataset["time"].to_numpy(), _off_grid(dataset)
    audit = apart({name: dataset[name].to_numpy() for name in FORCES}, t)[ENDS:-ENDS]
    return np.concatenate([audit, apart(few, between)]) if "N" in few else audit


def _rates_audited(body: BodyOnWall, dataset: xr.Dataset) -> FloatArray:
    """Audit of rates in a stretch without events [m/s]: on the grid but for its ends, then off it."""
    from scipy.interpolate import make_interp_spline

    surface, t = body.surface, dataset["time"].to_numpy()
    u = np.stack([dataset[name].to_numpy() for name in surface.coordinates], axis=-1)
    curve = make_interp_spline(t, u, k=DEGREE)
    rate = curve.derivative()

    def apart(times: FloatArray, v_WB: FloatArray) -> FloatArray:
        moving = np.einsum("tij,tj->ti", surface.tangents(curve(times)), rate(times))
        tangential = np.einsum("tij,ti->tj", surface.frame(curve(times))[..., 1:], v_WB - moving)
        return np.asarray(np.linalg.norm(tangential, axis=-1))

    audit = apart(t, dataset["v_WB"].to_numpy())[ENDS:-ENDS]
    if "q_WB" in dataset:
        turned = body.ball.radius * _turning_apart(t, dataset["q_WB"].to_numpy(), dataset["w_WB"].to_numpy())
        audit = np.maximum(audit, turned[ENDS : len(t) - ENDS])
    few, times = _off_grid(dataset)
    if not len(times):
        return audit
    # Along the wall only: the distance from it is the gap.
    away = surface.position(surface.locate(few["p_WB"])) - surface.position(curve(times))
    since = np.min(np.abs(times[:, None] - t), axis=1)
    spin = make_interp_spline(t, dataset["w_WB"].to_numpy(), k=DEGREE)
    off = [apart(times, few["v_WB"]), np.linalg.norm(away, axis=-1) / since]
    off.append(body.ball.radius * np.linalg.norm(few["w_WB"] - spin(times), axis=-1))
    if "q_WB" in few:
        last = np.searchsorted(t, times) - 1
        attitudes = np.stack([dataset["q_WB"].to_numpy()[last], few["q_WB"]])
        turned = _apart(attitudes, (t[last], times), (t, dataset["w_WB"].to_numpy()))
        off.append(body.ball.radius * turned / (times - t[last]))
    return np.concatenate([audit, np.max(off, axis=0)])


def _off_grid(dataset: xr.Dataset) -> tuple[dict[str, FloatArray], FloatArray]:
    """Values and times [s] of samples off the grid, away from the ends of a stretch."""
    if BETWEEN not in dataset:
        return {}, np.zeros(0)
    t, between = dataset["time"].to_numpy(), dataset[BETWEEN].to_numpy()
    inside = (between > t[ENDS]) & (between < t[-1 - ENDS])
    few = {str(name): item for name, item in dataset.variables.items() if item.dims[:1] == (BETWEEN,)}
    return {name.removeprefix(f"{BETWEEN}."): item.values[inside] for name, item in few.items()}, between[inside]


def _turning_apart(t: FloatArray, q_WB: FloatArray, w_WB: FloatArray) -> FloatArray:
    """Mean difference of ω and the rate of the orientation between each two samples [rad/s], shape (time - 1,)."""
    return _apart(np.stack([q_WB[:-1], q_WB[1:]]), (t[:-1], t[1:]), (t, w_WB)) / np.diff(t)


def _apart(q_WB: FloatArray, times: tuple[FloatArray, FloatArray], spin: tuple[FloatArray, FloatArray]) -> FloatArray:
    """Angles [rad] between later orientations and earlier ones turned by the spin, given as (t [s], ω [rad/s]).

    ``q_WB``, shape (2, n, 4), are before and after, at these ``times`` [s].
    """
    from scipy.spatial.transform import Rotation

    start, end = (Rotation.from_quat(quaternions, scalar_first=True) for quaternions in q_WB)
    return np.asarray((end * carried(start, *spin, _SUBSTEPS, times).inv()).magnitude())
