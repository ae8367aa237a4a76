"""Exudyn's kinematic tree of a robot, built from proofroll's own reading of the file: Exudyn has no importer."""

import importlib.metadata
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from proofroll.core.errors import Refused
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.rotations import about, from_z, to_rpy
from proofroll.engines.exudyn.integration import new_system
from proofroll.engines.exudyn.native import Output, add_kinematic_tree, exu, items, new_settings
from proofroll.robots.model import NO_BODY, Array, RobotJoint
from proofroll.robots.protocol import AtState, Reading, Request, evaluate

# Exudyn's joint type and axis of each link that stands for a joint.
_FREE = tuple((kind, axis) for kind in ("prismatic", "revolute") for axis in "XYZ")
_CHAINS: Mapping[str, tuple[tuple[str, str], ...]] = {
    JointKind.FREE: _FREE,
    JointKind.SPHERICAL: _FREE[3:],
    JointKind.REVOLUTE: (("revolute", "Z"),),
    JointKind.PRISMATIC: (("prismatic", "Z"),),
}


class ExudynRobots:
    """Robots as ``ObjectKinematicTree``.

    Single joints are about or along z. A ball joint is three hinges about x, y, z; a free joint has three slides first.
    """

    title: ClassVar[str] = "Exudyn"
    kinds: ClassVar[tuple[str, ...]] = ("urdf", "mjcf")
    fed: ClassVar[bool] = True
    options: ClassVar[Mapping[str, str]] = {}
    tolerances: ClassVar[Mapping[str, float]] = {}
    says: ClassVar[str] = "fed from our reading of the file: it has no importer of its own, so this checks its dynamics"

    def version(self) -> str:
        """Version of the package."""
        return importlib.metadata.version("exudyn")

    def read(self, request: Request) -> Reading:
        """The tree, evaluated by functions of Exudyn's implicit solver."""
        tree = _Tree(request)
        joints = tuple(joint.name for joint in request.robot.moving)
        dofs = tuple(joint.dofs for joint in request.robot.moving)
        frames: list[dict[str, tuple[Array, Array]]] = []

        def at(k: int) -> AtState:
            q, v, T, drift = tree.state(k)
            tree.put(q, np.zeros_like(q), np.zeros_like(q))
            g = -tree.force()
            tree.put(q, v, np.zeros_like(q))
            tree.damp(0.0)
            h, M = -tree.force(), tree.mass_matrix()
            tree.damp(1.0)
            frames.append(tree.frames())

            free = -np.linalg.solve(T.T, tree.free_damping * np.linalg.solve(T, v))

            def forward(torque: Array) -> Array:
                tree.put(q, v, torque + free)
                try:
                    return np.asarray(np.linalg.solve(M, tree.force()))
                except np.linalg.LinAlgError:  # the file's own mass matrix is singular: nothing to compare
                    return np.full_like(v, np.nan)

            return AtState(T=T, drift=drift, M=M, g=g, h=h, inverse=None, forward=forward)

        arrays = evaluate(request, joints, dofs, at)
        mass, com, inertia = tree.body_numbers()
        return Reading(
            joints=joints, dofs=dofs, mass=mass, com=com, inertia=inertia,
            position={name: np.array([frame[name][0] for frame in frames]) for name in joints},
            rotation={name: np.array([frame[name][1] for frame in frames]) for name in joints},
            **arrays,
        )  # fmt: skip


