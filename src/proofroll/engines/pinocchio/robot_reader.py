"""Pinocchio's own importers of URDF and MJCF, the model read back."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.robots.model import Array
from proofroll.robots.protocol import AtState, Reading, Request, evaluate


class PinocchioRobots:
    """What ``buildModelFromUrdf`` and ``buildModelFromMJCF`` make of a robot file."""

    kinds: ClassVar[tuple[str, ...]] = ("urdf", "mjcf")
    options: ClassVar[Mapping[str, str]] = {"mimic": "reduce following joints (default: they move freely)"}
    tolerances: ClassVar[Mapping[str, float]] = {}
    says: ClassVar[str] = ""

    def version(self) -> str:
        """Version of the package."""
        return importlib.metadata.version("pin")

    def read(self, request: Request) -> Reading:
        """The model, evaluated by crba, nonLinearEffects, rnea and aba."""
        import pinocchio as pin

        model = _build(request)
        if request.kind == "urdf":
            model.gravity.linear = request.gravity
        data = model.createData()
        moving = [index for index in range(1, model.njoints) if model.joints[index].nv]
        joints = tuple(_name(request, model, index) for index in moving)
        dofs = tuple(int(model.joints[index].nv) for index in moving)
        frames: dict[str, list[Any]] = {name: [] for name in joints}

        def at(k: int) -> AtState:
            q, v, T, drift = _state(request, model, joints, dofs, moving, k)
            pin.forwardKinematics(model, data, q)
            pin.updateFramePlacements(model, data)
            for name, index in zip(joints, moving, strict=True):
                frame = _frame(request, model, name, index)
                frames[name].append((data.oMi[index] if frame is None else data.oMf[frame]).copy())
            M = np.triu(pin.crba(model, data, q))
            M = M + np.triu(M, 1).T
            return AtState(
                T, drift, M,
                np.array(pin.computeGeneralizedGravity(model, data, q)),
                np.array(pin.nonLinearEffects(model, data, q, v)),
                lambda a: np.array(pin.rnea(model, data, q, v, a)),
                lambda tau: np.array(pin.aba(model, data, q, v, tau)),
            )  # fmt: skip

        arrays = evaluate(request, joints, dofs, at)
        mass, com, inertia = {}, {}, {}
        for name, index in zip(joints, moving, strict=True):
            frame = _frame(request, model, name, index)
            placed = model.inertias[index]
            if frame is not None:
                placed = model.frames[frame].placement.actInv(placed)
            mass[name], com[name], inertia[name] = float(placed.mass), np.array(placed.lever), np.array(placed.inertia)
        reduced = request.options.get("mimic", False)
        return Reading(
            joints, dofs, mass, com, inertia,
            {name: np.array([X.translation for X in found]) for name, found in frames.items()},
            {name: np.array([X.rotation for X in found]) for name, found in frames.items()},
            remarks=("option mimic=true",) if reduced else (),
            **arrays,
        )  # fmt: skip


def _build(request: Request) -> Any:
    import pinocchio as pin

    mimic = {"mimic": True} if request.options.get("mimic") else {}
    if request.kind == "mjcf":
        return pin.buildModelFromMJCF(str(request.path))
    free = (pin.JointModelFreeFlyer(),) if request.base == "free" else ()
    return pin.buildModelFromUrdf(str(request.path), *free, **mimic)


def _name(request: Request, model: Any, index: int) -> str:
    name = str(model.names[index])
    return request.base_joint if request.kind == "urdf" and name == "root_joint" else name


def _frame(request: Request, model: Any, joint: str, index: int) -> int | None:
    """The frame of the body that a joint carries, where the model has it; its placement is against the joint."""
    import pinocchio as pin

    body = request.children.get(joint)
    if body is None or not model.existFrame(body, pin.FrameType.BODY):
        return None
    frame = int(model.getFrameId(body, pin.FrameType.BODY))
    return frame if model.frames[frame].parentJoint == index else None


def _state(
    request: Request, model: Any, joints: tuple[str, ...], dofs: tuple[int, ...], moving: list[int], k: int
) -> tuple[Array, Array, Array, Array]:
    """Configuration, velocity, and the relation to the common velocity: both parts of a free base have body axes."""
    import pinocchio as pin

    states = request.states
    q, v = pin.neutral(model), np.zeros(model.nv)
    T, drift = np.eye(model.nv), np.zeros(model.nv)
    step = np.zeros(model.nv)
    for name, dof, index in zip(joints, dofs, moving, strict=True):
        iv, iq = model.joints[index].idx_v, model.joints[index].idx_q
        rate = states.velocity.get(name)
        v[iv : iv + dof] = 0.0 if rate is None else rate[k]
        if name in states.angle:
            step[iv] = states.angle[name][k]
        elif name in states.rotation:
            R = states.rotation[name][k]
            if dof == 6:
                q[iq : iq + 3] = states.position[name][k]
                T[iv : iv + 3, iv : iv + 3] = T[iv + 3 : iv + 6, iv + 3 : iv + 6] = R.T
                drift[iv : iv + 3] = -R.T @ np.cross(v[iv + 3 : iv + 6], v[iv : iv + 3])
                iq += 3
            q[iq : iq + 4] = Rotation.from_matrix(R).as_quat()
    return pin.integrate(model, q, step), T @ v, T, drift
