"""Mechanisms that several tests share."""

from proofroll.elements.mechanism import Body, Force, Joint, Loop, Mechanism, Point, Spring
from proofroll.elements.mechanism.scene.bushing import Bushing

SOLID = {"mass": 1.3, "com": (0.1, -0.2, 0.05), "inertia": ((0.5, 0.02, 0.01), (0.02, 0.6, -0.03), (0.01, -0.03, 0.7))}
BUSHING = Bushing(
    "mount",
    "b1",
    "b2",
    position_a=(0.2, 0.1, 0),
    position_b=(-0.1, 0, 0.2),
    orientation_a=(0.1, 0.2, 0.3),
    orientation_b=(-0.3, 0.1, 0.5),
    stiffness=(20, 30, 50, 2, 3, 5),
    damping=(1, 2, 3, 0.1, 0.2, 0.3),
)


def every_kind() -> Mechanism:
    """A tree with a joint of each kind, a branch, loops of each kind (not closed), a spring, bushing, point, forces."""
    joints = [
        Joint("j0", "free", "world", "b0", q0=(0.1, 0.2, 0.3, 0.9, 0.1, 0.3, -0.2), v0=(1, 2, 3, 0.3, -0.4, 0.5)),
        Joint("j1", "revolute", "b0", "b1", (1, 0, 0.2), (0.1, 0.2, 0.3), (1, 2, 3), None, (0.1, 0, 0), (0.4,), (1.1,)),
        Joint("j2", "prismatic", "b1", "b2", (0, 1, 0), (0.3, 0, 0.3), (1, 0, 3), None, (0, 0.2, 0), (0.5,), (-0.7,)),
        Joint(
            "j3", "universal", "b2", "b3", (0, 0, 1), (0, 0.4, 0), (1, 1, 0), (0, 0, 1), (0, 0, 0.3), (0.3, 0.6), (1, 2)
        ),
        Joint("j4", "spherical", "b3", "b4", (1, 1, 0), q0=(0.8, 0.2, 0.1, 0.5), v0=(0.5, -1, 0.6)),
        Joint("j5", "planar", "b1", "b5", (0, 0.5, 0.5), axis=(0, 1, 1), q0=(0.2, 0.3, 0.4), v0=(1, -1, 2)),
        Joint("j6", "fixed", "b5", "b6", (0.3, 0, 0), (0.2, 0.1, 0)),
        Joint("j7", "cylindrical", "b3", "b7", (0, 0.4, 0), axis=(1, 0, 2), q0=(0.2, 0.7), v0=(1.0, -1.5)),
    ]
    kinds = ("revolute", "prismatic", "cylindrical", "universal", "spherical", "planar", "fixed")
    loops = [
        Loop(f"l{kind}", kind, "b4", "b6", (0.1, 0.2, 0.3), (0.3, -0.2, 0.1), (1, 0, 1), (0, 1, 1), (0.1, 0.2, 0.3))
        for kind in kinds
    ]
    return Mechanism(
        bodies=tuple(Body(f"b{i}", **SOLID) for i in range(8)),
        joints=tuple(joints),
        loops=tuple(loops),
        springs=(Spring("s", "b4", "world", (0.1, 0, 0), (0, 0, 1), stiffness=20.0, damping=0.5, length=0.3),),
        points=(Point("tip", "b4", (0.2, 0.3, 0.4)),),
        forces=(
            Force("push", "b4", "force", (1.0, -2.0, 0.5), (0.1, 0.2, -0.1), "body"),
            Force("twist", "b2", "moment", (0.2, 0.1, -0.3), reaction="b6"),
        ),
        bushings=(BUSHING,),
    )
