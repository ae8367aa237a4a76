"""Equivalence first: what the engine really built, held against the scene before anything is stepped."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.certificate import EXACT, Line
from proofroll.core.engine import Built, Sample
from proofroll.elements.ball_on_surface.mechanics import (
    initial_angular_acceleration,
    initial_response,
    natural_acceleration,
    slip_velocity,
)
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.resting import stands


def certify(body: RollingBall, built: Built, sample: Sample) -> list[Line]:
    """Compares what was built, and the sample at time 0, with the ball on its surface.

    Quantities about which the engine is silent are left out, except those that the scene requires it to have:
    rolling resistance and bounded friction.
    """
    acceleration, force, turning = _expected(body, built)
    natural = natural_acceleration(body)
    frame = body.surface.frame(body.u0)
    fall = float(np.sqrt(body.ball.radius * np.linalg.norm(body.gravity)))
    speed = float(np.linalg.norm(body.v0)) or fall or 1.0
    spin = max(float(np.linalg.norm(body.w0)), speed / body.ball.radius)
    lines: list[Line] = []

    def compare(quantity: str, unit: str, expected: Any, found: Any, scale: float, required: bool = False) -> None:
        if found is None:
            if not required:
                return
            found = np.nan
        want, got = np.atleast_1d(np.asarray(expected, float)), np.atleast_1d(np.asarray(found, float))
        difference = float(np.max(np.abs(got - want))) / scale if got.shape == want.shape else float("inf")
        soft = built.regularised.get(quantity)
        lines.append(
            Line(
                quantity,
                unit,
                tuple(want.tolist()),
                tuple(got.tolist()),
                difference if np.isfinite(difference) else float("inf"),
                soft.tolerance if soft else EXACT,
                soft.because if soft else "",
            )
        )

    compare("mass", "kg", body.ball.mass, built.mass, body.ball.mass)
    compare("inertia", "kg m^2", np.full(3, body.ball.inertia), built.inertia, body.ball.inertia)
    compare("gravity", "m/s^2", body.gravity, built.gravity, float(np.linalg.norm(body.gravity)) or 1.0)
    compare("ball radius", "m", body.ball.radius, built.ball_radius, body.ball.radius)
    f = body.contact.rolling_resistance
    compare("rolling resistance", "m", f, built.rolling_resistance, f or body.ball.radius, required=f > 0)
    for name, expected, found in (
        ("static friction", body.contact.mu_static, built.mu_static),
        ("kinetic friction", body.contact.mu_kinetic, built.mu_kinetic),
    ):
        bounded = np.isfinite(expected)
        if bounded:
            compare(name, "1", expected, found, expected or 1.0, required=True)
        elif found is not None:  # a number that stands for no bound is the closer to it, the larger it is
            compare(f"1 / {name}", "1", 0.0, 1 / found if found else np.inf, 1.0)
    compare("position", "m", body.p0, sample.p_WB, body.ball.radius)
    compare("gap", "m", 0.0, body.surface.gap(sample.p_WB), body.ball.radius)
    compare("gap in the engine", "m", 0.0, built.gap, body.ball.radius)
    compare("velocity", "m/s", body.v0, sample.v_WB, speed)
    compare("spin", "rad/s", body.w0, sample.w_WB, spin)
    slip = slip_velocity(body.ball.radius, body.surface.normal(sample.p_WB), sample.v_WB, sample.w_WB)
    compare("slip", "m/s", np.zeros(3), slip, speed)
    compare("acceleration", "m/s^2", acceleration, built.acceleration, natural)
    compare("angular acceleration", "rad/s^2", turning, built.angular_acceleration, natural / body.ball.radius)
    if sample.force is not None:
        for index, (name, sign) in enumerate((("N", -1.0), ("F2", 1.0), ("F3", 1.0))):
            compare(
                name,
                "N",
                sign * force @ frame[:, index],
                sign * sample.force @ frame[:, index],
                body.ball.mass * natural,
            )
    return lines


def _expected(body: RollingBall, built: Built) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Acceleration, force and angular acceleration at time 0.

    At rest the resistance has no direction yet. An engine may apply that of the motion to come, or none until it
    moves: the one that it means is expected of everything it says.
    """
    meant, said = body, built.acceleration
    if stands(body, body.v0) and said is not None:
        free = dataclasses.replace(body, contact=dataclasses.replace(body.contact, rolling_resistance=0.0))
        meant = min((body, free), key=lambda one: float(np.linalg.norm(initial_response(one)[0] - said)))
    return *initial_response(meant), initial_angular_acceleration(meant)
