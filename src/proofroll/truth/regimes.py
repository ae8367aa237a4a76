"""The map of what becomes of the ball, over initial speed and friction: one run of the truth per point."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from enum import IntEnum
from functools import partial
from multiprocessing import active_children, get_context
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.element import rolling_ball
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.surfaces import Cylinder
from proofroll.running.ending import end_with_pool
from proofroll.truth.stick_slip import first_route
from proofroll.truth.switching import End, follow
from proofroll.truth.variants import at_speed, with_contact

if TYPE_CHECKING:
    import xarray as xr


class Regime(IntEnum):
    """What becomes of the ball until the end of the run."""

    NEVER_SLIPS = 0
    RECOVERS = 1  # slips, and sticks at the end or still could carry its weight by friction
    FALLS = 2  # slips at the end, and all the friction there is does not carry its weight; or has left the wall


def classify(body: RollingBall, until: float) -> tuple[Regime, int, float]:
    """What becomes of the ball until ``until`` [s], how often it began to slip, and when first [s] (nan: never)."""
    route = first_route(body)
    path = follow(body, route, until)
    slips = [time for kind, time in path.events if kind == "slip"]
    first = slips[0] if slips else float("nan")
    last = path.legs[-1]
    if not slips:
        return Regime.NEVER_SLIPS, 0, first
    if any(leg.why is End.LIFTOFF for leg in path.legs):
        return Regime.FALLS, len(slips), first
    if last.sticking or _carries(body, *route.world(last.state)[:2]):
        return Regime.RECOVERS, len(slips), first
    return Regime.FALLS, len(slips), first


def _carries(body: RollingBall, p_WB: FloatArray, v_WB: FloatArray) -> bool:
    """Whether friction could hold the weight along the surface if it pointed straight against it."""
    e1 = body.surface.normal(p_WB)
    along = float(e1 @ body.gravity)
    press = along + v_WB @ body.surface.normal_gradient(p_WB) @ v_WB  # N/m
    return bool(body.contact.mu_kinetic * press >= np.linalg.norm(body.gravity - along * e1))


def regime_map(
    scene: Scene,
    speeds: Sequence[float] | FloatArray,
    frictions: Sequence[float] | FloatArray,
    *,
    until: float = 4.0,
    workers: int = 1,
    progress: Callable[[int], None] | None = None,
) -> xr.Dataset:
    """The map over initial speed × static friction; the ratio μk/μs is the scene's (1 where it has no bound).

    Args:
        scene: one ball on one surface; its other parameters are kept.
        speeds: of the centre [m/s], shape (n,).
        frictions: μs [-], shape (m,).
        until: length of each run [s].
        workers: number of processes; 1 runs in this one.
        progress: called with the number of runs just finished.

    Returns:
        Dataset with dims ``speed``, ``mu_static``: ``regime`` (:class:`Regime`), ``slips`` (count), ``first_slip``
        [s, nan: never]; and per speed, where :func:`analytic_boundaries` knows them, ``mu_falls`` and ``mu_slips``.
    """
    import xarray as xr

    body = rolling_ball(scene)
    mus = np.asarray(frictions, dtype=np.float64)
    row = partial(_row, body, mus, until)
    rows = []
    for values in _mapped(row, [float(speed) for speed in speeds], workers):
        rows.append(values)
        if progress is not None:
            progress(len(mus))
    regime, slips, first = np.moveaxis(np.array(rows).reshape(len(rows), len(mus), 3), -1, 0)
    dims = ("speed", "mu_static")
    meaning = ", ".join(f"{item.value}: {item.name.lower().replace('_', ' ')}" for item in Regime)
    result = xr.Dataset(
        {
            "regime": (dims, regime.astype(np.int8), {"units": "1", "long_name": meaning}),
            "slips": (dims, slips.astype(np.int64), {"units": "1", "long_name": "how often a slip began"}),
            "first_slip": (dims, first, {"units": "s", "long_name": "time of the first slip"}),
        },
        coords={
            "speed": ("speed", np.asarray(speeds, dtype=np.float64), {"units": "m/s"}),
            "mu_static": ("mu_static", mus, {"units": "1"}),
        },
        attrs={"scene": scene.name, "until": until, "rolling_resistance": body.contact.rolling_resistance},
    )
    bounds = analytic_boundaries(body, result["speed"].to_numpy())
    if bounds is not None:
        falls, slipping = bounds
        result["mu_falls"] = ("speed", falls, {"units": "1", "long_name": "below: falls, without rolling resistance"})
        result["mu_slips"] = ("speed", slipping, {"units": "1", "long_name": "above: never slips, without resistance"})
    return result


def analytic_boundaries(body: RollingBall, speeds: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """μ below which the ball falls and above which it never slips, without rolling resistance [-], shape (n,).

    From the closed form on a vertical cylinder with a level start and no spin about the normal; None elsewhere. The
    friction needed is m g (1 - cos νt / (1 + κ)) with κ = J/ma²: at most 12/7 of the weight of a homogeneous ball.
    """
    surface = body.surface
    if not isinstance(surface, Cylinder):
        return None
    axis, e1 = np.asarray(surface.generators[1].axis), surface.normal(body.p0)
    gravity = float(np.linalg.norm(body.gravity))
    if np.any(np.cross(axis, body.gravity)) or abs(body.v0 @ axis) > 0 or abs(body.w0 @ e1) > 0:
        return None
    kappa = body.ball.inertia_ratio
    falls = gravity * surface.radius / speeds**2
    return falls, falls * (2 + kappa) / (1 + kappa)


def _row(body: RollingBall, mus: FloatArray, until: float, speed: float) -> list[tuple[float, float, float]]:
    here = at_speed(body, speed)
    return [classify(with_contact(here, mu_static=float(mu)), until) for mu in mus]


def _mapped(
    row: Callable[[float], list[tuple[float, float, float]]], speeds: list[float], workers: int
) -> Iterable[list[tuple[float, float, float]]]:
    if workers == 1:
        yield from map(row, speeds)
        return
    # Not forked: a parent that shows progress has threads, and a fork copies their locks as they are.
    with ProcessPoolExecutor(workers, get_context("spawn"), initializer=end_with_pool) as pool:
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # inherited: Ctrl-C is the parent's affair
        try:
            # Not map, which cancels the rest when interrupted: a pool whose processes are then ended complains.
            rows = [pool.submit(row, speed) for speed in speeds]
        finally:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
        try:
            for one in rows:
                yield one.result()
        except BaseException:
            for process in active_children():
                process.kill()
            raise
