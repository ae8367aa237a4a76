"""All variables of a run of a ball on a surface, from its state and the contact force."""

from collections.abc import Mapping, Sequence

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.columns import SMALLEST, Columns, Variable, axes
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.natural_scales import turn_interval
from proofroll.elements.ball_on_surface.sampling import BallSample
from proofroll.elements.mechanism.run.contacts.local_frame import local_variables
from proofroll.elements.mechanism.run.contacts.on_wall import energy


def from_samples(body: RollingBall, times: FloatArray, samples: Sequence[BallSample]) -> Columns:
    """Variables of a run, from one sample per time [s]; a force missing at time 0 is NaN."""

    def stacked(values: list[FloatArray | None]) -> FloatArray | None:
        return None if any(value is None for value in values) else np.asarray(values, dtype=np.float64)

    forces = [s.force for s in samples]
    if len(forces) > 1 and forces[0] is None:
        forces[0] = np.full(3, np.nan)
    p, v, w = (np.array([np.reshape(getattr(s, key), 3) for s in samples]) for key in ("p_WB", "v_WB", "w_WB"))
    return columns(
        body,
        times,
        p,
        v,
        w,
        force=stacked(forces),
        q_WB=stacked([s.q_WB for s in samples]),
    )


def columns(
    body: RollingBall,
    times: FloatArray,
    p_WB: FloatArray,
    v_WB: FloatArray,
    w_WB: FloatArray,
    *,
    force: FloatArray | None = None,
    q_WB: FloatArray | None = None,
) -> Columns:
    """Variables of a ball that follow from its state and the contact force.

    Variables: ``p_WB`` [m], ``v_WB`` [m/s], ``w_WB`` [rad/s] with dims (time, xyz), ``q_WB`` (time, wxyz);
    the surface's coordinates (``gamma``, unwrapped, and ``z`` on a cylinder) and their rates; ``omega1..3`` [rad/s],
    ``slip2``, ``slip3`` [m/s] and ``N``, ``F2``, ``F3`` [N] in the local frame e1, e2, e3; ``needed_friction``
    |F|/N [1]; ``gap`` [m]; ``energy`` [J]. Variables that the engine does not report are absent.
    """
    variables: dict[str, Variable] = {}

    def put(name: str, values: FloatArray, units: str, meaning: str, *dims: str) -> None:
        variables[name] = Variable(("time", *dims), values, {"units": units, "long_name": meaning})

    put("p_WB", p_WB, "m", "centre of the ball in the world", "xyz")
    put("v_WB", v_WB, "m/s", "velocity of the centre in the world", "xyz")
    put("w_WB", w_WB, "rad/s", "angular velocity in the world", "xyz")
    if q_WB is not None:
        put("q_WB", q_WB, "1", "orientation, quaternion scalar first", "wxyz")
        put("attitude", q_WB, "1", "quaternion of the ball", "wxyz")
    variables |= local_variables(body, times, p_WB, v_WB, w_WB, force, turn_interval(body))
    put("energy", energy(body, p_WB, v_WB, w_WB), "J", "kinetic plus potential energy")
    return Columns(variables | axes(times), _smallest(variables))


def _smallest(variables: Mapping[str, Variable]) -> dict[str, float]:
    """Attribute ``smallest_N``: least normal force at the samples [N] but time 0, where several engines know none."""
    normal_force = variables["N"][1] if "N" in variables else np.zeros(0)
    return (
        {f"{SMALLEST}N": float(np.min(normal_force[1:] if len(normal_force) > 1 else normal_force))}
        if len(normal_force)
        else {}
    )
