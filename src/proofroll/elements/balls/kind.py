"""Tables of a ball on a surface in a scene file, and the scenes on which engines are checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Union

from pydantic import Field

from proofroll.core.element import Element
from proofroll.core.errors import InputError
from proofroll.core.gravity import Gravity
from proofroll.core.parameters import Parameters
from proofroll.core.scene import Scene
from proofroll.core.validation import strict, units_of, validated
from proofroll.elements.balls.surfaces import Cylinder, surface_kinds
from proofroll.elements.mechanism.run.balls import BallTables, PlacedBall, ball_as_body, placed_balls
from proofroll.elements.mechanism.scene.balls import Ball, Contact, InitialMotion
from proofroll.elements.mechanism.scene.shapes.walls import Declared

if TYPE_CHECKING:
    AnySurface = Any
else:
    AnySurface = Union[surface_kinds()]  # noqa: UP007 -- of a tuple


@dataclass(frozen=True)
class _Tables(BallTables):
    """Tables of a scene file that describe balls on surfaces."""

    surfaces: tuple[Annotated[AnySurface, Field(discriminator="kind")], ...] = field(default=())


strict(_Tables, Ball, Contact, InitialMotion, *surface_kinds())


class BallOnSurfaceKind:
    """See :class:`proofroll.core.element.ElementKind`."""

    name: ClassVar[str] = "ball_on_surface"
    tables: ClassVar[tuple[str, ...]] = ("balls", "surfaces", "contacts", "initial")
    units: ClassVar[Mapping[str, str]] = units_of(Ball, Contact, InitialMotion, *surface_kinds())

    @staticmethod
    def read(tables: Mapping[str, Any], gravity: Gravity, numbers: Parameters, where: str) -> Sequence[Element]:
        """See :func:`proofroll.elements.mechanism.run.balls.ball_as_body`: a mechanism for each contact."""
        return [ball_as_body(placed, gravity, where) for placed in _placed(tables, numbers, where)]

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


def _rolling(start: InitialMotion, rolling_resistance: float) -> Scene:
    """Scene of a ball that rolls in an upright cylinder [SI]."""
    placed = PlacedBall(
        Ball("ball", radius=0.025, mass=0.517),
        Cylinder("wall", radius=0.225),
        Contact("ball", "wall", rolling_resistance=rolling_resistance),
        start,
    )
    return Scene("rolling_ball", "", (ball_as_body(placed, Gravity(9.81), "scene"),))


def _placed(tables: Mapping[str, Any], numbers: Parameters, where: str) -> list[PlacedBall]:
    """Each contact of a file with its ball, surface and start. Raises InputError for a mistake, with its location."""
    units = BallOnSurfaceKind.units
    filled = {key: numbers.filled(table, f"{where}: {key}", units) for key, table in tables.items()}
    contents = validated(_Tables, filled, where)
    placed = list(placed_balls(contents, contents.surfaces, tables.get("initial", []), numbers, where))
    for ball, wall, contact, _, index in placed:
        try:
            if isinstance(wall, Cylinder):
                wall.offset(ball.radius)
        except InputError as error:
            raise error.within(f"{where}: contacts.{index}", contact.body) from None
    for surface in contents.surfaces:
        if isinstance(surface, Declared):
            surface.checked()
    return placed
