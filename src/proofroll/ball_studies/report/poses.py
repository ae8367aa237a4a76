"""Place, orientation and forces of a ball at the frames of a replay, from a stored trajectory.

Trajectories are sampled for comparison, not for the eye: between two samples a fast ball turns by half a revolution.
The stored rates give the motion between them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from proofroll.core.arrays import FloatArray
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.surfaces import Surface

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

# Variables of a trajectory, by their names there; "time" among them.
Sampled = Mapping[str, npt.NDArray[Any]]
# Those that a replay needs, where they are.
NEEDED = (
    "time", "p_WB", "v_WB", "w_WB", "q_WB", "omega1", "omega2", "omega3", "N", "F2", "F3", "sticking", "event_kind",
    "event_time",
)  # fmt: skip

# Steps of the quadrature of the spin from one frame to the next; with 1.2 rad a frame its error is below 1e-5 rad.
_SUBSTEPS = 4

SLIPS, STICKS, AWAY = 0, 1, 2
_AFTER = {"slip": SLIPS, "stick": STICKS, "lift_off": AWAY, "bounce": AWAY, "settle": STICKS}


@dataclass(frozen=True)
class Poses:
    """A ball at n frames.

    Attributes:
        time: of the frames [s], shape (n,).
        p_WB: centre [m], shape (n, 3).
        q_WB: orientation, scalar first, shape (n, 4), or None if there is none.
        contact: point of the wall's surface that the ball touches or is nearest to [m], shape (n, 3).
        normal: e1, from the ball towards the wall, shape (n, 3).
        press: N [N], shape (n,), or None if no force is reported.
        friction: F2 e2 + F3 e3, on the ball, in the world [N], shape (n, 3), or None.
        state: SLIPS, STICKS or AWAY, shape (n,), or None if unknown.
    """

    time: FloatArray
    p_WB: FloatArray
    q_WB: FloatArray | None
    contact: FloatArray
    normal: FloatArray
    press: FloatArray | None
    friction: FloatArray | None
    state: npt.NDArray[np.uint8] | None


def poses(body: RollingBall, sampled: Sampled, times: FloatArray) -> Poses:
    """The ball of a trajectory at the frames that it reaches.

    Args:
        body: the scene's ball.
        sampled: its samples: the variables :data:`NEEDED`, those that it has.
        times: of the frames [s], rising from 0.
    """
    from scipy.interpolate import CubicHermiteSpline

    grid = sampled["time"]
    if grid.size < 2:  # it ended before its first step
        times, p_WB = times[:1], sampled["p_WB"][:1]
    else:
        times = times[times <= grid[-1] * (1 + 1e-12)]
        p_WB = np.asarray(CubicHermiteSpline(grid, sampled["p_WB"], sampled["v_WB"])(times))
    normal = body.surface.normal(p_WB)
    friction = press = None
    if "N" in sampled:
        press, F2, F3 = (np.interp(times, grid, sampled[name]) for name in ("N", "F2", "F3"))
        frame = body.surface.frame(body.surface.locate(p_WB))
        friction = F2[:, None] * frame[..., 1] + F3[:, None] * frame[..., 2]
    return Poses(
        time=times,
        p_WB=p_WB,
        q_WB=_orientation(body.surface, sampled, times),
        contact=p_WB + (body.ball.radius + body.surface.gap(p_WB))[:, None] * normal,
        normal=normal,
        press=press,
        friction=friction,
        state=_state(sampled, times, flies=body.gap0 > 0),
    )


def _state(sampled: Sampled, times: FloatArray, flies: bool) -> npt.NDArray[np.uint8] | None:
    """State of the contact at each frame, from the events, which are finer in time than the samples.

    Without a bound on its friction a ball that touches the wall sticks; ``flies``: it does not touch it at first.
    """
    if "sticking" not in sampled and not flies and not len(sampled.get("event_kind", ())):
        return None
    first = AWAY if flies else int(sampled["sticking"][0]) if "sticking" in sampled else STICKS
    state = np.full(times.shape, first, dtype=np.uint8)
    for kind, time in zip(sampled.get("event_kind", ()), sampled.get("event_time", ()), strict=True):
        state[times >= time] = _AFTER[kind.decode() if isinstance(kind, bytes) else str(kind)]  # never, if it is NaN
    return state


def _orientation(surface: Surface, sampled: Sampled, times: FloatArray) -> FloatArray | None:
    from scipy.spatial.transform import Rotation, Slerp

    if "q_WB" not in sampled:
        return None
    grid, stored = sampled["time"], sampled["q_WB"]
    if times.size < 2:
        return np.asarray(stored[:1])
    # Its own orientation at every sample, carried by its own spin in between. Two orientations with one spin differ by
    # a rotation that stands still in the ball; how it changes is what the spin does not explain, spread evenly.
    everywhere = np.union1d(grid, times)
    carried = _turned(surface, sampled, everywhere)
    apart = carried[np.searchsorted(everywhere, grid)].inv() * Rotation.from_quat(stored, scalar_first=True)
    between = Slerp(grid, apart)(np.clip(times, grid[0], grid[-1]))
    return np.asarray((carried[np.searchsorted(everywhere, times)] * between).as_quat(scalar_first=True))


def _turned(surface: Surface, sampled: Sampled, times: FloatArray) -> Rotation:
    """Orientations at rising times from 0 [s] by quadrature of the spin, identity at the first.

    The components of the spin in the local frame change slowly, those in the world as fast as the ball goes round:
    the former are interpolated. Each step is the fourth-order Magnus step with two Gauss points (Iserles and Norsett
    1999, Phil. Trans. R. Soc. A 357, 983-1019, equation 4.5 with the commutator as a cross product).
    """
    from scipy.interpolate import Akima1DInterpolator, CubicHermiteSpline
    from scipy.spatial.transform import Rotation

    grid = sampled["time"]
    spin = Akima1DInterpolator(grid, np.stack([sampled[f"omega{i}"] for i in (1, 2, 3)], axis=1))
    centre = CubicHermiteSpline(grid, sampled["p_WB"], sampled["v_WB"])

    def world(t: FloatArray) -> FloatArray:
        frame = surface.frame(surface.locate(centre(t)))
        return np.asarray(np.einsum("tij,tj->ti", frame, spin(np.minimum(t, grid[-1]))))

    fine = np.interp(np.arange((times.size - 1) * _SUBSTEPS + 1) / _SUBSTEPS, np.arange(times.size), times)
    h = np.diff(fine)[:, None]
    middle = fine[:-1, None] + h / 2
    early, late = (world((middle + sign * np.sqrt(3) / 6 * h)[:, 0]) for sign in (-1, 1))
    steps = Rotation.from_rotvec(h / 2 * (early + late) + np.sqrt(3) / 12 * h**2 * np.cross(late, early))
    turned = Rotation.concatenate([Rotation.identity(), steps])
    reach = 1  # each has been turned by so many steps before it, in the end by all
    while reach < len(turned):
        turned = Rotation.concatenate([turned[:reach], turned[reach:] * turned[:-reach]])
        reach *= 2
    return turned[::_SUBSTEPS]
