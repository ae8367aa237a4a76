"""Families of contact: the laws that engines solve where bodies touch, and the words for one with its numbers."""

from enum import StrEnum

from proofroll.elements.ball_on_surface.model import BallCapability
from proofroll.elements.mechanism.capabilities import MechanismCapability


class Family(StrEnum):
    """Law of contact that a model has, which steps that get shorter do not change."""

    HARD = "hard contact by Coulomb's law"
    CONVEX = "contact by a convex cone, where sliding contacts open"
    PYRAMID = "contact by a pyramid of friction"
    ANISOTROPIC = "contact by an anisotropic cone of friction"
    SOFTENED = "softened contact"


def of_contact(
    family: Family, *, stiffness: float | None = None, zone: float | None = None, time: float | None = None
) -> dict[str, str]:
    """A family with what softens it, by the capabilities that it is of.

    Args:
        family: whose.
        stiffness: [N/m].
        zone: speed of slip below which friction is less [m/s].
        time: time constant [s].
    """
    parts = (("k", stiffness, "N/m"), ("v_reg", zone, "m/s"), ("time constant", time, "s"))
    said = [f"{name} = {value:g} {unit}" for name, value, unit in parts if value is not None]
    text = f"{family.value}, {', '.join(said)}" if said else family.value
    return dict.fromkeys((MechanismCapability.CONTACT, BallCapability.BOUNDED_FRICTION), text)