class _Tree:
    """Kinematic tree of a robot in its own Exudyn system; the robot's velocity columns are its coordinates."""

    def __init__(self, request: Request) -> None:
        self.request, self.robot = request, request.robot
        # Axes of the tree's link in the child's frame: z along the joint's axis; for ball and free joints identity.
        self.turn = {joint.name: np.eye(3) if joint.dofs > 1 else from_z(joint.axis) for joint in self.robot.moving}
        damping: Array = np.concatenate([np.full(joint.dofs, joint.damping) for joint in self.robot.moving])
        loose: Array = np.concatenate([np.full(joint.dofs, joint.dofs > 1) for joint in self.robot.moving])
        # Damping of ball and free joints acts on angular velocities, not on the rates of the tree's angles.
        self.free_damping: Array = loose * damping
        self.damping: Array = damping - self.free_damping
        self.link: dict[str, int] = {}
        rows = [row for joint in self.robot.moving for row in self._rows(joint)]
        kinds, parents, turns, offsets, masses, coms, inertias = zip(*rows, strict=True)
        self.container, self.mbs = new_system()
        zeros = [0.0] * len(rows)
        self.tree = add_kinematic_tree(
            self.mbs, zeros, zeros, turns=turns, offsets=offsets, inertias=inertias, coms=coms,
            jointTypes=[getattr(exu.JointType, f"{kind.capitalize()}{axis}") for kind, axis in kinds],
            linkParents=list(parents), linkMasses=list(masses), gravity=list(self.robot.gravity),
            jointDControlVector=list(self.damping),
        )  # fmt: skip
        self.markers = {
            joint.name: self.mbs.AddMarker(
                items.MarkerKinematicTreeRigid(
                    objectNumber=self.tree, linkNumber=self.link[joint.name],
                    localPosition=list(-self.turn[joint.name].T @ joint.child_position),
                )
            )
            for joint in self.robot.moving
        }  # fmt: skip
        self.mbs.Assemble()
        self.solver = exu.MainSolverImplicitSecondOrder()
        settings = new_settings(dependent=False)
        settings.timeIntegration.verboseMode = 0
        self.solver.InitializeSolver(self.mbs, settings)

    def _rows(self, joint: RobotJoint) -> list[tuple[Any, ...]]:
        """Links of the tree for a joint: type, parent, rotation, offset, mass, centre of mass, inertia."""
        robot, start = self.robot, self.robot.columns[joint.name].start
        group, A = robot.groups[joint.name], self.turn[joint.name]
        carried = (group.mass, A.T @ (group.com - joint.child_position), A.T @ group.inertia @ A)
        home, p, R = robot.welded[joint.parent]
        position, rotation = p + R @ joint.position, R @ joint.rotation @ A
        parent = -1
        if joint.kind == JointKind.FREE:  # its coordinates are relative to the world, whatever its parent is
            position, rotation = np.zeros(3), np.eye(3)
        elif home != NO_BODY:
            parent = self.link[home]
            carrier = next(joint_of_home for joint_of_home in robot.moving if joint_of_home.name == home)
            B = self.turn[home]
            position, rotation = B.T @ (position - carrier.child_position), B.T @ rotation
        self.link[joint.name] = start + joint.dofs - 1
        frame, empty = (parent, rotation, position), (0.0, np.zeros(3), np.zeros((3, 3)))
        rows: list[tuple[Any, ...]] = []
        for index, kind in enumerate(_CHAINS[joint.kind], start=start):
            rows.append((kind, *frame, *(carried if index == self.link[joint.name] else empty)))
            frame = (index, np.eye(3), np.zeros(3))
        return rows

    def state(self, k: int) -> tuple[Array, Array, Array, Array]:
        """Coordinates q, rates v, T and drift d of state ``k``: v = T ν and v̇ = T ν̇ + d, ν as in ``AtState``."""
        states, n = self.request.states, self.robot.dofs
        q, T, drift = np.zeros(n), np.eye(n), np.zeros(n)
        velocity = np.concatenate([states.velocity[joint.name][k] for joint in self.robot.moving])
        for joint in self.robot.moving:
            columns = self.robot.columns[joint.name]
            if joint.dofs == 1:
                q[columns] = states.angle[joint.name][k]
                continue
            R = states.rotation[joint.name][k]
            turned = slice(columns.stop - 3, columns.stop)
            q[turned] = angles = -np.array(to_rpy(R.T))  # R = Rx(a) Ry(b) Rz(c)
            if joint.kind == JointKind.FREE:
                q[columns.start : turned.start], R = states.position[joint.name][k], np.eye(3)
            x = np.array([1.0, 0.0, 0.0])
            y = about(0, angles[0])[:, 1]
            z = (about(0, angles[0]) @ about(1, angles[1]))[:, 2]
            inverse = np.linalg.inv(np.column_stack([x, y, z]))
            # the common angular velocity of a free joint has world axes, that of a ball joint the child's axes
            T[turned, turned] = inverse @ R
            a, b, _ = rates = T[turned, turned] @ velocity[turned]
            moving = np.column_stack([0 * x, np.cross(a * x, y), np.cross(a * x + b * y, z)]) @ rates
            drift[turned] = -inverse @ moving
        return q, T @ velocity, T, drift

    def put(self, q: Array, v: Array, torque: Array) -> None:
        """Sets coordinates, rates and joint torques of the tree."""
        self.mbs.systemData.SetODE2Coordinates(list(q))
        self.mbs.systemData.SetODE2Coordinates_t(list(v))
        self.mbs.SetObjectParameter(self.tree, "jointForceVector", list(torque))

    def damp(self, part: float) -> None:
        """Sets the damping of joints to ``part`` times that of the file."""
        self.mbs.SetObjectParameter(self.tree, "jointDControlVector", list(part * self.damping))

    def force(self) -> Array:
        """Right-hand side Q of M q̈ = Q, damping included."""
        self.solver.ComputeODE2RHS(self.mbs)
        return np.array(self.solver.GetSystemResidual())[: self.robot.dofs]

    def mass_matrix(self) -> Array:
        """Mass matrix of the tree. Raises Refused if it is not finite."""
        self.solver.ComputeMassMatrix(self.mbs)
        matrix = np.array(self.solver.GetSystemMassMatrix())
        if not np.all(np.isfinite(matrix)):
            raise Refused("the mass matrix of its tree is not finite, as where a joint moves no mass")
        return matrix

    def frames(self) -> dict[str, tuple[Array, Array]]:
        """Position and rotation of the body that each joint carries."""
        frames = {}
        for name, marker in self.markers.items():
            p = self.mbs.GetMarkerOutput(marker, Output.Position)
            R = np.array(self.mbs.GetMarkerOutput(marker, Output.RotationMatrix)).reshape(3, 3)
            frames[name] = (np.array(p), R @ self.turn[name].T)
        return frames

    def body_numbers(self) -> tuple[dict[str, float], dict[str, Array], dict[str, Array]]:
        """Mass, centre of mass and inertia of each link, read back."""
        parameters = self.mbs.GetObject(self.tree)
        mass, com, inertia = {}, {}, {}
        for joint in self.robot.moving:
            link, A = self.link[joint.name], self.turn[joint.name]
            mass[joint.name] = float(parameters["linkMasses"][link])
            com[joint.name] = A @ np.array(parameters["linkCOMs"][link]) + joint.child_position
            inertia[joint.name] = A @ np.array(parameters["linkInertiasCOM"][link]) @ A.T
        return mass, com, inertia
