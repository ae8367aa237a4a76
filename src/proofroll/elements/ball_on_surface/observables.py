"""Observables of a ball, their scales, the energy balance and the audits of forces and rates.

All of it depends on a trajectory and the scene's ball, never on an engine.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.dataset import BETWEEN
from proofroll.core.events import EventKind, events_of
from proofroll.core.observable import Observable, Role
from proofroll.elements.ball_on_surface.mechanics import energy, natural_acceleration, resistance_moment, wall_velocity
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.stretches import DEGREE, ENDS, accelerations, carried, stretches

if TYPE_CHECKING:
    import xarray as xr

# Least scale of an observable, relative to its natural size: a ball that moves by less than a hundredth of its radius
# (0.25 mm inside the cylinder) looks at rest, and a range of round-off is no scale.
_LEAST = 1e-2
# Part of its size by which slip may be off where no tolerance is given.
_ALWAYS = 0.5
_FORCES = ("N", "F2", "F3")
# Number of steps that integrate the turning from one sample to the next.
_SUBSTEPS = 16


def table(body: RollingBall) -> tuple[Observable, ...]:
    """Observables of a ball on a surface; the last coordinate decides (on a cylinder the height), or the gap in flight.

    No scale is below a hundredth (:data:`_LEAST`) of the ball's natural size: radius a, largest force m max(g, |p̈|),
    √(g a), m g a, and a friction of 1.
    """
    weight = natural_acceleration(body)
    a, force = _LEAST * body.ball.radius, _LEAST * body.ball.mass * weight
    speed, energy = _LEAST * math.sqrt(weight * body.ball.radius), force * body.ball.radius
    last, flies = body.surface.coordinates[-1], body.flies
    coordinates = tuple(
        Observable(
            name,
            unit,
            f"surface coordinate {name}",
            Role.MOTION,
            floor=a / scale,
            headline=True,
            decides=name == last and not flies,
        )
        for name, unit, scale in zip(
            body.surface.coordinates, body.surface.units, body.surface.length_scales, strict=True
        )
    )

    bounded = np.isfinite(body.contact.mu_static)
    never = "" if bounded else "without bounded friction the ball never slips; --set mu_static=…"

    apart = "m", "distance of the ball from the wall"

    # A ball that flies may begin and end slip in flight, unseen
    always = _ALWAYS if bounded and not body.flies else 0.0

    def residual(name: str, unit: str, meaning: str, floor: float, **more: Any) -> Observable:
        return Observable(name, unit, meaning, Role.RESIDUAL, floor=floor, hangs_on_events=False, **more)

    return (
        *coordinates,
        Observable(
            "attitude",
            "1",
            "quaternion of the ball, of either sign",
            Role.MOTION,
            floor=1.0,
            asked_for=False,
            asked_as="orientation",
        ),
        Observable("N", "N", "normal force", Role.REACTION, floor=force, headline=True, column=True),
        Observable("F2", "N", "friction on the ball along e2", Role.REACTION, floor=force, headline=True),
        Observable("F3", "N", "friction on the ball along e3", Role.REACTION, floor=force, headline=True, column=True),
        Observable(
            name="needed_friction",
            unit="1",
            meaning="friction needed, |F|/N",
            role=Role.REACTION,
            symbol="|F|/N",
            floor=_LEAST,
        ),
        residual("energy_balance", "J", "energy that is not accounted for", energy, symbol="ΔE", column=not bounded),
        residual("force_audit", "N", "reported minus recomputed contact force", force, asked_for=False, audit=True),
        residual("rate_audit", "m/s", "velocities minus the rates of position and attitude", speed, asked_for=False),
        # A ball that flies is followed in its distance, too, which decides.
        Observable("gap", *apart, Role.MOTION, floor=a, headline=True, decides=True, difference_of="p_WB")
        if flies
        else residual("gap", *apart, a, difference_of="p_WB"),
        # Without a bound on friction slip is an error; with one the true ball slips, and slip is an observable of the
        # motion.
        Observable(
            "slip",
            "m/s",
            "speed of the contact point along the wall",
            Role.MOTION if bounded or flies else Role.RESIDUAL,
            floor=speed,
        ),
        residual("creep", "m", "way slipped while sticking", a, always=always),
        Observable(
            "first_slip",
            "s",
            "time of the first slip",
            Role.EVENT,
            column=True,
            absent=never,
            watched=bool(bounded),
            always=always,
        ),
        Observable("event_times", "s", "times of all events", Role.EVENT, asked_for=False),
        Observable("event_order", "events", "events of another kind than the truth's", Role.EVENT, asked_for=False),
    )


def observe(body: RollingBall, dataset: xr.Dataset) -> dict[str, FloatArray]:
    """Observables that a run allows, by name; those that the engine's values do not determine are absent.

    Coordinates of the surface, and ``attitude`` [1]; ``N``, ``F2``, ``F3`` [N] and ``needed_friction`` [1] without time
    0, where the certificate judges reactions; ``energy_balance`` [J], ``gap`` [m], ``slip`` [m/s], ``force_audit`` [N]
    and ``rate_audit`` [m/s], which are zero for a perfect run. With bounded friction a perfect run may have ``slip``,
    but no ``creep`` [m], the distance slipped while sticking; ``first_slip`` [s] is one value, or none if the ball
    never slips.
    """
    names = [*body.surface.coordinates, *({"attitude"} & set(dataset))]
    curves = {name: dataset[name].to_numpy() for name in names}
    whole = set(_FORCES) <= set(dataset)  # a user's file may have only some of them
    curves |= {name: dataset[name].to_numpy()[1:] for name in (*_FORCES, "needed_friction") if name in dataset}
    curves["gap"] = dataset["gap"].to_numpy()
    curves["slip"] = dataset["slip"].to_numpy()
    if dataset.sizes["time"] > 2 * (DEGREE + 1) + 2 * ENDS:
        # The energy that impacts dissipate is unknown.
        dissipates = body.contact.rolling_resistance or body.wall_rate is not None or "sticking" in dataset
        balanced = whole or not dissipates
        if balanced and not body.flies:
            curves["energy_balance"] = energy_balance(body, dataset)
        if whole:
            audited = force_audit(body, dataset)
            if audited.size:
                curves["force_audit"] = audited
        rates = rate_audit(body, dataset)
        if rates.size:
            curves["rate_audit"] = rates
    if "event_kind" in dataset:
        curves["event_times"] = np.array([event.time for event in events_of(dataset)])
    if "sticking" in dataset:
        curves["first_slip"] = np.array(
            [event.time for event in events_of(dataset) if event.kind == EventKind.SLIP][:1]
        )
        curves["creep"] = np.array([creep(dataset)])
    return curves


def creep(dataset: xr.Dataset) -> float:
    """Distance slipped while sticking [m]: over intervals whose both ends stick, or all if sticking is not known."""
    slip, t = dataset["slip"].to_numpy(), dataset["time"].to_numpy()
    sticking = dataset["sticking"].to_numpy().astype(bool) if "sticking" in dataset else np.ones(len(t), dtype=bool)
    both = sticking[1:] & sticking[:-1]
    return float(np.sum(both * np.diff(t) * (slip[1:] + slip[:-1]) / 2))


def scales(body: RollingBall, truth: xr.Dataset) -> dict[str, float]:
    """Size of each observable in the truth; floors are those of :func:`table`.

    Ranges of coordinates, the largest normal force and needed friction, the kinetic energy and the speed of the start,
    the ball's radius, and the distance slipped.
    """
    normal, friction = float(np.max(np.abs(truth["N"].to_numpy()))), truth["needed_friction"].to_numpy()
    speed = float(np.linalg.norm(body.v0))
    kinetic = 0.5 * body.ball.mass * speed**2 + 0.5 * body.ball.inertia * float(body.w0 @ body.w0)
    sizes = {name: float(np.ptp(truth[name].to_numpy())) for name in body.surface.coordinates}
    sizes |= dict.fromkeys(("N", "F2", "F3", "force_audit"), normal)
    sizes["needed_friction"] = float(np.max(friction[np.isfinite(friction)], initial=0.0))
    sizes |= dict.fromkeys(("slip", "rate_audit"), speed)
    height = float(np.ptp(truth["gap"].to_numpy())) if body.flies else body.ball.radius
    slipped = max(body.ball.radius, float(np.trapezoid(truth["slip"], truth["time"])))
    return sizes | {"attitude": 1.0, "energy_balance": kinetic, "gap": height, "creep": slipped}


def energy_balance(body: RollingBall, dataset: xr.Dataset) -> FloatArray:
    """Energy now plus the work that resistance and friction took, minus the energy at the start [J], shape (time,).

    Rolling resistance takes the power -M · ω (N f V / a while rolling), friction -F · u, and a wall that moves at the
    velocity w adds F · w; N, F, ω, V and the slip u are the engine's own. Without a force at time 0, work counts from
    the first sample that has one, and the shape is (time - 1,). Samples off the grid come last.
    """
    dataset = _with_forces(dataset)
    balance = dataset["energy"].to_numpy() - float(dataset["energy"][0])
    t, f = dataset["time"].to_numpy(), body.contact.rolling_resistance
    between, few = np.zeros(0), np.zeros(0)
    if BETWEEN in dataset:
        between = dataset[BETWEEN].to_numpy()
        few = energy(body, *(dataset[f"{BETWEEN}.{name}"].to_numpy() for name in ("p_WB", "v_WB", "w_WB")))
        few = few - float(dataset["energy"][0])
        between, few = between[between > t[0]], few[between > t[0]]
    bounded = "sticking" in dataset
    power, rests = np.zeros_like(t), False
    if f:
        e1 = body.surface.normal(dataset["p_WB"].to_numpy())
        rests = not np.all(np.any(dataset["v_WB"].to_numpy(), axis=-1))
        moment = resistance_moment(f, dataset["N"].to_numpy(), e1, dataset["v_WB"].to_numpy())
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


def force_audit(body: RollingBall, dataset: xr.Dataset) -> FloatArray:
    """Reported minus recomputed contact force, largest of the components N, F2, F3 [N], shape (samples,).

    Newton's law along e1, e2, e3 with the acceleration of the engine's own motion: rates of the surface coordinates,
    which vary slowly unlike velocities in the world, are differentiated. Forces jump where slip begins or ends, so that
    each stretch between events is audited separately, without its first and last samples; short stretches are left out.
    :func:`rate_audit` checks that the rates belong to the positions.
    """
    return _joined(_audited(body, stretch) for stretch in stretches(_with_forces(dataset)))


def rate_audit(body: RollingBall, dataset: xr.Dataset) -> FloatArray:
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


def _audited(body: RollingBall, dataset: xr.Dataset) -> FloatArray:
    """Audit of forces in a stretch without events [N]: on the grid but for its ends, then off it."""

    def apart(columns: Mapping[str, FloatArray], instants: FloatArray) -> FloatArray:
        u, acceleration = accelerations(body.surface, dataset, instants)
        force = body.ball.mass * (acceleration - body.gravity)
        local = np.einsum("tij,ti->tj", body.surface.frame(u), force) * [-1.0, 1.0, 1.0]
        reported = np.stack([columns[name] for name in _FORCES], axis=-1)
        return np.asarray(np.max(np.abs(reported - local), axis=-1))

    t, (few, between) = dataset["time"].to_numpy(), _off_grid(dataset)
    audit = apart({name: dataset[name].to_numpy() for name in _FORCES}, t)[ENDS:-ENDS]
    return np.concatenate([audit, apart(few, between)]) if "N" in few else audit


def _rates_audited(body: RollingBall, dataset: xr.Dataset) -> FloatArray:
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
