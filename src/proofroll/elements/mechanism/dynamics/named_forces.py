"""Named forces along coordinates: of actuators, couplings, prescribed motions, dry friction and stops."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from proofroll.core.parameters import Unit
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.rotations import Array


class NamedForce(NamedTuple):
    """A force along a coordinate.

    Attributes:
        name: as files and commands write it, e.g. ``effort.motor``.
        field: field of a sample that holds it: ``effort``, ``coupling``, ``drive``, ``friction`` or ``stop``.
        number: index in that field.
        unit: N m about an axis, N along one.
        meaning: one line for a person.
    """

    name: str
    field: str
    number: int
    unit: Unit
    meaning: str


# Fields of a sample that hold named forces, in the order of :func:`named_forces`.
FIELDS = ("effort", "coupling", "drive", "friction", "stop")


def named_forces(mechanism: Mechanism) -> tuple[NamedForce, ...]:
    """Named forces of a mechanism; arrays over them have this order."""
    unit = {joint.name: "N" if joint.kind == JointKind.PRISMATIC else "N m" for joint in mechanism.joints}
    forces = [
        NamedForce(
            name=f"effort.{item.name}",
            field="effort",
            number=k,
            unit=unit[item.joint],
            meaning=f"effort of {item.name} at {item.joint}",
        )
        for k, item in enumerate(mechanism.actuators)
    ]
    forces += [
        NamedForce(
            name=f"coupling.{item.name}",
            field="coupling",
            number=k,
            unit=unit[item.terms[0][0]],
            meaning=f"force of {item.name} on {item.terms[0][0]}",
        )
        for k, item in enumerate(mechanism.couplings)
    ]
    rubbing = [joint.name for joint in mechanism.joints if joint.friction and joint.nq == 1]
    stopped = [joint.name for joint in mechanism.joints if joint.limits is not None]
    driven = [joint.name for joint, _, _ in mechanism.prescribed]
    kinds = (
        ("drive", "force that imposes the motion", driven),
        ("friction", "dry friction", rubbing),
        ("stop", "force of a stop", stopped),
    )
    for key, what, names in kinds:
        forces += [
            NamedForce(
                name=f"{key}.{name}",
                field=key,
                number=mechanism.joint_index[name],
                unit=unit[name],
                meaning=f"{what} along {name}",
            )
            for name in names
        ]
    return tuple(forces)


def lengths(mechanism: Mechanism) -> Mapping[str, int]:
    """Length of each field of a sample in :data:`FIELDS`."""
    counts = (len(mechanism.actuators), len(mechanism.couplings), *(len(mechanism.joints),) * 3)
    return dict(zip(FIELDS, counts, strict=True))


def pick_named(mechanism: Mechanism, fields: Mapping[str, Array]) -> Array:
    """Named forces [N, N m] picked from fields, (…, indices), in the order of :func:`named_forces`, (forces, …)."""
    return np.array([fields[item.field][..., item.number] for item in named_forces(mechanism)], dtype=float)


def joint_force_shares(at_stop: bool, friction: float, force: float) -> tuple[float, float]:
    """Shares (dry friction, stop) of the force that holds or rubs on a joint [N, N m].

    Both are NaN where a stop and friction hold together, for then neither is determinate.

    Args:
        at_stop: True if the force may be that of a stop.
        friction: largest dry friction of the joint [N, N m]; 0: none.
        force: along the coordinate [N, N m].
    """
    if not at_stop:
        return force, 0.0
    return (np.nan, np.nan) if friction else (0.0, force)
