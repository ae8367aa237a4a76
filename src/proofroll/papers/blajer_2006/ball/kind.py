"""Tables of a ball on a surface in a scene file, and the scenes on which engines are checked."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

from proofroll.core.element import Element
from proofroll.core.gravity import Gravity
from proofroll.core.parameters import Parameters
from proofroll.core.scene import Scene
from proofroll.elements.balls.reader import UNITS, PlacedBall, ball_as_body, placed_balls
from proofroll.elements.balls.surfaces import Cylinder
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.balls import Ball, Contact, InitialMotion
from proofroll.papers.blajer_2006.ball.as_body import in_upright_bore
from proofroll.papers.blajer_2006.ball.element import EvenRolling


class BallOnSurfaceKind:
    """See :class:`proofroll.core.element.ElementKind`."""

    name: ClassVar[str] = "ball_on_surface"
    tables: ClassVar[tuple[str, ...]] = ("balls", "surfaces", "contacts", "initial")
    units: ClassVar[Mapping[str, str]] = UNITS

    @staticmethod
    def read(tables: Mapping[str, Any], gravity: Gravity, numbers: Parameters, where: str) -> Sequence[Element]:
        """See :func:`ball_element`: a mechanism for each contact."""
        return [ball_element(placed, gravity, where) for placed in placed_balls(tables, numbers, where)]

    @staticmethod
    def conformance_scenes() -> Mapping[str, Scene]:
        """None: a ball is a mechanism, and :class:`.MechanismKind` has them."""
        return {}

    @staticmethod
    def truth_scenes() -> Mapping[str, Scene]:
        """Scenes turned about the axis, spinning; slow, fast."""
        slow = InitialMotion("ball", (-1.0, 0.1), (1.2, 0.2), spin=5.0)
        fast = InitialMotion("ball", (2.0, 0.1), (4.5, -0.7), spin=12.0)
        return {"slow": _rolling(slow, 5e-4), "fast": _rolling(fast, 0.0)}


def ball_element(placed: PlacedBall, gravity: Gravity, file: str) -> MechanismElement:
    """Mechanism of a ball on its wall, see :func:`proofroll.elements.balls.reader.ball_as_body`.

    Raises:
        InputError: no body has such a wall or law of contact, or the ball cannot start so.
    """
    element = ball_as_body(placed, gravity, file)
    body = element.on_wall
    if body is None or len(element.bodies) > 1 or not in_upright_bore(body) or not math.isinf(body.contact.mu_static):
        return element
    return EvenRolling(element.mechanism, local=element.local)


def _rolling(start: InitialMotion, rolling_resistance: float) -> Scene:
    """Scene of a ball that rolls in an upright cylinder [SI]."""
    placed = PlacedBall(
        Ball("ball", radius=0.025, mass=0.517),
        Cylinder("wall", radius=0.225),
        Contact("ball", "wall", rolling_resistance=rolling_resistance),
        start,
    )
    return Scene("rolling_ball", "", (ball_element(placed, Gravity(9.81), "scene"),))
