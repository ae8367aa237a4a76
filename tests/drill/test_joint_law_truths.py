"""Truths of joint laws over held-out parameters, against equations and a finder of switches that share nothing."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from mechanism_scenes import mechanism_named
from scipy.integrate import solve_ivp

from proofroll.truth.truth_of_mechanism import truth_of
from test_contact_truths import KNOWN, held_out

OWN = 1e-11  # m, rad, 1/s of both: what plain DOP853 at 3e-14 leaves, with room; 4e-12 is seen
RESTS = 1e-7  # m/s: rebounds as slow as this are over


@dataclass
class Motion:
    """Equations of one scene for a state: coordinates first, then velocities.

    Attributes:
        rate: derivative of a state in a mode.
        start: state.
        mode: at the start.
        guards: values of a state in a mode; where the first one rises through zero, the mode ends.
        after: state and mode from there on.
        shown: coordinates and velocities of the scene's joints.
    """

    rate: Callable[[Any, int], Sequence[float]]
    start: Sequence[float]
    mode: int = 0
    guards: Callable[[Any, int], Sequence[float]] = lambda _y, _mode: []
    after: Callable[[Any, int], tuple[Sequence[float], int]] | None = None
    shown: Callable[[Any], tuple[Sequence[float], Sequence[float]]] = lambda y: np.split(np.asarray(y), 2)
    changes: list[float] = field(default_factory=list)

    def at(self, times: Sequence[float]) -> list[Any]:
        """States at growing times [s]; ``changes`` has the times of switches."""
        y, t, mode, found = np.array(self.start, dtype=float), 0.0, self.mode, []
        while len(found) < len(times):
            end = self._end(t, y, times[-1], mode)
            while len(found) < len(times) and (end is None or times[len(found)] < end):
                found.append(self._to(t, y, times[len(found)], mode).y[:, -1])
            if end is not None:
                state, t = self._to(t, y, end, mode).y[:, -1], end
                y, mode = self.after(state, mode)  # type: ignore[misc]
                self.changes.append(t)
        return found

    def _to(self, t: float, y: Any, end: float, mode: int, events: Any = None) -> Any:
        if end == t:
            end = t + 1e-300
        return solve_ivp(lambda _, z: self.rate(z, mode), (t, end), y, "DOP853", rtol=3e-14, atol=1e-15, events=events)

    def _end(self, t: float, y: Any, until: float, mode: int) -> float | None:
        events = []
        for number in range(len(self.guards(y, mode))):
            event = lambda _, z, k=number: self.guards(z, mode)[k]  # noqa: E731
            event.terminal, event.direction = True, 1  # type: ignore[attr-defined]
            events.append(event)
        found = self._to(t, y, until, mode, events)
        if found.status != 1:
            return None
        number = next(k for k, rises in enumerate(found.t_events) if len(rises))
        end = float(found.t_events[number][0])
        for _ in range(3):  # a dense output has fewer digits than a step: Newton's method on fresh steps
            z, h = self._to(t, y, end, mode).y[:, -1], 1e-6
            way = np.array(self.rate(z, mode))
            slope = (self.guards(z + h * way, mode)[number] - self.guards(z - h * way, mode)[number]) / (2 * h)
            end -= self.guards(z, mode)[number] / slope
        return end


def servo(p: Mapping[str, float]) -> Motion:
    """Mass under a servo, with a limit if there is one."""
    bound = p.get("limit", np.inf)

    def effort(y: Any) -> float:
        return float(p["kp"] * (p["target"] - y[0]) - p["kd"] * y[1])

    def guards(y: Any, mode: int) -> list[float]:
        return [bound - mode * effort(y)] if mode else [effort(y) - bound, -effort(y) - bound]

    def after(y: Any, mode: int) -> tuple[Any, int]:
        return y, 0 if mode else int(np.sign(effort(y)))

    start = [0.0, 0.0]
    rate = lambda y, mode: [y[1], (mode * bound if mode else effort(y)) / p["mass"]]  # noqa: E731
    return Motion(rate, start, int(effort(start) > bound), guards if "limit" in p else lambda _y, _mode: [], after)


def rubbing(force: Callable[[float], float], inertia: float, friction: float, start: Sequence[float]) -> Motion:
    """One coordinate under a force and dry friction, which turns round or stays where it stops."""

    def next_way(y: Any) -> int:
        return int(np.sign(force(y[0]))) if abs(force(y[0])) > friction else 0

    def rate(y: Any, way: int) -> list[float]:
        return [y[1], (force(y[0]) - friction * way) / inertia] if way else [0.0, 0.0]

    first = int(np.sign(start[1])) or next_way(start)
    guards = lambda y, way: [-way * y[1]] if way else []  # noqa: E731
    return Motion(rate, start, first, guards, lambda y, _: ([y[0], 0.0], next_way(y)))


def pendulum(p: Mapping[str, float]) -> Motion:
    """Rod on a hinge that rubs."""
    moment = p["mass"] * p["gravity"] * p["length"] / 2
    inertia = p["mass"] * p["length"] ** 2 / 3
    return rubbing(lambda q: -moment * np.sin(q), inertia, p["friction"], [p["angle"], p["speed"]])


def stop(p: Mapping[str, float]) -> Motion:
    """Mass that falls on a stop and rebounds until it is slow."""

    def after(y: Any, _: int) -> tuple[Any, int]:
        back = -p["restitution"] * y[1]
        return ([0.0, back], 1) if back > RESTS else ([0.0, 0.0], 0)

    rate = lambda y, flies: [y[1], -p["gravity"] * flies]  # noqa: E731
    return Motion(rate, [p["height"], 0.0], 1, lambda y, flies: [-y[0]] if flies else [], after)


def damper(p: Mapping[str, float]) -> Motion:
    """Mass in a viscous damper under a force."""
    return Motion(lambda y, _: [y[1], (p["force"] - p["damping"] * y[1]) / p["mass"]], [0.0, p["speed"]])


def gear(p: Mapping[str, float]) -> Motion:
    """Two wheels that a ratio couples: one coordinate with both inertias."""
    inertia, n = p["first"] + p["ratio"] ** 2 * p["second"], p["ratio"]
    return Motion(
        lambda y, _: [y[1], p["torque"] / inertia], [0.0, 0.0], shown=lambda y: ([y[0], n * y[0]], [y[1], n * y[1]])
    )


def arm(p: Mapping[str, float]) -> Motion:
    """Two rods under servos by Lagrange's equations in absolute angles; with armature, or a rotor behind a gear."""
    m, size, g, n = p["mass"], p["length"], p["gravity"], p.get("gear", 0.0)
    tip, rotor, armature = p.get("rotor_mass", 0.0), p.get("rotor", 0.0), p.get("armature", 0.0)
    one, between = np.array([1.0, 0.0]), np.array([-1.0, 1.0])
    turns = np.array([1 - n, n])
    drives = armature * (np.outer(one, one) + np.outer(between, between)) + rotor * np.outer(turns, turns)

    def rate(y: Any, _: int) -> list[float]:
        A, B, dA, dB = y
        c, s = m * size**2 / 2 * np.cos(A - B), m * size**2 / 2 * np.sin(A - B)
        M = np.array([[(m * 4 / 3 + tip) * size**2, c], [c, m * size**2 / 3]]) + drives
        effort = (p["kp1"] * (p["target1"] - A) - p["kd1"] * dA) * one
        effort = effort + (p["kp2"] * (p["target2"] - (B - A)) - p["kd2"] * (dB - dA)) * between
        weight = -g * size * np.array([(1.5 * m + tip) * np.sin(A), m / 2 * np.sin(B)])
        return [dA, dB, *np.linalg.solve(M, effort + weight + [-s * dB**2, s * dA**2])]

    def shown(y: Any) -> tuple[list[float], list[float]]:
        more = [[n * (angles[1] - angles[0])] if rotor else [] for angles in (y[:2], y[2:])]
        return [y[0], y[1] - y[0], *more[0]], [y[2], y[3] - y[2], *more[1]]

    return Motion(rate, [0.0, p.get("elbow", 0.0), 0.0, 0.0], shown=shown)


