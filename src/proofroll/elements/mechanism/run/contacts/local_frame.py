"""A ball in the local frame of its wall: variables, observables and their sizes.

Names are those of the article: coordinates of the surface, spin ω1 to ω3, N, F2 and F3 along e1 (towards the wall), e2
and e3. All of it depends on a trajectory and the ball on its wall, never on an engine.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.arrays import FloatArray, longest, on_turns
from proofroll.core.columns import Variable
from proofroll.core.events import EventKind, events_of
from proofroll.core.observable import Observable, Role
from proofroll.core.whole_turns import doubt
from proofroll.elements.mechanism.run.contacts.audits import energy_balance, force_audit, rate_audit
from proofroll.elements.mechanism.run.contacts.on_wall import BodyOnWall, slip_velocity, wall_velocity
from proofroll.elements.mechanism.run.contacts.stretches import DEGREE, ENDS, FORCES, held_in_flight, with_sticking

if TYPE_CHECKING:
    import xarray as xr

# Least scale of an observable, relative to its natural size: a ball that moves by less than a hundredth of its radius
# (0.25 mm inside the cylinder) looks at rest, and a range of round-off is no scale.
_LEAST = 1e-2
# Below this many of its own error bars the normal force is zero, and the needed friction 0/0.
_NOTHING = 10.0
_ROUND_OFF = 4 * np.finfo(float).eps  # of what the local frame makes of the motion, relative
# Part of its size by which slip may be off where no tolerance is given.
_ALWAYS = 0.5


def local_variables(
    body: BodyOnWall,
    times: FloatArray,
    p_WB: FloatArray,
    v_WB: FloatArray,
    w_WB: FloatArray,
    force: FloatArray | None,
    turn_interval: float | None,
) -> dict[str, Variable]:
    """Variables of a ball in the local frame, from its motion and the force of the wall on it.

    The coordinates of the surface (``gamma``, unwrapped, and ``z`` on a cylinder) and their rates; ``omega1..3``
    [rad/s], ``slip2``, ``slip3``, ``slip`` [m/s]; ``N``, ``F2``, ``F3`` [N] and ``needed_friction`` |F|/N [1] if the
    force is given; ``gap`` [m].

    Args:
        body: the ball on its wall.
        times: [s], shape (time,).
        p_WB: centre [m], shape (time, 3).
        v_WB: its velocity [m/s].
        w_WB: angular velocity [rad/s].
        force: of the wall on the ball [N], shape (time, 3); None: not known.
        turn_interval: longest interval over which turns are counted [s].
    """
    surface = body.surface
    u = np.array(surface.locate(p_WB))
    rates = np.einsum("tij,tj->ti", np.linalg.pinv(surface.tangents(u)), v_WB)
    for column, period in enumerate(surface.periods):
        if period is not None:
            u[:, column] = on_turns(times, u[:, column], rates[:, column], body.u0[column], period)
    frame = surface.frame(u)
    e1 = surface.normal(p_WB)
    spin = np.einsum("tij,ti->tj", frame, w_WB)
    sliding = slip_velocity(body.ball.radius, e1, v_WB, w_WB) - wall_velocity(body, p_WB, e1)
    slip = np.einsum("tij,ti->tj", frame, sliding)
    variables: dict[str, Variable] = {}

    def put(name: str, values: FloatArray, units: str, meaning: str) -> None:
        variables[name] = Variable(("time",), values, {"units": units, "long_name": meaning})

    for index, (name, unit) in enumerate(zip(surface.coordinates, surface.units, strict=True)):
        put(name, u[:, index], unit, f"surface coordinate {name}")
        period = surface.periods[index]
        if period is not None:
            warning = doubt(times, u[:, index], rates[:, index], period, turn_interval)
            variables[name] = variables[name]._replace(attrs={**variables[name].attrs, **warning})
        put(f"{name}_rate", rates[:, index], f"{unit}/s", f"rate of {name}")
    for index in range(3):
        put(f"omega{index + 1}", spin[:, index], "rad/s", f"angular velocity about e{index + 1}")
    for index in (1, 2):
        put(f"slip{index + 1}", slip[:, index], "m/s", f"velocity of the contact point along e{index + 1}")
    put("slip", np.hypot(slip[:, 1], slip[:, 2]), "m/s", "speed of the contact point along the wall")
    if force is not None:
        local = np.einsum("tij,ti->tj", frame, force)
        put("N", 0.0 - local[:, 0], "N", "normal force")  # not -0 in flight
        put("F2", local[:, 1], "N", "friction on the ball along e2")
        put("F3", local[:, 2], "N", "friction on the ball along e3")
        with np.errstate(divide="ignore", invalid="ignore"):
            put("needed_friction", np.hypot(local[:, 1], local[:, 2]) / -local[:, 0], "1", "friction needed, |F|/N")
    put("gap", surface.gap(p_WB), "m", "distance of the ball from the wall")
    return variables


def table(body: BodyOnWall, weight: float, lengths: Sequence[float]) -> tuple[Observable, ...]:
    """Observables of a ball on a surface; the last coordinate decides (on a cylinder the height), or the gap in flight.

    No scale is below a hundredth (:data:`_LEAST`) of the ball's natural size: radius a, largest force m max(g, |p̈|),
    √(g a), m g a, and a friction of 1.

    Args:
        body: the ball on its wall.
        weight: largest of g and the first acceleration of the centre [m/s²].
        lengths: largest way per unit of each coordinate [m/unit].
    """
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
        for name, unit, scale in zip(body.surface.coordinates, body.surface.units, lengths, strict=True)
    )

    bounded = np.isfinite(body.contact.mu_static)
    reason = "" if bounded else "without bounded friction the ball never slips; --set mu_static=…"

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
        Observable("N", "N", "normal force", Role.REACTION, floor=force, headline=True, of_contacts=True),
        Observable("F2", "N", "friction on the ball along e2", Role.REACTION, floor=force, headline=True),
        Observable("F3", "N", "friction on the ball along e3", Role.REACTION, floor=force, headline=True),
        Observable(
            name="needed_friction",
            unit="1",
            meaning="friction needed, |F|/N",
            role=Role.REACTION,
            symbol="|F|/N",
            floor=_LEAST,
        ),
        residual("energy_balance", "J", "energy that is not accounted for", energy, symbol="ΔE"),
        residual("force_audit", "N", "reported minus recomputed contact force", force, asked_for=False, audit=True),
        residual("rate_audit", "m/s", "velocities minus the rates of position and attitude", speed, asked_for=False),
        # A ball that flies is followed in its distance, too, which decides.
        Observable("gap", *apart, Role.MOTION, floor=a, headline=True, decides=True, difference_of="p_WB", apart=True)
        if flies
        else residual("gap", *apart, a, difference_of="p_WB", apart=True),
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
            "first_slip", "s", "time of the first slip", Role.EVENT, absent=reason, watched=bool(bounded), always=always
        ),
        Observable("event_times", "s", "times of all events", Role.EVENT, asked_for=False),
        Observable("event_order", "events", "events of another kind than the truth's", Role.EVENT, asked_for=False),
    )


def observe(body: BodyOnWall, dataset: xr.Dataset) -> dict[str, FloatArray]:
    """Observables that a run allows, by name; those that the engine's values do not determine are absent.

    Coordinates of the surface, and ``attitude`` [1]; ``N``, ``F2``, ``F3`` [N] and ``needed_friction`` [1] without time
    0, where the certificate judges reactions; ``energy_balance`` [J], ``gap`` [m], ``slip`` [m/s], ``force_audit`` [N]
    and ``rate_audit`` [m/s], which are zero for a perfect run. With bounded friction a perfect run may have ``slip``,
    but no ``creep`` [m], the distance slipped while sticking; ``first_slip`` [s] is one value, or none if the ball
    never slips.
    """
    names = [*body.surface.coordinates, *({"attitude"} & set(dataset))]
    curves = {name: dataset[name].to_numpy() for name in names}
    whole = set(FORCES) <= set(dataset)  # a user's file may have only some of them
    curves |= {name: dataset[name].to_numpy()[1:] for name in (*FORCES, "needed_friction") if name in dataset}
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


def scales(body: BodyOnWall, truth: xr.Dataset) -> dict[str, float]:
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


def local_observables(body: BodyOnWall, acceleration: FloatArray) -> tuple[Observable, ...]:
    """Observables of a ball of a mechanism, whose bodies start with accelerations [m/s²], shape (bodies, 3)."""
    g, size = np.linalg.norm(body.gravity), np.linalg.norm(acceleration[body.index])
    weight = float(max(g, size)) if np.isfinite(size) else float(g)
    return table(body, weight or 1.0, body.surface.scales(*body.u0.tolist()))


def local_bars(body: BodyOnWall, dataset: xr.Dataset, bars: Mapping[str, float]) -> dict[str, float]:
    """Error bar of each variable in the local frame, from those of ``p_WB``, ``v_WB``, ``w_WB``, ``q_WB``, ``pressed``.

    An error of the place turns the local frame by as much as the frame turns along the way there.
    """
    u = np.stack([dataset[name].to_numpy() for name in body.surface.coordinates], axis=-1)
    ways = np.linalg.norm(body.surface.tangents(u), axis=-2)
    bends = np.linalg.norm(body.surface.second(u), axis=-3) / (ways[:, :, None] * ways[:, None, :])
    turned = float(bends.max()) * bars["p_WB"] if bends.any() else 0.0  # and not 0 * inf
    a, least = body.ball.radius, ways.min(axis=0).tolist()
    speed, spin = (longest(dataset[name].to_numpy()[:, body.index]) for name in ("v_WB", "w_WB"))
    all_bars = {"attitude": bars["q_WB"], "gap": bars["p_WB"]}
    for name, way in zip(body.surface.coordinates, least, strict=True):
        all_bars |= {name: bars["p_WB"] / way, f"{name}_rate": (bars["v_WB"] + turned * speed) / way}
    all_bars |= {f"omega{number}": bars["w_WB"] + turned * spin for number in (1, 2, 3)}
    moving = bars["v_WB"] + a * bars["w_WB"] + turned * (speed + a * spin)
    all_bars |= dict.fromkeys(("slip", "slip2", "slip3"), moving)
    if "N" in dataset:
        force = np.linalg.norm([dataset[name].to_numpy() for name in FORCES], axis=0)
        all_bars |= dict.fromkeys(FORCES, bars["pressed"] + turned * float(force.max()))
        normal, needed = dataset["N"].to_numpy(), dataset["needed_friction"].to_numpy()
        presses = normal > _NOTHING * all_bars["N"]
        of_friction = np.max(all_bars["N"] * (1 + needed[presses]) / normal[presses], initial=0.0)
        all_bars["needed_friction"] = float(of_friction) if np.isfinite(all_bars["N"]) else np.inf
    values = {name: dataset[name].to_numpy() for name in all_bars}
    sizes = {name: float(np.max(np.abs(value[np.isfinite(value)]), initial=0.0)) for name, value in values.items()}
    return {name: bar + _ROUND_OFF * sizes[name] for name, bar in all_bars.items()}


def observe_locally(body: BodyOnWall, dataset: xr.Dataset) -> dict[str, FloatArray]:
    """Observables of the ball in a run of a mechanism, see :func:`observe`."""
    return observe(body, _of_ball(body, dataset))


def local_sizes(body: BodyOnWall, truth: xr.Dataset) -> dict[str, float]:
    """Size of each observable in the truth of a mechanism, see :func:`scales`."""
    return scales(body, _of_ball(body, truth))


def _of_ball(body: BodyOnWall, dataset: xr.Dataset) -> xr.Dataset:
    """The motion of the ball alone, with ``sticking`` where its events show it, and held where it should never fly."""
    motion = with_sticking(body, dataset.isel(body=body.index))
    return motion if body.flies else held_in_flight(motion)
