"""Tables of a ball on a surface in a scene file, and the scenes on which engines are checked."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Union, cast

from pydantic import Field

from proofroll.core.errors import InputError
from proofroll.core.gravity import Gravity
from proofroll.core.parameters import Parameters
from proofroll.core.scene import Scene
from proofroll.core.validation import strict, units_of, validated
from proofroll.elements.ball_on_surface.element import BallOnSurface, scene_with
from proofroll.elements.ball_on_surface.surfaces import Declared, Surface, surface_kinds
from proofroll.elements.mechanism.run.balls import BallTables, PlacedBall, ball_as_body, placed_balls
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.balls import Ball, Contact, InitialMotion

if TYPE_CHECKING:
    from proofroll.core.diagnosis import Hypothesis

    AnySurface = Surface
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
    def read(
        tables: Mapping[str, Any], gravity: Gravity, numbers: Parameters, where: str
    ) -> Sequence[BallOnSurface | MechanismElement]:
        """Elements of a file: one for each contact, with the ball, the surface and the start that it names."""
        elements: list[BallOnSurface | MechanismElement] = []
        for placed in _placed(tables, numbers, where):
            ball, surface, contact, start, _ = placed
            if _is_followed_as_a_body(placed):
                elements.append(ball_as_body(placed, gravity, where))
                continue
            try:
                elements.append(
                    BallOnSurface(ball=ball, surface=surface, contact=contact, start=start, gravity=gravity)
                )
            except InputError as error:
                raise error.within(f"{where}: initial", ball.name) from None
        return elements

    @staticmethod
    def conformance_scenes() -> Mapping[str, Scene]:
        """Scenes without zero or symmetric values: smooth motions first, the most demanding first among them."""
        from proofroll.files.scene_file import load_scene

        cylinder = {"speed": 3.3, "axial_speed": 0.7, "radial_spin": 12.0}
        plane = {"tilt": 0.35, "speed": 0.8, "cross_speed": 0.5, "normal_spin": 12.0}
        return {
            "cylinder-resisting": load_scene("sphere_in_cylinder", **cylinder, rolling_resistance=5e-4),
            "cylinder": load_scene("sphere_in_cylinder", **cylinder),
            "plane-resisting": load_scene("inclined_plane", **plane, rolling_resistance=5e-4),
            "plane": load_scene("inclined_plane", **plane),
            "cylinder-slipping": load_scene("sphere_in_cylinder", **cylinder, mu_static=0.35),
            "cylinder-oriented": load_scene("sphere_in_cylinder", **cylinder, asks=("orientation",)),
        }

    @staticmethod
    def truth_scenes() -> Mapping[str, Scene]:
        """Scenes turned about the axis, tilted, spinning; slow, fast; through a bowl's bottom; on a moving wall."""
        from proofroll.files.scene_file import load_scene

        scenes = BallOnSurfaceKind.conformance_scenes()
        return {
            "plane": scenes["plane"],
            "slow": _with_tilt(scenes["cylinder-resisting"], -1.0, 0.05, velocity=(1.2, 0.2), spin=5.0),
            "fast": _with_tilt(scenes["cylinder"], 2.0, -0.2, velocity=(4.5, -0.7)),
            "bottom": load_scene("bowl", start=-0.02, speed=0.6, cross_speed=0.02, normal_spin=12.0),
            "turntable": load_scene("turntable", tilt=0.2, normal_spin=12.0),
        }

    @staticmethod
    def hypotheses() -> Sequence[Hypothesis]:
        """See :class:`proofroll.core.diagnosis.ExplainsRuns`."""
        from proofroll.elements.ball_on_surface.diagnosis import HYPOTHESES

        return HYPOTHESES


def _with_tilt(scene: Scene, gamma: float, tilt: float, **motion: Any) -> Scene:
    """Copy of a scene that starts at the angle ``gamma``, with its cylinder's axis tilted by ``tilt``, both in rad."""
    (element,) = scene.elements
    assert isinstance(element, BallOnSurface)
    start = dataclasses.replace(element.start, coordinates=(gamma, 0.1), **motion)
    return scene_with(scene, start=start, surface=dataclasses.replace(cast(Any, element.surface), tilt=tilt))


class BallsAsBodies(BallOnSurfaceKind):
    """The same tables read as mechanisms, one for each ball: the kind to announce once engines have all walls."""

    @staticmethod
    def read(  # other elements, by the same protocol
        tables: Mapping[str, Any], gravity: Gravity, numbers: Parameters, where: str
    ) -> Sequence[MechanismElement]:
        """See :func:`proofroll.elements.mechanism.run.balls.ball_as_body`."""
        return [ball_as_body(placed, gravity, where) for placed in _placed(tables, numbers, where)]


def _is_followed_as_a_body(placed: PlacedBall) -> bool:
    """True if the general mechanics follows a ball.

    It flies, bounces or slips at its start, or its wall turns or is neither a plane nor a cylinder.
    """
    surface, start = placed.surface, placed.start
    of_revolution = surface.kind in ("bowl", "cone", "torus")
    begins_otherwise = bool(start.gap) or placed.contact.restitution is not None or start.tangential_spin is not None
    return of_revolution or begins_otherwise or bool(getattr(surface, "turning", 0.0))


def _placed(tables: Mapping[str, Any], numbers: Parameters, where: str) -> list[PlacedBall]:
    """Each contact of a file with its ball, surface and start. Raises InputError for a mistake, with its location."""
    units = BallOnSurfaceKind.units
    filled = {key: numbers.filled(table, f"{where}: {key}", units) for key, table in tables.items()}
    contents = validated(_Tables, filled, where)
    placed = list(placed_balls(contents, contents.surfaces, tables.get("initial", []), numbers, where))
    for ball, wall, contact, _, index in placed:
        try:
            wall.offset(ball.radius)
        except InputError as error:
            raise error.within(f"{where}: contacts.{index}", contact.body) from None
    for surface in contents.surfaces:
        if isinstance(surface, Declared):
            surface.checked()
    return placed
