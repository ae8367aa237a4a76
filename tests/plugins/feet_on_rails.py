"""A cart on a rail whose foot rubs on a floor: laws of a joint beside a contact, with motions in closed form."""

from __future__ import annotations

from typing import Any

from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair


def foot_on_rail(*, sole: float = 0.2, pull: float = 0.0, **rail: Any) -> Mechanism:
    """A cart of 0.5 kg on a rail, at 1 m/s, with a foot of 1.5 kg on a floor; ``pull`` along the rail [m/s²]."""
    return Mechanism(
        bodies=tuple(Body(name, mass, inertia=(1.0, 1.0, 1.0)) for name, mass in (("cart", 0.5), ("foot", 1.5))),
        joints=(
            Joint("rail", "prismatic", "world", "cart", axis=(1, 0, 0), v0=(1.0,), **rail),
            Joint("shaft", "prismatic", "cart", "foot", axis=(0, 0, 1), q0=(0.1,)),
        ),
        geometries=(Geometry("ball", "foot", "sphere", radius=0.1), Geometry("floor", "world", "plane")),
        pairs=(Pair("sole", ("ball", "floor"), friction=sole),),
        gravity=(pull, 0.0, -9.81),
    )