def governor(p: Mapping[str, float]) -> Motion:
    """Shaft, slider and mirrored rods: three coordinates; the angular momentum of the spin is constant."""
    half, mass, place = (
        p["length"] / 2,
        p["rod"] + p["ball"],
        p["length"] * (0.5 + p["ball"] / (p["rod"] + p["ball"]) / 2),
    )
    thin = p["rod"] * p["width"] ** 2 / 6
    long = p["rod"] * (p["length"] ** 2 + p["width"] ** 2) / 12 + p["rod"] * p["ball"] / mass * half**2
    fixed = thin + p["block"] * p["edge"] ** 2 / 6

    def about_shaft(a: float) -> float:
        reach = p["edge"] / 2 + place * np.cos(a)
        return float(fixed + 2 * (mass * reach**2 + thin * np.sin(a) ** 2 + long * np.cos(a) ** 2))

    momentum = about_shaft(p["angle"]) * p["speed"]

    def rate(y: Any, _: int) -> list[float]:
        _, s, a, ds, da = y
        spin = momentum / about_shaft(a)
        growth = -4 * mass * (p["edge"] / 2 + place * np.cos(a)) * place * np.sin(a) + 4 * (thin - long) * np.sin(
            a
        ) * np.cos(a)
        d = np.array([half * np.cos(a), 2 * half - half * np.sin(a) - s])
        of_a = -half * np.array([np.sin(a), np.cos(a)])
        length = np.linalg.norm(d)
        pull = p["stiffness"] * (length - p["rest"]) + p["damping"] * (d @ (of_a * da - [0, ds])) / length
        moment = -2 * pull * (d @ of_a) / length + 2 * mass * p["gravity"] * place * np.cos(a) + growth * spin**2 / 2
        lift = 2 * pull * d[1] / length - p["block"] * p["gravity"]
        return [spin, ds, da, lift / p["block"], moment / (2 * (mass * place**2 + long))]

    def shown(y: Any) -> tuple[list[float], list[float]]:
        return [y[0], y[1], y[2], y[2]], [momentum / about_shaft(y[2]), y[3], y[4], y[4]]

    return Motion(rate, [0.0, p["slider"], p["angle"], 0.0, 0.0], shown=shown)


