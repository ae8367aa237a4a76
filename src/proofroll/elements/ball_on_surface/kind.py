"""Tables of a ball on a surface in a scene file, and the scenes on which engines are checked."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Union, cast

from pydantic import Field

from proofroll.core.errors import InputError, require_known
from proofroll.core.gravity import Gravity
from proofroll.core.parameters import Parameters
from proofroll.core.scene import Scene
from proofroll.core.validation import strict, units_of, validated
from proofroll.elements.ball_on_surface.element import BallOnSurface, scene_with
from proofroll.elements.ball_on_surface.model import Ball, Contact, InitialMotion
from proofroll.elements.ball_on_surface.surfaces import Declared, Surface, surface_kinds

if TYPE_CHECKING:
    from proofroll.core.diagnosis import Hypothesis

    AnySurface = Surface
else:
    AnySurface = Union[surface_kinds()]  # noqa: UP007 -- of a tuple


@dataclass(frozen=True)
class BallTables:
    """Tables of a scene file that describe balls on surfaces."""

    balls: tuple[Ball, ...]
    contacts: tuple[Contact, ...]
    initial: tuple[InitialMotion, ...]
    surfaces: tuple[Annotated[AnySurface, Field(discriminator="kind")], ...] = field(default=())


strict(BallTables, Ball, Contact, InitialMotion, *surface_kinds())


class BallOnSurfaceKind:
    """See :class:`proofroll.core.element.ElementKind`."""

    name: ClassVar[str] = "ball_on_surface"
    tables: ClassVar[tuple[str, ...]] = ("balls", "surfaces", "contacts", "initial")
    units: ClassVar[Mapping[str, str]] = units_of(Ball, Contact, InitialMotion, *surface_kinds())

    @staticmethod
    def read(tables: Mapping[str, Any], gravity: Gravity, numbers: Parameters, where: str) -> Sequence[BallOnSurface]:
        """Elements of a file: one for each contact, with the ball, the surface and the start that it names."""
        units = BallOnSurfaceKind.units
        filled = {key: numbers.filled(table, f"{where}: {key}", units) for key, table in tables.items()}
        contents = validated(BallTables, filled, where)
        balls = {ball.name: ball for ball in contents.balls}
        surfaces = {surface.name: surface for surface in contents.surfaces}
        _check_names(contents, where)
        for surface in contents.surfaces:
            if isinstance(surface, Declared):
                surface.checked()
        starts = {start.body: (index, start) for index, start in enumerate(contents.initial)}
        elements = []
        for index, contact in enumerate(contents.contacts):
            if contact.body not in starts:
                raise InputError(
                    f"{where}: initial", contact.body, "say how this ball starts; add an [[initial]] of it"
                )
            if any(contact.body == earlier.body for earlier in contents.contacts[:index]):
                raise InputError(f"{where}: contacts.{index}.body", contact.body, "a ball touches one surface")
            ball, surface, (number, start) = balls[contact.body], surfaces[contact.surface], starts[contact.body]
            # Only with the surface are the units of its coordinates known.
            coordinates = tables["initial"][number].get("coordinates", [])
            numbers.filled(coordinates, f"{where}: initial.{number}.coordinates", {}, surface.units)
            try:
                elements.append(
                    BallOnSurface(ball=ball, surface=surface, contact=contact, start=start, gravity=gravity)
                )
            except InputError as error:
                raise error.within(f"{where}: initial", ball.name) from None
        for name in balls.keys() - {contact.body for contact in contents.contacts}:
            raise InputError(
                f"{where}: contacts", name, "this ball touches no surface; add a contact or remove the ball"
            )
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


def _check_names(tables: BallTables, place: str) -> None:
    """Raises InputError unless contacts and starts name balls and surfaces of the file, and all names are unique."""
    balls, surfaces = [ball.name for ball in tables.balls], [surface.name for surface in tables.surfaces]
    for kind, names in (("balls", balls), ("surfaces", surfaces)):
        for index, name in enumerate(names):
            if name in names[:index]:
                raise InputError(f"{place}: {kind}.{index}.name", name, "two have this name; rename one")
    for kind, items in (("contacts", tables.contacts), ("initial", tables.initial)):
        for index, item in enumerate(items):
            for key, known_names in (("body", balls), ("surface", surfaces)):
                named = getattr(item, key, None)
                if named is not None:
                    require_known(f"{place}: {kind}.{index}.{key}", named, known_names)
    for index, contact in enumerate(tables.contacts):
        ball, wall = tables.balls[balls.index(contact.body)], tables.surfaces[surfaces.index(contact.surface)]
        try:
            wall.offset(ball.radius)
        except InputError as error:
            raise error.within(f"{place}: contacts.{index}", contact.body) from None
