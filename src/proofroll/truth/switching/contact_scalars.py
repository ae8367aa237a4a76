"""Contacts of bodies whose motions are symbols, from which right-hand sides are compiled."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from proofroll.elements.mechanism.contact.touching import Moving, touch
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.shapes.features import Border
from proofroll.elements.mechanism.scene.shapes.geometry import BodyContact
from proofroll.elements.mechanism.scene.shapes.shapes import CircleShape, EllipsoidShape, HalfSpace, SphereShape
from proofroll.elements.mechanism.scene.shapes.walls import CurvedWall
from proofroll.truth.numerics.scalars import Scalar, dot, minus, scaled

Vector = Sequence[Scalar]


class ScalarTouch(NamedTuple):
    """A contact at one instant, with plain zeros and ones; see :class:`.Touching`."""

    gap: Scalar
    normal: Vector
    normal_rate: Vector
    place: Vector
    place_rate: Vector
    slide: Vector
    tilt: Scalar = 1.0
    borders: Sequence[Border] = ()

    def across(self, vector: Vector) -> list[Scalar]:
        """Part of a vector along the surfaces."""
        return minus(vector, scaled(dot(self.normal, vector), self.normal))


def scalar_motion(p: Vector, R: Sequence[Vector], v: Vector, w: Vector) -> Moving:
    """Motion of a body: place of its frame, rotation by rows, velocity of the origin, angular velocity; world axes."""
    return Moving(*(np.array(part, dtype=object) for part in (p, R, v, w)))


def touch_in_scalars(contact: BodyContact, a: Moving, b: Moving, feature: int) -> ScalarTouch:
    """Contact at given motions of its bodies; ``feature``: of solids."""
    touching = touch(contact, a, b, feature)
    return ScalarTouch(
        gap=touching.gap,
        normal=touching.normal.tolist(),
        normal_rate=touching.normal_rate.tolist(),
        place=touching.place.tolist(),
        place_rate=touching.place_rate.tolist(),
        slide=touching.slide.tolist(),
        tilt=touching.tilt,
        borders=touching.borders,
    )


def floats(vector: Array) -> list[float]:
    """Components as plain floats, so that zeros and ones fold."""
    return [float(x) for x in vector]


def known_shapes(contact: BodyContact) -> bool:
    """True if both shapes have a rule for symbols."""
    rules = SphereShape | EllipsoidShape | CircleShape | HalfSpace | CurvedWall
    shapes = contact.shape_a, contact.shape_b
    simple = all(isinstance(shape, rules) and getattr(shape, "has_formula", True) for shape in shapes)
    return simple or contact.features is not None
