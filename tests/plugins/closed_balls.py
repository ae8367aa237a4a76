"""Motions of balls in closed form, by textbooks alone: on planes, and in an upright cylinder.

A motion is (centre, velocity, spin) at times, and the kinds and times of its events. The parameters are those of the
scenes in ``models/``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
A, G, K = 0.025, 9.81, 0.4


class Closed(NamedTuple):
    """Centre, velocity, spin at each time [SI], shape (time, 3), and events as (kind, time)."""

    p: Array
    v: Array
    w: Array
    events: list[tuple[str, float]]


class _Plane:
    """A plane through the origin; ``n`` out of it, ``e`` down the slope, ``c`` across it."""

    def __init__(self, tilt: float) -> None:
        self.n = np.array([np.sin(tilt), 0.0, np.cos(tilt)])
        self.e, self.c = np.array([np.cos(tilt), 0.0, -np.sin(tilt)]), np.array([0.0, -1.0, 0.0])
        self.down, self.press = G * np.sin(tilt), G * np.cos(tilt)

    def slip(self, v: Array, w: Array) -> Array:
        """Velocity of the contact point along the plane."""
        u = v - A * np.cross(w, self.n)
        return np.asarray(u - (u @ self.n) * self.n)

    def start(self, parameters: Mapping[str, float], speed: float, rolls: bool) -> tuple[Array, Array]:
        """Velocity and spin at the start."""
        v = parameters.get("speed", speed) * self.e + parameters.get("cross_speed", 0.0) * self.c
        w = -parameters.get("normal_spin", 0.0) * self.n
        if rolls:
            return v, w + np.cross(self.n, v) / A
        return v, w + parameters.get("side_spin", 0.0) * self.e + parameters.get("back_spin", 0.0) * self.c


def rolling_down(parameters: Mapping[str, float], times: Array) -> Closed:
    """A slope: the ball rolls with (g sin)/(1 + k), or slips from the start on what needs more friction."""
    plane, mu = _Plane(parameters.get("tilt", 0.35)), parameters.get("mu_static", np.inf)
    v0, w0 = plane.start({"cross_speed": 0.2, **parameters}, 0.5, rolls=True)
    needed = K / (1 + K) * plane.down / plane.press
    friction = K / (1 + K) * plane.down if needed <= mu else parameters.get("mu_kinetic", mu) * plane.press
    t = times[:, None]
    v = v0 + t * (plane.down - friction) * plane.e
    p = A * plane.n + t * v0 + t**2 / 2 * (plane.down - friction) * plane.e
    w = w0 + t * friction / (K * A) * np.cross(plane.n, plane.e)
    return Closed(p, v, w, [])


def sliding_to_roll(parameters: Mapping[str, float], times: Array) -> Closed:
    """A level plane: friction is constant until the slip has ended; then the ball rolls evenly."""
    plane, mu = _Plane(0.0), parameters.get("mu_kinetic", parameters.get("mu_static", 0.2))
    v0, w0 = plane.start(parameters, 2.0, rolls=False)
    u = plane.slip(v0, w0)
    way = u / np.linalg.norm(u)
    end = float(np.linalg.norm(u)) / ((1 + 1 / K) * mu * G)
    slides = np.minimum(times, end)[:, None]
    v = v0 - mu * G * slides * way
    p = A * plane.n + slides * v0 - mu * G * slides**2 / 2 * way + (times[:, None] - slides) * v
    w = w0 + mu * G * slides / (K * A) * np.cross(plane.n, way)
    return Closed(p, v, w, [("stick", end)])


def resisted(parameters: Mapping[str, float], times: Array) -> Closed:
    """A level plane with rolling resistance f: the ball slows down by g f/a/(1 + k), and rests."""
    plane, slowing = _Plane(0.0), 5e-4 * G / A / (1 + K)
    v0, w0 = plane.start(parameters, 0.5, rolls=True)
    speed = float(np.linalg.norm(v0))
    t = np.minimum(times, speed / slowing)[:, None]
    v = v0 * (1 - slowing * t / speed)
    w = (w0 @ plane.n) * plane.n + np.cross(plane.n, v) / A
    return Closed(A * plane.n + t * v0 * (1 - slowing * t / (2 * speed)), v, w, [])


def on_turntable(_: Mapping[str, float], times: Array) -> Closed:
    """A table that turns at 3 rad/s: circles at k/(1 + k) of its rate."""
    plane, rate = _Plane(0.0), 3.0
    p0, v0 = np.array([0.3, 0.0, A]), np.array([0.1, -0.2, 0.0])
    turning, t = K / (1 + K) * rate, times[:, None]
    aside = np.cross(plane.n, v0)
    v = np.cos(turning * t) * v0 + np.sin(turning * t) * aside
    p = p0 + (np.sin(turning * t) * v0 + (1 - np.cos(turning * t)) * aside) / turning
    carried = rate * np.cross(plane.n, p)
    return Closed(p, v, np.cross(plane.n, v - carried) / A, [])


def in_cylinder(parameters: Mapping[str, float], times: Array) -> Closed:
    """An upright cylinder: an even turn, and a height that oscillates at √(k/(1 + k)) of its rate (Blajer 2006)."""
    c = 0.225 - A
    rate = parameters.get("speed", 4.0) / c
    frequency, angle = np.sqrt(K / (1 + K)) * rate, rate * times
    fall = -G / (1 + K)
    z = fall / frequency**2 * (1 - np.cos(frequency * times))
    rising = fall / frequency * np.sin(frequency * times)
    cos, sin, zero, one = np.cos(angle), np.sin(angle), 0 * angle, 1 + 0 * angle
    out, along, up = (np.stack(parts, axis=-1) for parts in ([cos, sin, zero], [-sin, cos, zero], [zero, zero, one]))
    p = c * out + z[:, None] * up
    v = rate * c * along + rising[:, None] * up
    w = (rate * z / A)[:, None] * out + (rising / A)[:, None] * along - rate * c / A * up
    return Closed(p, v, w, [])


def bouncing(parameters: Mapping[str, float], times: Array) -> Closed:
    """A ball that falls on a plane: between impacts its acceleration is constant, and a sphere has one law of impact.

    Normal and tangent decouple: the slip is reversed by the tangential restitution, or friction slides through.
    """
    plane, e = _Plane(parameters.get("tilt", 0.0)), parameters.get("restitution", 0.8)
    e_t = parameters.get("tangential_restitution", 0.0)
    static = parameters.get("mu_static", np.inf)
    kinetic = parameters.get("mu_kinetic", static)
    v, w = plane.start(parameters, 0.0, rolls=False)
    gravity = np.array([0.0, 0.0, -G])
    p, t, motion = (A + parameters.get("height", 1.0)) * plane.n, 0.0, [np.zeros((len(times), 3)) for _ in range(3)]
    events = list[tuple[str, float]]()
    while True:
        normal, height = float(v @ plane.n), float(p @ plane.n) - A
        lasts = (normal + np.sqrt(normal**2 + 2 * plane.press * height)) / plane.press
        flies = (times >= t) & (times < t + lasts)
        s = (times[flies] - t)[:, None]
        for values, own in zip(motion, (p + s * v + s**2 / 2 * gravity, v + s * gravity, w + 0 * s), strict=True):
            values[flies] = own
        t += lasts
        if t > times[-1]:
            return Closed(*motion, events)
        events.append(("impact", t))
        p, v = p + lasts * v + lasts**2 / 2 * gravity, v + lasts * gravity
        push = -(1 + e) * float(v @ plane.n)
        u = plane.slip(v, w)
        held = (1 + e_t) * u / (1 + 1 / K)
        size = float(np.linalg.norm(held))
        rubbed = held if size <= static * push else kinetic * push * u / np.linalg.norm(u)
        v = v + push * plane.n - rubbed
        w = w + np.cross(plane.n, rubbed) / (K * A)


# Scene -> closed form of its motion, and the condition on the parameters with which it holds.
FORMS: Mapping[str, tuple[Callable[[Mapping[str, float], Array], Closed], Callable[[Mapping[str, float]], bool]]] = {
    "inclined_plane": (rolling_down, lambda _: True),
    "slide_to_roll": (sliding_to_roll, lambda _: True),
    "rolling_stop": (resisted, lambda _: True),
    "turntable": (on_turntable, lambda _: True),
    "bouncing_ball": (bouncing, lambda _: True),
    "sphere_in_cylinder": (in_cylinder, lambda own: not {"mu_static", "rolling_resistance"} & set(own)),
}
