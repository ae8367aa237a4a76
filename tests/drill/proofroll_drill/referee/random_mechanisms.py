"""Random mechanisms: trees and loops of every kind of joint, all frames turned; planar ones lie in any plane."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.elements.mechanism import Body, Joint, Loop, Mechanism, Point, Spring, Tree
from proofroll.elements.mechanism.scene.joint_kinds import FACTS, LAWS, WITH_AXIS, JointKind

KINDS: tuple[JointKind, ...] = (
    JointKind.FIXED,
    JointKind.REVOLUTE,
    JointKind.PRISMATIC,
    JointKind.UNIVERSAL,
    JointKind.SPHERICAL,
    JointKind.PLANAR,
    JointKind.FREE,
    JointKind.CYLINDRICAL,
)
STYLES = ("tree", "loop", "planar tree", "planar loop")
_CLEAR = 0.05  # least relative singular value of a loop's rows: what is nearer to a singular pose may well be refused


def random_mechanism(seed: int) -> tuple[str, Mechanism]:
    """A style and a mechanism of it, the same for the same number."""
    rng = np.random.default_rng(seed)
    style = STYLES[seed % len(STYLES)]
    while True:
        tree = _tree(rng, planar=JointKind.PLANAR in style, loop="loop" in style)
        if "loop" not in style:
            return style, tree
        closed = _closed(rng, tree, planar=JointKind.PLANAR in style)
        if closed is not None:
            return style, closed


def _tree(rng: Any, *, planar: bool, loop: bool) -> Mechanism:
    count = int(rng.integers(3, 5)) if loop else int(rng.integers(1, 5))
    normal = _unit(rng)
    names = ["world"]
    turned = {"world": Rotation.identity()}  # at zero coordinates
    joints, bodies = [], []
    for number in range(count):
        name = f"b{number}"
        parent = names[-1] if loop or rng.random() < 0.7 else str(rng.choice(names))
        kinds: tuple[JointKind, ...] = (
            (JointKind.REVOLUTE, JointKind.PRISMATIC, JointKind.PLANAR, JointKind.FIXED) if planar else KINDS
        )
        kind = kinds[rng.choice(len(kinds), p=(0.6, 0.2, 0.1, 0.1) if planar else None)]
        if number == 0 and kind == JointKind.FIXED:
            kind = JointKind.REVOLUTE
        orientation = rng.uniform(-1.2, 1.2, 3)
        turned[name] = turned[parent] * Rotation.from_euler("xyz", orientation)
        axis, second = _unit(rng), None
        if planar:
            along = normal if kind != JointKind.PRISMATIC else np.cross(normal, _unit(rng))
            axis = turned[name].inv().apply(along / np.linalg.norm(along))
        if kind in {JointKind.UNIVERSAL, JointKind.PLANAR}:
            second = np.cross(axis, _unit(rng))
        q0, v0 = rng.uniform(-1, 1, FACTS[kind].nq), rng.uniform(-2, 2, FACTS[kind].nv)
        options: dict[str, Any] = {}
        if kind in WITH_AXIS:
            options = {"axis": tuple(axis), "second_axis": None if second is None else tuple(second)}
        values = {"stiffness": 8.0, "rest": 0.5, "damping": 0.4, "torque": 0.7, "armature": 0.1}
        for law, size in values.items():
            if kind in LAWS[law] and rng.random() < 0.3:
                options[law] = float(rng.uniform(0.1, 1) * size)
        place, there = (tuple(rng.uniform(-0.4, 0.4, 3)) for _ in range(2))
        joints.append(Joint(f"j{number}", kind, parent, name, place, tuple(orientation), child_position=there,
                            q0=tuple(q0), v0=tuple(v0), **options))  # fmt: skip
        bodies.append(_body(rng, name))
        names.append(name)
    if all(joint.nv == 0 for joint in joints):
        joints[0] = replace(joints[0], kind=JointKind.REVOLUTE)
    springs = [
        Spring("s", names[-1], "world", tuple(rng.uniform(-0.3, 0.3, 3)), tuple(rng.uniform(2, 3, 3)),
               float(rng.uniform(1, 30)), float(rng.uniform(0, 1)), float(rng.uniform(0.1, 2)))
        for _ in range(int(rng.random() < 0.4))
    ]  # fmt: skip
    points = (Point("tip", names[-1], tuple(rng.uniform(-0.5, 0.5, 3))),)
    gravity = tuple(rng.uniform(-10, 10, 3))
    return Mechanism(tuple(bodies), tuple(joints), (), tuple(springs), points, gravity)


def _body(rng: Any, name: str) -> Body:
    """A body of six points, so that its moments are those of something."""
    masses, places = rng.uniform(0.05, 0.6, 6), rng.uniform(-0.4, 0.4, (6, 3))
    com = masses @ places / masses.sum()
    arms = places - com
    inertia = sum(m * (arm @ arm * np.eye(3) - np.outer(arm, arm)) for m, arm in zip(masses, arms, strict=True))
    return Body(name, float(masses.sum()), tuple(com), inertia)


def _closed(rng: Any, tree: Mechanism, *, planar: bool) -> Mechanism | None:
    """The tree with a loop that closes where it stands, and velocities that keep it closed; None: it cannot move."""
    motion = Tree(tree).at(*tree.start())
    a, b = tree.bodies[-1].name, "world"
    kinds: tuple[JointKind, ...] = (
        (JointKind.REVOLUTE,)
        if planar
        else tuple(kind for kind in KINDS if kind not in {JointKind.FREE, JointKind.FIXED})
    )
    kind = kinds[rng.integers(len(kinds))]
    R_a, p_a = motion.R_WB[tree.body_index[a]], motion.p_WB[tree.body_index[a]]
    place, axis = rng.uniform(-0.4, 0.4, 3), _unit(rng)
    if planar:
        hinge = next((joint for joint in tree.joints if joint.kind in {JointKind.REVOLUTE, JointKind.PLANAR}), None)
        if hinge is None:
            return None
        axis = R_a.T @ motion.R_WB[tree.body_index[hinge.child]] @ np.array(hinge.axis)
    world_axis = R_a @ (np.cross(axis, _unit(rng)) if kind == JointKind.UNIVERSAL else axis)
    orientation = Rotation.from_matrix(R_a.T).as_euler("xyz")
    loop = Loop("loop", kind, a, b, tuple(place), tuple(p_a + R_a @ place), tuple(axis), tuple(world_axis),
                tuple(orientation))  # fmt: skip
    closed = replace(tree, loops=(loop,))
    q, v = closed.start()
    rows = Tree(closed).loop_rows(Tree(closed).at(q, v))
    values = np.linalg.svd(rows.C, compute_uv=False)
    kept = values[values > 1e-9 * values[0]]
    if len(kept) >= closed.nv or kept[-1] < _CLEAR * kept[0]:
        return None
    v -= np.linalg.pinv(rows.C, 1e-9) @ (rows.C @ v)
    joints = [replace(j, v0=tuple(v[at])) for j, at in zip(closed.joints, closed.v_slices, strict=True)]
    return replace(closed, joints=tuple(joints))


def _unit(rng: Any) -> Any:
    found = rng.normal(size=3)
    return found / np.linalg.norm(found)
