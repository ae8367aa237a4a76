"""One mechanism in two forms: a body held by a loop, and the same body on a joint."""

from dataclasses import replace

from proofroll.elements.mechanism import Body, Joint, Loop, Mechanism, Tree

ARM = Body("arm", 2.0, (0.2, 0, 0.1), ((0.1, 0, 0), (0, 0.2, 0), (0, 0, 0.25)))
BODY = Body("body", 1.3, (0.1, -0.2, 0.05), ((0.5, 0.02, 0.01), (0.02, 0.6, -0.03), (0.01, -0.03, 0.7)))
PLACE = (0.3, 0.1, -0.2)
SPEEDS = {
    "fixed": (),
    "revolute": (2.0,),
    "prismatic": (1.5,),
    "cylindrical": (1.5, 2.0),
    "universal": (1.0, 2.0),
    "spherical": (1.0, 2.0, 3.0),
    "planar": (1.0, 0.5, 3.0),
}
LOOPS = tuple(SPEEDS)


def held(kind):
    """Two equal mechanisms: a body on a turning arm, held by a loop of this kind, and by a joint of this kind."""
    swing = Joint("swing", "revolute", "world", "arm", axis=(0, 1, 0), v0=(1.5,))
    second = (1, 0, 0) if kind == "universal" else None
    joint = Joint("held", kind, "arm", "body", PLACE, second_axis=second, v0=SPEEDS[kind])
    on_joint = Mechanism((ARM, BODY), (swing, joint))
    motion = Tree(on_joint).at(*on_joint.start())
    start = {"q0": (*motion.p_WB[1], 1, 0, 0, 0), "v0": (*motion.v_WB[1], *motion.w_WB[1])}
    free = Joint("free", "free", "world", "body", **start)
    axes = {"axis_a": (0, 0, 1), "axis_b": (1, 0, 0)} if kind == "universal" else {}
    loop = Loop("held", kind, "arm", "body", position_a=PLACE, **axes)
    return replace(on_joint, joints=(swing, free), loops=(loop,)), on_joint
