"""Bare loops: what a careful user of one engine would write for a scene without proofroll, to measure adapters by.

Where equations or steps are proofroll's own (the projection method, closed loops and impulses on Pinocchio's terms),
the loop has these in place of a user's, and the ratio is what the adapter adds to them.

A bare loop is announced as an entry point of the group ``proofroll.bare_loops``, under the name of its engine. It is a
function of a scene and of the engine's settings that prepares a run, untimed, and gives a :class:`Bare`. It may know
the scene (these here know the vertical cylinder and revolute joints), steps with the same method and step as the
adapter, passes the same times, and at each of them has what ``sample`` would tell at hand. It raises Refused for what
it is not written for.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import EntryPoint
from typing import Any

from proofroll.core.arrays import FloatArray
from proofroll.core.entry_points import announced
from proofroll.core.errors import Refused
from proofroll.core.scene import Scene
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.ball.cylinder import UprightCylinder
from proofroll.papers.blajer_2006.ball.model import RollingBall

GROUP = "proofroll.bare_loops"


@dataclass(frozen=True)
class Bare:
    """A run that is ready to start.

    Attributes:
        run: goes over these times [s], from the first, 0, to the last; gives the ball's centre there
            [m], shape (3,), or the origins of a mechanism's bodies, shape (bodies, 3). Called once, and timed.
        tolerance: largest distance [m] from the adapter's centre that the two loops explain.
        because: why it is not zero.
        lacks: part of the adapter that the engine has not, as ``wall``. The loop then has the engine's own steps alone
            and ends elsewhere: the ratio is no cost of an adapter, and tells that part's share.
    """

    run: Callable[[FloatArray], FloatArray]
    tolerance: float
    because: str
    lacks: str = ""


def load_bare_loop(engine: str) -> Any:
    """The function that prepares bare loops of an engine.

    Raises:
        Refused: no installed package announces one.
    """
    return bare_loop(engine).load()


def bare_loop(engine: str) -> EntryPoint:
    """The entry point of an engine's bare loop, which is not loaded yet; raises as :func:`load_bare_loop`."""
    for point in announced(GROUP):
        if point.name == engine:
            return point
    raise Refused(f"no bare loop is announced for {engine} (entry-point group {GROUP})")


def in_vertical_cylinder(scene: Scene) -> RollingBall:
    """The scene's ball, for a loop that is written for a vertical cylinder and a start at γ = 0, z = 0.

    Raises:
        Refused: the scene is another one.
    """
    body = rolling_ball(scene)
    vertical = isinstance(body.surface, UprightCylinder) and body.surface.tilt == 0 and not body.gravity[:2].any()
    if not vertical or body.u0.any():
        raise Refused("the bare loop is written for a vertical cylinder and a start at its zero of angle and height")
    return body