def slide(p: Mapping[str, float]) -> Motion:
    """Mass on a spring whose guide rubs."""
    return rubbing(lambda q: -p["stiffness"] * q, p["mass"], p["friction"], [p["start"], 0.0])


def hold(p: Mapping[str, float]) -> Motion:
    """Mass whose guide carries it, or does not."""
    return rubbing(lambda _: -p["mass"] * p["gravity"], p["mass"], p["friction"], [0.0, 0.0])


# Their routes share implicit collocation, so that only this solver, which has none, is independent of that.
STIFF = {"stiff_damper", "flyball_governor"}
# Own equations and end [s], and what a seed changes beyond a part of each number.
SCENES: dict[str, tuple[Callable[[Mapping[str, float]], Motion], float, Callable[[int], dict[str, float]]]] = {
    "servo": (servo, 1.0, lambda _: {}),
    "saturated_servo": (servo, 0.8, lambda _: {}),
    "stiff_damper": (damper, 0.2, lambda seed: {"damping": 10.0 ** (4 - seed)}),
    "friction_hold": (hold, 0.5, lambda seed: {"friction": 15 / (1 + seed)}),
    "spring_friction": (slide, 1.0, lambda _: {}),
    "pendulum_friction": (pendulum, 2.0, lambda seed: {"speed": seed - 1.0}),
    "stop": (stop, 0.9, lambda seed: {"restitution": 0.35 * seed}),
    "gear_pair": (gear, 1.0, lambda seed: {"ratio": -(10.0 ** (seed - 1))}),
    "arm_pd": (arm, 0.6, lambda seed: {"armature": 0.1 * seed}),
    "arm_rotor": (arm, 0.4, lambda seed: {"elbow": 0.4 * seed}),
    "flyball_governor": (governor, 0.12, lambda _: {}),
}  # fmt: skip


@pytest.mark.one_in(3)
@pytest.mark.nightly_of("flyball_governor-0")
@pytest.mark.drill
@pytest.mark.parametrize(("name", "seed"), [(name, 2 * (place % 2)) for place, name in enumerate(SCENES)])
def test_truths_agree_with_an_independent_solver(name: str, seed: int) -> None:
    """Coordinates, velocities and switches over held-out parameters are those of other equations, within the bars."""
    own, until, more = SCENES[name]
    numbers = held_out(name, seed) | more(seed)
    expected, times = own(numbers), [0.0, 0.37 * until, 0.73 * until, until]
    q, v = (np.array(each) for each in zip(*(expected.shown(y) for y in expected.at(times)), strict=True))
    found = truth_of(mechanism_named(name, **numbers), np.array(times))
    assert np.isinf(found.horizon)
    assert any("implicit collocation" in route for route in found.routes) == (name in STIFF)
    pull = max(1.0, float(np.abs(found.record.wrench).max()))  # springs of the governor pull with 20 kN
    sizes = dict.fromkeys(("wrench", "links"), pull)
    assert all(bar[-1] < KNOWN * sizes.get(field_, 1.0) for field_, bar in found.bars.items())
    assert np.abs(found.record.q - q).max() <= found.bars["q"].max() + OWN
    assert np.abs(found.record.v - v).max() <= found.bars["v"].max() + OWN * max(1.0, float(np.abs(v).max()))
    if name != "stop":  # whose last rebounds are summed
        assert [event.time for event in found.events] == pytest.approx(expected.changes, abs=OWN)
