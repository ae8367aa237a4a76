"""Formulation ``tree``: a mechanism without loops as Exudyn's kinematic tree, integrated by explicit methods.

Its links have their frames at their joints, so all data of a body are transformed to there first. It has no reactions,
and no joints of more than one coordinate.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from proofroll.core.errors import Diverged
from proofroll.elements.mechanism import WORLD, Joint
from proofroll.elements.mechanism.dynamics.held_signals import drive
from proofroll.elements.mechanism.run.capabilities import ALL_JOINTS, ALL_LOOPS, FORCES, MechanismCapability, require
from proofroll.elements.mechanism.run.sampling import MechanismBuilt, MechanismSample, mechanism_of
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.rotations import Array, to_quaternion
from proofroll.engines.exudyn.integration import ExudynModel, Integration
from proofroll.engines.exudyn.native import Output, add_kinematic_tree, exu, items
from proofroll.engines.exudyn.settings import ExudynSettings
from proofroll.engines.exudyn.smooth.connections import add_forces, add_springs
from proofroll.engines.exudyn.smooth.joint_laws import JointLaws
from proofroll.engines.exudyn.smooth.redundant import add_bushings

_KNOWN = {MechanismCapability.REVOLUTE, MechanismCapability.PRISMATIC}
_DRIVES = {MechanismCapability[name] for name in ("ACTUATORS", "SATURATION", "SIGNALS", "HELD")}
PROVIDES: frozenset[str] = frozenset(_KNOWN | FORCES | _DRIVES)
LACKING: Mapping[str, str] = {
    **dict.fromkeys(ALL_JOINTS - _KNOWN, "a joint of Exudyn's kinematic tree has exactly one coordinate"),
    **dict.fromkeys(ALL_LOOPS, "Exudyn's explicit integrators take no constraints"),
    MechanismCapability.JOINT_FRICTION: "this model has no friction in joints",
    MechanismCapability.COUPLINGS: "Exudyn's explicit integrators take no constraints",
    MechanismCapability.MOTIONS: "Exudyn's explicit integrators take no constraints",
    MechanismCapability.ARMATURE: "Exudyn's kinematic tree has no inertia of drives",
}
_TYPES = {JointKind.REVOLUTE: exu.JointType.RevoluteZ, JointKind.PRISMATIC: exu.JointType.PrismaticZ}
_READ = ("Position", "Velocity", "AngularVelocity", "RotationMatrix", "Acceleration", "AngularAcceleration")


class KinematicTree(ExudynModel):
    """Run in joint coordinates; see :class:`proofroll.core.engine.Engine` for the methods."""

    def __init__(self, scene: Any, settings: ExudynSettings) -> None:
        mechanism = mechanism_of(scene)
        require(mechanism, PROVIDES, LACKING)
        self._mechanism = mechanism
        super().__init__()
        self._link = {joint.child: number for number, joint in enumerate(mechanism.joints)}
        self._frames = {WORLD: (np.eye(3), np.zeros(3))} | {  # each body's frame in that of its link
            joint.child: (joint.child_frame.T, -joint.child_frame.T @ joint.child_position)
            for joint in mechanism.joints
        }
        self._tree = self._add_tree()
        self._ground = self.system.CreateGround()
        add_springs(self.system, mechanism, self.marker)
        turns = {name: R for name, (R, _) in self._frames.items()}
        add_bushings(self.system, mechanism, self.marker, turns)
        add_forces(self.system, mechanism, self.marker, turns)
        self._laws = JointLaws(self.system, mechanism, self._coordinate, settings.dt)
        origins = [(self._link[body.name], self._in_link(body.name, np.zeros(3))) for body in mechanism.bodies]
        self._sensors = {name: self._add_sensors(name, origins) for name in _READ}
        on_joints = [(number, [0.0, 0.0, 0.0]) for number in range(len(mechanism.joints))]
        self._on_joints = {name: self._add_sensors(name, on_joints) for name in ("Position", "RotationMatrix")}
        self.system.Assemble()
        self.integration = Integration(self.system, settings)

    def _add_tree(self) -> Any:
        mechanism, joints = self._mechanism, self._mechanism.joints
        data = {body.name: body for body in mechanism.bodies}
        turns, offsets, coms, inertias = [], [], [], []
        for joint in joints:
            R, p = self._frames[joint.parent]
            turns.append(R @ joint.parent_frame)
            offsets.append(p + R @ joint.position)
            R, p = self._frames[joint.child]
            coms.append(p + R @ data[joint.child].com)
            inertias.append(R @ np.array(data[joint.child].inertia) @ R.T)
        return add_kinematic_tree(
            self.system,
            *mechanism.start(),
            turns=turns,
            offsets=offsets,
            inertias=inertias,
            coms=coms,
            jointTypes=[_TYPES[joint.kind] for joint in joints],
            linkParents=[self._link.get(joint.parent, -1) for joint in joints],
            linkMasses=[data[joint.child].mass for joint in joints],
            gravity=list(mechanism.gravity),
            jointForceVector=[joint.constant_drive for joint in joints],
            jointPControlVector=[joint.stiffness for joint in joints],
            jointDControlVector=[joint.damping for joint in joints],
            jointPositionOffsetVector=[joint.rest for joint in joints],
        )

    def _coordinate(self, joint: Joint) -> Any:
        """Adds a marker of a joint's coordinate."""
        node, number = self.system.GetObject(self._tree)["nodeNumber"], self._mechanism.joint_index[joint.name]
        return self.system.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=number))

    def _in_link(self, body: str, position: Array) -> list[float]:
        R, p = self._frames[body]
        return [float(x) for x in p + R @ position]

    def drive(self, values: Array) -> None:
        """See :class:`proofroll.core.engine_abilities.TakesTargets`."""
        drive(self._mechanism, values)
        if self.integration.t:
            self.integration = self.integration.again()

    def marker(self, body: str, position: Any) -> Any:
        """Adds a marker at a place in a body's frame [m]."""
        if body == WORLD:
            return self.system.AddMarker(items.MarkerBodyRigid(bodyNumber=self._ground, localPosition=list(position)))
        return self.system.AddMarker(
            items.MarkerKinematicTreeRigid(
                objectNumber=self._tree, linkNumber=self._link[body], localPosition=self._in_link(body, position)
            )
        )

    def _add_sensors(self, name: str, places: Sequence[tuple[int, list[float]]]) -> list[Any]:
        """Adds sensors of a quantity at places of links: (number of the link, place in its frame [m])."""
        return [
            self.system.AddSensor(
                items.SensorKinematicTree(
                    objectNumber=self._tree,
                    linkNumber=link,
                    localPosition=place,
                    outputVariableType=getattr(Output, name),
                    writeToFile=False,
                )
            )
            for link, place in places
        ]

    def _read(self, sensors: Sequence[Any]) -> Array:
        return np.array([self.system.GetSensorValues(sensor) for sensor in sensors])

    def sample(self) -> MechanismSample:
        """See :class:`proofroll.core.engine.Engine`; the tree has no reactions."""
        links = self._read(self._sensors["RotationMatrix"]).reshape(-1, 3, 3)
        if not np.isfinite(links).all():  # Exudyn's explicit steps go on with such numbers
            raise Diverged(f"the state is not finite at t = {self.integration.t:.6g} s")
        bodies = [R @ self._frames[body.name][0] for R, body in zip(links, self._mechanism.bodies, strict=True)]
        return MechanismSample(
            p_WB=self._read(self._sensors["Position"]),
            v_WB=self._read(self._sensors["Velocity"]),
            w_WB=self._read(self._sensors["AngularVelocity"]),
            q_WB=np.array([to_quaternion(R) for R in bodies]),
            **self._laws.named(self._laws.pushes()),
        )

    def built(self) -> MechanismBuilt:
        """See :class:`proofroll.core.engine.Engine`; accelerations from Exudyn's own mass matrix and forces."""
        tree = self.system.GetObject(self._tree)
        order = [self._link[body.name] for body in self._mechanism.bodies]
        frames = [self._frames[body.name] for body in self._mechanism.bodies]
        # Exudyn's lists do not end as Python's do: they are read by index
        coms = [np.array(tree["linkCOMs"][i]) for i in order]
        inertias = [np.array(tree["linkInertiasCOM"][i]) for i in order]
        linear, angular = self._accelerations()
        return MechanismBuilt(
            mass=np.array(tree["linkMasses"])[order],
            com=np.array([R.T @ (com - p) for (R, p), com in zip(frames, coms, strict=True)]),
            inertia=np.array([R.T @ inertia @ R for (R, _), inertia in zip(frames, inertias, strict=True)]),
            joint_position=self._read(self._on_joints["Position"]),
            joint_axis=self._read(self._on_joints["RotationMatrix"]).reshape(-1, 3, 3)[:, :, 2],
            gravity=np.array(tree["gravity"]),
            rows=0,
            rank=0,
            mobility=len(self._mechanism.joints),
            acceleration=linear,
            angular_acceleration=angular,
        )

    def _accelerations(self) -> tuple[Array, Array]:
        """Linear [m/s²] and angular accelerations [rad/s²] of the body frames, shape (bodies, 3); keeps the state."""
        solver, state = self.integration.solver, self.system.systemData
        solver.ComputeMassMatrix(self.system, 1.0)
        solver.ComputeODE2RHS(self.system)
        kept = state.GetODE2Coordinates_tt()
        rates = np.linalg.solve(solver.GetSystemMassMatrix(), solver.GetSystemResidual())
        state.SetODE2Coordinates_tt(rates, exu.ConfigurationType.Current)
        accelerations = self._read(self._sensors["Acceleration"]), self._read(self._sensors["AngularAcceleration"])
        state.SetODE2Coordinates_tt(kept, exu.ConfigurationType.Current)
        return accelerations
