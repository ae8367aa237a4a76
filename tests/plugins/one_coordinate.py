"""Motion of one joint whose body has unit inertia and no weight: its acceleration equals its drives and efforts."""

from __future__ import annotations

from functools import cache

from scipy.integrate import solve_ivp

from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.scene.signal import value_at


@cache
def moved(mechanism: Mechanism, until: float) -> tuple[float, float, list[float]]:
    """Coordinate, velocity and efforts of actuators at a time [s], integrated from the scene's laws alone."""
    (joint,) = mechanism.joints

    def efforts(t: float, q: float, v: float) -> list[float]:
        return [actuator.effort(t, q, v) for actuator in mechanism.actuators]

    def rates(t: float, state: tuple[float, float]) -> tuple[float, float]:
        return state[1], sum(efforts(t, *state)) + float(value_at(joint.torque, t))

    start = (joint.q0[0], joint.v0[0] if joint.v0 else 0.0)
    found = solve_ivp(rates, (0.0, until), start, method="DOP853", rtol=1e-12, atol=1e-13)
    assert found.success
    q, v = (float(value) for value in found.y[:, -1])
    return q, v, efforts(until, q, v)
