"""Reader of robot files by Pinocchio's own importers of URDF and MJCF."""

import importlib.metadata
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
import pinocchio as pin

from proofroll.core.errors import Refused
from proofroll.elements.mechanism.scene.rotations import to_quaternion
from proofroll.robots.model import Array
from proofroll.robots.protocol import AtState, Reading, Request, Whole, evaluate


class PinocchioRobots:
    """Robot files as ``buildModelFromUrdf`` and ``buildModelFromMJCF`` read them."""

    title: ClassVar[str] = "Pinocchio"
    kinds: ClassVar[tuple[str, ...]] = ("urdf", "mjcf")
    options: ClassVar[Mapping[str, str]] = {"mimic": "reduce following joints (default: they move freely)"}
    tolerances: ClassVar[Mapping[str, float]] = {}
    says: ClassVar[str] = ""

    def version(self) -> str:
        """Version of the package."""
        return importlib.metadata.version("pin")

    def as_written(self, request: Request) -> Whole:
        """Degrees of freedom and mass of the model loaded from the file's path."""
        model = _build(request)
        return Whole(int(model.nv), float(sum(body.mass for body in list(model.inertias)[1:])))

    def read(self, request: Request) -> Reading:
        """Model read from the file, evaluated by crba, rnea and aba."""
        model = _build(request)
        if request.kind == "urdf":
            model.gravity.linear = request.gravity
        data = model.createData()
        reduced = request.options.get("mimic", False)
        columns = _columns(request, model)
        joints = tuple(name for name, _, _ in columns)
        dofs = tuple(dof for _, _, dof in columns)
        last = {index: name for name, index, _ in columns}  # of several joints in one body the last carries it
        last = {index: name for index, name in last.items() if index not in _twins(model)}
        frames: dict[str, list[Any]] = {name: [] for name in last.values()}

        def at(k: int) -> AtState:
            q, v, T, drift = _state(request, model, columns, k)
            pin.forwardKinematics(model, data, q)
            pin.updateFramePlacements(model, data)
            for index, name in last.items():
                frame = _frame(request, model, name, index)
                frames[name].append((data.oMi[index] if frame is None else data.oMf[frame]).copy())
            M = np.triu(pin.crba(model, data, q))
            M = M + np.triu(M, 1).T
            still = np.zeros(model.nv)
            g, h = (np.array(pin.rnea(model, data, q, rate, still)) for rate in (still, v))

            def inverse(acceleration: Array) -> Array:
                return np.array(pin.rnea(model, data, q, v, acceleration))

            def forward(torque: Array) -> Array:
                return np.array(pin.aba(model, data, q, v, torque))

            # aba does not support mimic joints
            return AtState(T=T, drift=drift, M=M, g=g, h=h, inverse=inverse, forward=None if reduced else forward)

        arrays = evaluate(request, joints, dofs, at)
        mass, com, inertia = {}, {}, {}
        for index, name in last.items():
            frame = _frame(request, model, name, index)
            placed = model.inertias[index]
            if frame is not None:
                placed = model.frames[frame].placement.actInv(placed)
            mass[name], com[name], inertia[name] = float(placed.mass), np.array(placed.lever), np.array(placed.inertia)
        return Reading(
            joints=joints, dofs=dofs, mass=mass, com=com, inertia=inertia,
            position={name: np.array([X.translation for X in placements]) for name, placements in frames.items()},
            rotation={name: np.array([X.rotation for X in placements]) for name, placements in frames.items()},
            **arrays,
        )  # fmt: skip


def _build(request: Request) -> Any:
    mimic = {"mimic": True} if request.options.get("mimic") else {}
    if request.kind == "mjcf":
        try:
            return pin.buildModelFromMJCF(str(request.path))
        except IndexError as error:  # raised by Pinocchio's C++; unhandled it would look like an error of this reader
            raise Refused(f"IndexError: {error}") from None
    free = (pin.JointModelFreeFlyer(),) if request.base == "free" else ()
    return pin.buildModelFromUrdf(str(request.path), *free, **mimic)


def _columns(request: Request, model: Any) -> list[tuple[str, int, int]]:
    """Joints by the file's names in the order of velocities: name, index in the model, number of velocities.

    Several joints in one body of an MJCF are one composite joint of the model.
    """
    columns: list[tuple[str, int, int]] = []
    twins = _twins(model)
    for index in range(1, model.njoints):
        joint, name = model.joints[index], str(model.names[index])
        if index in twins:
            twin, number = twins[index]
            columns += [
                (f"{part} ({number})", index, dof)
                for part, index_of_column, dof in list(columns)
                if index_of_column == twin
            ]
            continue
        if request.kind == "urdf" and name == "root_joint":
            name = request.base_joint
        if joint.shortname() == "JointModelComposite":
            parts = [part.nv for part in joint.extract().joints]
            moved = {str(frame.name) for frame in model.frames if frame.parentJoint == index}
            names = [key for key, child in request.children.items() if {child, child.rpartition("/")[0]} & moved]
            columns += [(part, index, nv) for part, nv in zip(names, parts, strict=True)]
        elif joint.nv:
            columns.append((name, index, int(joint.nv)))
    return columns


def _twins(model: Any) -> dict[int, tuple[int, int]]:
    """Joints with the name of an earlier joint: index -> index of the first, and count among them from 2."""
    first_of: dict[str, int] = {}
    twins: dict[int, tuple[int, int]] = {}
    for index, name in enumerate(map(str, model.names)):
        if name in first_of:
            twins[index] = (first_of[name], 2 + sum(twin == first_of[name] for twin, _ in twins.values()))
        first_of.setdefault(name, index)
    return twins


def _frame(request: Request, model: Any, joint: str, index: int) -> int | None:
    """Frame of the body that a joint carries, relative to that joint; None if the model has none."""
    body = request.children.get(joint)
    if body is None or not model.existFrame(body, pin.FrameType.BODY):
        return None
    frame = int(model.getFrameId(body, pin.FrameType.BODY))
    return frame if model.frames[frame].parentJoint == index else None


def _state(
    request: Request, model: Any, columns: list[tuple[str, int, int]], k: int
) -> tuple[Array, Array, Array, Array]:
    """Configuration, velocity, and map T, drift from the common velocity; a free base has both parts in body axes."""
    states = request.states
    described = [entry.key() for entry in model.referenceConfigurations]  # the pose that an MJCF defines
    q = np.array(model.referenceConfigurations["qpos0"] if "qpos0" in described else pin.neutral(model))
    v = np.zeros(model.nv)
    T, drift = np.eye(model.nv), np.zeros(model.nv)
    step = np.zeros(model.nv)
    iv = 0
    for name, index, dof in columns:
        iq = model.joints[index].idx_q
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
            q[iq : iq + 4] = np.roll(to_quaternion(R), -1)
        iv += dof
    return pin.integrate(model, q, step), T @ v, T, drift
