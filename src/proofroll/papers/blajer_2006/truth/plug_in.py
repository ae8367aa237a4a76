"""Truth of a ball in an upright cylinder: by two routes of its own if it rolls evenly, else with its first slip."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.dataset import ENDED, ENDS, LAWS
from proofroll.core.dop853 import TIGHTEST, integrate
from proofroll.core.element import Element
from proofroll.core.errors import Diverged, InputError, Refused
from proofroll.core.events import with_events
from proofroll.core.heyoka_library import available
from proofroll.elements.mechanism.dynamics.named_forces import named_forces
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.run.dataset import columns, unturned
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.papers.blajer_2006.ball.as_body import ball_of
from proofroll.papers.blajer_2006.ball.element import EvenRolling
from proofroll.papers.blajer_2006.ball.mechanics import BallMotion, newton_euler
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.papers.blajer_2006.ball.rolling_equations import closed_form, placed, reduced_rates, start
from proofroll.papers.blajer_2006.truth import series
from proofroll.papers.blajer_2006.truth.ball_laws import checked_motion
from proofroll.papers.blajer_2006.truth.onset import edge_between, onset
from proofroll.truth import SAFETY
from proofroll.truth.check.laws.residuals import LawResiduals
from proofroll.truth.plug_in import MechanismTruth

if TYPE_CHECKING:
    import xarray as xr

# Relative round-off of a route: values may be wrong by a few machine epsilons even where the routes agree; and the
# error that two integrations by DOP853 may share, which stop refining at 1e-13 a step.
_ROUND_OFF, _SHARED = 4 * float(np.finfo(float).eps), 1e-12
# Variables that are small differences of large variables, by the start of their name, with the large one.
_DIFFERENCE_OF = {"gap": "p_WB", "slip": "v_WB", "energy_": "energy", "drift": "p_WB"}
_ILL_POSED = "a change of the parameters within their accuracy changes the time of the first slip"
# Below this many of its own error bars the normal force is zero, and the needed friction 0/0.
_NOTHING = 10.0


class BallOnSurfaceTruth:
    """See :class:`proofroll.core.truth.ElementTruth`."""

    @staticmethod
    def covers(element: Element) -> bool:
        """True for every ball in an upright cylinder."""
        return ball_of(element) is not None

    @staticmethod
    def truth(element: Element, times: FloatArray, asks: Sequence[str]) -> xr.Dataset:
        """Motion of the ball and force of the wall on it, with error bars.

        One that may slip has the general truth and the conditioning of its first slip. Of one that rolls evenly the
        first route is the closed form, or with rolling resistance the reduced equations; the second is Newton-Euler
        in the world, derived and integrated independently. They do not turn with the ball, however small and fast that
        is: its orientation, if asked for, is that of the general truth.

        Raises:
            Diverged: a route could not be integrated, or a value is not finite.
            Refused: the first route violates a law from the start.
        """
        assert isinstance(element, MechanismElement)  # by ``covers``
        body, instants = ball_of(element), np.asarray(times, dtype=np.float64)
        assert body is not None
        if not isinstance(element, EvenRolling):
            return _with_onset(body, MechanismTruth.truth(element, times, asks))
        by_series = available() and (not body.contact.rolling_resistance or bool(body.udot0[0]))
        first_route, second_route = (series.reduced, series.unreduced) if by_series else (reduced, unreduced)
        with np.errstate(invalid="ignore", divide="ignore"):  # values that are not finite are refused by name below
            exact = closed_form(body, instants) is not None
            (first, laws), (second, _) = (
                checked_motion(element, body, route, instants, coarse=not (by_series or route is _exact))
                for route in (_exact if exact else first_route, second_route)
            )
            result, check = (_dataset(element, instants, route) for route in (first, second))
        _put_error_bars(result, check, _ROUND_OFF if exact or by_series else _SHARED)
        result.attrs |= {"route": first.route, "second_route": second.route}
        result = _up_to_violation(result, laws)
        result = _with_orientation(result, element, times, asks) if "orientation" in asks else result
        return with_events(result, ())

    @staticmethod
    def edge_between(element: Element, parameter: str, low: float, high: float, until: float) -> float | None:
        """Value of static friction at which the first slip jumps, see :func:`.onset.edge_between`.

        Raises:
            InputError: ``parameter`` is not ``mu_static``.
        """
        ball = ball_of(element)
        assert ball is not None  # by ``covers``
        if parameter != "mu_static":
            advice = "an edge can be found only for mu_static of a ball in an upright cylinder"
            raise InputError(parameter, "edge_between", advice)
        return edge_between(ball, low, high, until)


def _with_onset(ball: RollingBall, dataset: xr.Dataset) -> xr.Dataset:
    """The dataset of a motion that is unique, with the conditioning of the first slip of the ball."""
    if not dataset.attrs["second_route"]:
        return dataset
    first = onset(ball, min(float(dataset["time"][-1]), float(dataset.attrs.get(ENDS, np.inf))))
    dataset.attrs["onset"] = json.dumps(dataclasses.asdict(first))
    if first.verdict == "ill-posed":
        dataset.attrs.setdefault("ill_posed", _ILL_POSED)
    return dataset


def _dataset(element: MechanismElement, times: FloatArray, solved: BallMotion) -> xr.Dataset:
    """Variables of a route, without the orientation."""
    mechanism, count = element.mechanism, len(times)
    assert element.on_wall is not None  # by ``covers``
    placed = Placed(
        mechanism=mechanism,
        time=times,
        p_WB=solved.p_WB[:, None],
        v_WB=solved.v_WB[:, None],
        w_WB=solved.w_WB[:, None],
        q_WB=np.tile([1.0, 0.0, 0.0, 0.0], (count, 1, 1)),
    )
    wrench = np.zeros((count, 2, len(mechanism.connections), 3))
    pressed = element.on_wall.sign * solved.force[:, None]
    named = np.zeros((count, len(named_forces(mechanism))))
    return unturned(columns(element, placed, wrench, pressed, named)).dataset()


def _put_error_bars(result: xr.Dataset, check: xr.Dataset, floor: float) -> None:
    """Gives each variable of ``result`` the attribute ``error_bar`` in its own unit.

    It is ``SAFETY`` times the sum of the largest difference to ``check``, the second route, and ``floor`` times the
    size of the variable: the relative error that both routes may share [1].

    Raises:
        Diverged: a value is not finite, except needed friction at zero normal force.
    """
    for name, values in result.data_vars.items():
        if not np.issubdtype(values.dtype, np.floating):
            continue
        mine, second = values.to_numpy(), check[name].to_numpy()
        if name == "needed_friction":  # N is earlier in data_vars, so it has its error bar
            pressed = np.minimum(*(np.abs(x["N"].to_numpy()) for x in (result, check)))
            on_wall = pressed > _NOTHING * result["N"].attrs["error_bar"]
            mine, second = mine[on_wall], second[on_wall]
        if not (np.all(np.isfinite(mine)) and np.all(np.isfinite(second))):
            raise Diverged(f"the truth is not finite (NaN or overflow) in {name}; take less extreme parameters")
        difference = np.max(np.abs(mine - second), initial=0.0)
        large = next((of for start, of in _DIFFERENCE_OF.items() if str(name).startswith(start)), None)
        if large is not None:  # plus the round-off of the large variable
            difference += _ROUND_OFF * np.max(np.abs(result[large].to_numpy()), initial=0.0)
        values.attrs["error_bar"] = float(SAFETY * (difference + floor * np.max(np.abs(mine), initial=0.0)))


def _exact(body: RollingBall, times: FloatArray) -> BallMotion:
    """Closed form of a motion that has one."""
    motion = closed_form(body, times)
    assert motion is not None
    return motion


def _up_to_violation(dataset: xr.Dataset, laws: LawResiduals) -> xr.Dataset:
    """The dataset with the outcome of its law check, up to the first violation.

    Raises:
        Refused: a law is violated from the start.
    """
    text = laws.broken("the motion that was followed")
    if laws.first is None:
        return dataset.assign_attrs({LAWS: held} if (held := laws.held()) else {})
    end = laws.first.time
    if not end > float(dataset["time"][0]):
        raise Refused(text)
    return dataset.isel(time=slice(int((dataset["time"] < end).sum()))).assign_attrs({ENDS: end, ENDED: text})


def _with_orientation(
    result: xr.Dataset, element: MechanismElement, times: FloatArray, asks: Sequence[str]
) -> xr.Dataset:
    """The truth with the orientation of the general one, up to the end of that.

    Raises:
        Diverged: the general truth moves in another way.
    """
    turning = MechanismTruth.truth(element, times, asks)
    result = result.isel(time=slice(len(turning["time"])))
    for name in ("p_WB", "w_WB"):
        apart = float(np.abs(result[name] - turning[name]).max())
        if not apart <= result[name].attrs["error_bar"] + turning[name].attrs["error_bar"]:
            raise Diverged(f"{name} of two truths of the ball are {apart:.3g} apart, more than their error bars")
    ends = {name: turning.attrs[name] for name in ("ill_posed",) if name in turning.attrs}
    ended = [item.attrs for item in (result, turning) if ENDS in item.attrs]
    if ended:
        first = min(ended, key=lambda attrs: float(attrs[ENDS]))
        ends |= {name: first[name] for name in (ENDS, ENDED)}
    routes = {name: f"{result.attrs[name]}; orientation by {turning.attrs[name]}" for name in ("route", "second_route")}
    return result.assign(turning[["q_WB", "attitude", "attitudes"]].data_vars).assign_attrs(routes | ends)


# Absolute tolerance relative to the natural size of each state: the round-off where a state passes through zero.
_LEAST = 1e-15


def reduced(body: RollingBall, times: FloatArray) -> BallMotion:
    """Motion at rising times [s] by the reduced equations: (u, u̇, ω1) on the surface's parametrisation.

    Raises:
        Diverged: the integration fails.
    """
    length, speed, spin = _sizes(body)
    per_metre = 1 / np.array(body.surface.length_scales)
    scales = np.array([*(length * per_metre), *(speed * per_metre), spin])
    states = _integrated(lambda x: reduced_rates(body, x)[0], scales, start(body), times)
    evaluated = [reduced_rates(body, x) for x in states]
    v, force = (np.array([item[i] for item in evaluated]) for i in (1, 2))
    return BallMotion(*placed(body, states, v), force, "reduced equations, DOP853")


def unreduced(body: RollingBall, times: FloatArray) -> BallMotion:
    """Motion at rising times [s] by Newton-Euler in the world; the surface is known by its signed distance alone.

    Raises:
        Diverged: the integration fails.
    """

    def rates(x: FloatArray) -> FloatArray:
        acceleration, w_rate, _ = newton_euler(body, x[:3], x[3:6], x[6:])
        return np.concatenate([x[3:6], acceleration, w_rate])

    states = _integrated(rates, np.repeat(_sizes(body), 3), np.concatenate([body.p0, body.v0, body.w0]), times)
    p, v, w = states[:, :3], states[:, 3:6], states[:, 6:]
    force = np.array([newton_euler(body, *x)[2] for x in zip(p, v, w, strict=True)])
    return BallMotion(p_WB=p, v_WB=v, w_WB=w, force=force, route="unreduced Newton-Euler, DOP853")


def _sizes(body: RollingBall) -> tuple[float, float, float]:
    """Natural length [m], speed [m/s] and spin [rad/s] of the motion, none of them zero."""
    a = body.ball.radius
    speed = math.sqrt(a * float(np.linalg.norm(body.gravity))) + float(np.linalg.norm(body.v0))
    speed = speed + a * float(np.linalg.norm(body.w0)) or 1.0
    return a, speed, speed / a


def _integrated(
    rates: Callable[[FloatArray], FloatArray], scales: FloatArray, x: FloatArray, times: FloatArray
) -> FloatArray:
    """States at the times, shape (n, k), from the state at the first one."""
    spans = times - times[0]
    longest = float(spans[1]) if len(spans) > 1 else None  # a step that reaches a point without curvature names it
    states = integrate(lambda _, y: rates(y), x, spans, TIGHTEST, least=_LEAST * scales, first_step=longest)
    return np.array(list(states))
