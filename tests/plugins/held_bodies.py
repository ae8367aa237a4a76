"""A body that a loop holds, and the same body on a joint: two ways to say one mechanism."""

from dataclasses import replace

from proofroll.mechanisms import Body, Joint, Loop, Mechanism

INERTIA = ((0.5, 0.02, 0.01), (0.02, 0.6, -0.03), (0.01, -0.03, 0.7))
BODY = Body("body", 1.3, (0.1, -0.2, 0.05), INERTIA)
LOOPS = ("fixed", "revolute", "prismatic", "universal", "spherical", "planar")
AXES = {"universal": {"axis_a": (0, 0, 1), "axis_b": (1, 0, 0)}}
SPEED = {
    "revolute": (2.0,),
    "prismatic": (1.5,),
    "universal": (1.0, 2.0),
    "spherical": (1, 2, 3),
    "planar": (1, 0.5, 3),
}


def held(kind, on_arm=False):
    """(a free body that a loop of this kind holds, the body on a joint of this kind), both moving alike.

    With ``on_arm`` the loop's other end is an arm that turns, so that all axes of the loop move.
    """
    arm = Body("arm", 2.0, (0.2, 0, 0.1), ((0.1, 0, 0), (0, 0.2, 0), (0, 0, 0.25)))
    bodies = (arm, BODY) if on_arm else (BODY,)
    swing = Joint("swing", "revolute", "world", "arm", axis=(0, 1, 0), v0=(1.5,))
    first, parent = ((swing,), "arm") if on_arm else ((), "world")
    place = (0.3, 0.1, -0.2)
    joint = Joint(
        "held",
        kind,
        parent,
        "body",
        place,
        second_axis=(1, 0, 0) if kind == "universal" else None,
        v0=SPEED.get(kind, ()),
    )
    tree = Mechanism(bodies, (*first, joint))
    from proofroll.mechanisms import Tree

    motion = Tree(tree).at(*tree.start())
    i = tree.body_index["body"]
    free = Joint(
        "free",
        "free",
        "world",
        "body",
        q0=(*motion.p_WB[i], 1, 0, 0, 0),
        v0=(*motion.v_WB[i], *motion.w_WB[i]),
    )
    loop = Loop("held", kind, parent, "body", position_a=place, **AXES.get(kind, {}))
    return replace(tree, joints=(*first, free), loops=(loop,)), tree
