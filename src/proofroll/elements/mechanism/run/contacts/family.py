"""Families of contact: the contact laws of engines, and the text for one with its numbers."""

from enum import StrEnum

from proofroll.elements.mechanism.run.capabilities import MechanismCapability


class Family(StrEnum):
    """Contact law of a model; shorter steps do not change it."""

    HARD = "hard contact by Coulomb's law"
    CONVEX = "contact by a convex cone, where sliding contacts open"
    PYRAMID = "contact by a pyramid of friction"
    ANISOTROPIC = "contact by an anisotropic cone of friction"
    SOFTENED = "softened contact"


def of_contact(
    family: Family, *, stiffness: float | None = None, zone: float | None = None, time: float | None = None
) -> dict[str, str]:
    """Text of a contact law with its softening, keyed by the capabilities that it describes.

    Args:
        family: the law.
        stiffness: [N/m].
        zone: slip speed below which friction is reduced [m/s].
        time: time constant [s].
    """
    parts = (("k", stiffness, "N/m"), ("v_reg", zone, "m/s"), ("time constant", time, "s"))
    numbers = [f"{name} = {value:g} {unit}" for name, value, unit in parts if value is not None]
    text = f"{family.value}, {', '.join(numbers)}" if numbers else family.value
    return {MechanismCapability.CONTACT: text}
