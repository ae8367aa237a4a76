"""A mechanism in MuJoCo: its start, its steps, samples of its state, and the certificate read from its model."""

import contextlib
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

import mujoco
import numpy as np

from proofroll.core.arrays import cross, longest
from proofroll.core.engine import Regularised
from proofroll.core.errors import Refused
from proofroll.elements.mechanism import WORLD, Joint, Mechanism
from proofroll.elements.mechanism.dynamics.held_signals import drive
from proofroll.elements.mechanism.dynamics.named_forces import named_forces
from proofroll.elements.mechanism.run.capabilities import ALL_JOINTS, FORCES, MechanismCapability, require
from proofroll.elements.mechanism.run.sampling import (
    DEPENDENT,
    MechanismBuilt,
    MechanismSample,
    mechanism_of,
    row_rank,
    unsaid,
)
from proofroll.elements.mechanism.scene.joint import child_in_parent
from proofroll.elements.mechanism.scene.joint_kinds import DISTANCE, WITH_AXIS, JointKind
from proofroll.elements.mechanism.scene.rotations import Array, skews, to_quaternion
from proofroll.elements.mechanism.scene.signal import Held, Signal, value_at, varies
from proofroll.engines.mujoco.running import SteppedModel, compiled, forget_callbacks, mass_matrix, silent
from proofroll.engines.mujoco.settings import LARGEST_IMPEDANCE, MujocoSettings, check
from proofroll.engines.mujoco.smooth import mechanism_model
from proofroll.engines.mujoco.smooth.applied_loads import AppliedLoads
from proofroll.engines.mujoco.smooth.prescribed_motions import PrescribedMotions

_CAPABILITY = MechanismCapability
_ROW = mujoco.mjtConstraint
_NO_SENSORS = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
# Factor on tolerances: the response of hard loops has round-off of its own, largest where rows are dependent.
_MARGIN = 1.1
_BRAKE = 1e9  # 1/s: deceleration over speed that a row of hard dry friction asks for, above any that friction gives
PROVIDES = (
    ALL_JOINTS
    | FORCES
    | {_CAPABILITY.FIXED_LOOP, _CAPABILITY.REVOLUTE_LOOP, _CAPABILITY.SPHERICAL_LOOP, _CAPABILITY.DISTANCE_LOOP}
    | {_CAPABILITY.REDUNDANT, _CAPABILITY.JOINT_FRICTION, _CAPABILITY.ARMATURE, _CAPABILITY.STOPS}
    | {
        _CAPABILITY.ACTUATORS,
        _CAPABILITY.SATURATION,
        _CAPABILITY.COUPLINGS,
        _CAPABILITY.COUPLINGS_OF_MANY,
        _CAPABILITY.SIGNALS,
        _CAPABILITY.HELD,
        _CAPABILITY.MOTIONS,
    }
)
_NO_ROWS = "MuJoCo's equality constraints hold points or whole frames together, and no single angle or direction"
LACKING: Mapping[str, str] = {
    **{MechanismCapability[f"{kind}_LOOP"]: _NO_ROWS for kind in ("PRISMATIC", "CYLINDRICAL", "UNIVERSAL", "PLANAR")},
    _CAPABILITY.MASSLESS: "MuJoCo needs a positive definite mass matrix of the tree alone",
    _CAPABILITY.REBOUNDS: "MuJoCo's limits have no restitution but that of a spring of their own",
}


class MujocoMechanism(SteppedModel):
    """Run of a mechanism in MuJoCo; see :class:`proofroll.core.engine.Engine` for the methods.

    Attributes:
        provides, lacking: capabilities of the formulation, and reasons for missing ones.
    """

    provides: ClassVar[frozenset[str]] = PROVIDES
    lacking: ClassVar[Mapping[str, str]] = LACKING

    def __init__(self, scene: Any, settings: MujocoSettings) -> None:
        check(settings)
        mechanism = mechanism_of(scene)
        require(mechanism, self.provides, self.lacking)
        forget_callbacks()
        super().__init__(compiled(mechanism_model.write(mechanism, settings)), settings)
        self._mechanism = mechanism
        self._bodies = [self._model.body(body.name).id for body in mechanism.bodies]
        self._sites = [self._model.site(f"{number}").id for number in range(len(mechanism.joints))]
        # Names are looked up once: in each sample they would cost more than the rest of it.
        self._sensors = [
            [int(self._model.sensor(f"{kind}{number}").adr[0]) for kind in ("FORCE", "TORQUE")]
            for number in range(len(mechanism.joints))
        ]
        self._named = bool(named_forces(mechanism))
        self._gears = [actuator.gear for actuator in mechanism.actuators]
        couplings = map(mechanism_model.coupling_name, mechanism.couplings)
        equalities = {self._model.equality(name).id: ("coupling", k) for k, name in enumerate(couplings)}
        for joint, _, _ in mechanism.prescribed:
            equality = self._model.equality(mechanism_model.motion_name(joint)).id
            equalities[equality] = "drive", mechanism.joint_index[joint.name]
        single = {self._model.joint(joint.name).id: k for k, joint in enumerate(mechanism.joints) if joint.nq == 1}
        dofs = {int(self._model.jnt_dofadr[joint_id]): k for joint_id, k in single.items()}
        self._numbers = single, dofs, equalities
        self._armature = self._model.dof_armature.copy()
        extra = mechanism_model.damping_armatures(mechanism, settings)
        for joint in (joint for joint in mechanism.joints if joint.name in extra):
            for part in map(self._model.joint, mechanism_model.part_names(joint)):
                self._armature[part.dofadr[0] :][: len(part.armature)] = joint.armature
        self._at_rest = np.full((2, len(mechanism.joints)), np.nan)
        self._at_rest[:, list(single.values())] = 0.0
        # Sensors give the reactions, and only samples need them: in every step they would cost 5 to 20 % of it.
        self._model.opt.disableflags |= _NO_SENSORS
        for joint in mechanism.joints:
            self._start(joint)
        signals = _signals(self._model, mechanism)
        self._moving = signals
        index = {body.name: number for body, number in zip(mechanism.bodies, self._bodies, strict=True)} | {WORLD: 0}
        self._loads = AppliedLoads(self._model, mechanism, index)
        self._motions = PrescribedMotions(self._model, mechanism)
        self._drive_at_pose(self._data)
        self._moving = [item for item in signals if varies(item[0]) and not isinstance(item[0], Held)]
        self._set = [(signal, field, index) for signal, field, index in signals if isinstance(signal, Held)]
        with silent():
            mujoco.mj_forward(self._model, self._data)

    def spec(self, portable: bool = False) -> Any:
        """MjSpec, whose keyframe ``start`` is time 0; ``portable``: with targets that its reader sets between instants.

        Raises:
            Refused: a drive or the target of an actuator changes in time: MuJoCo keeps these in the state.
        """
        held = [field for _, field, _ in self._set if not portable or field != "ctrl"]
        if self._moving or held or self._loads.any or self._motions:
            advice = "is set from outside in every step, and in no MJCF"
            raise Refused(
                f"an applied force, a bushing, a prescribed motion, and a drive or target that changes, {advice}"
            )
        spec = mechanism_model.write(self._mechanism, self._settings)
        drives = mechanism_model.add_constant_drives(spec, self._mechanism)
        control = np.append(self._data.ctrl, np.zeros(drives))
        spec.add_key(name="start", qpos=self._data.qpos, qvel=self._data.qvel, ctrl=control)
        compiled(spec)
        return spec

    def _start(self, joint: Joint) -> None:
        """Puts a joint's coordinates, velocities and drive into the state."""
        parts = [self._model.joint(name) for name in mechanism_model.part_names(joint)]
        if not parts:
            return
        q, v = np.array(joint.q0), np.array(joint.v0)
        if len(parts) == 1 and joint.kind == JointKind.FREE:  # qpos: the body's frame; qvel: its origin's velocity
            origin, S = child_in_parent(joint.kind, q)
            R = joint.parent_frame @ S
            arm = R @ joint.child_position
            place = np.array(joint.position) + joint.parent_frame @ origin - arm
            q = np.concatenate([place, to_quaternion(R)])
            v = np.concatenate([R @ v[:3] - cross(R @ v[3:], arm), v[3:]])
        elif joint.kind == JointKind.FREE:
            v = np.concatenate([child_in_parent(joint.kind, q)[1] @ v[:3], v[3:]])
        self._data.qpos[parts[0].qposadr[0] :][: len(q)] = q
        dof = parts[0].dofadr[0]
        self._data.qvel[dof : dof + len(v)] = v
        if joint.torque and not varies(joint.torque):
            self._data.qfrc_applied[dof] = joint.torque

    def _run(self, steps: int) -> None:
        """Makes ``steps`` steps; sets changing drives and targets before each, with RK4 before each of its stages.

        Applied forces depend on poses, which MuJoCo computes within a step: they are set there.
        """
        if not (self._moving or self._applies or self._motions):
            super()._run(steps)
        elif self._settings.integrator == "RK4" or self._applies:
            mujoco.set_mjcb_control(self._drive_in_step)
            try:
                super()._run(steps)
            finally:
                mujoco.set_mjcb_control(None)
        else:
            for _ in range(steps):
                self._drive(self._model, self._data)
                self._motions.apply(self._data)
                mujoco.mj_step(self._model, self._data)

    @property
    def _applies(self) -> bool:
        """True if forces depend on poses."""
        return self._loads.any

    def drive(self, values: Array) -> None:
        """See :class:`proofroll.core.engine_abilities.TakesTargets`."""
        drive(self._mechanism, values)
        for signal, field, index in self._set:
            getattr(self._data, field)[index] = signal.value

    def _drive(self, _: Any, data: Any) -> None:
        """Sets drives and targets to their values at the time of ``data``."""
        for signal, field, index in self._moving:
            getattr(data, field)[index] = float(value_at(signal, data.time))
        if self._loads.any:
            self._loads.apply(data)

    def _drive_in_step(self, model: Any, data: Any) -> None:
        self._drive(model, data)
        self._motions.apply_in_step(data)

    def _drive_at_pose(self, data: Any) -> None:
        """Sets drives, targets and applied forces for the state of ``data``, whose poses may be old."""
        if self._applies:
            for stage in (mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_comVel):
                stage(self._model, data)
        self._drive(self._model, data)
        self._motions.apply(data)

    def sample(self) -> MechanismSample:
        """See :class:`proofroll.core.engine.Engine`."""
        data = self._evaluated()
        twists = np.zeros((len(self._bodies), 6))
        for row, body in zip(twists, self._bodies, strict=True):
            mujoco.mj_objectVelocity(self._model, data, mujoco.mjtObj.mjOBJ_XBODY, body, row, 0)
        force, torque = self._reactions(data)
        by_law = self._along(data) if self._named else {}
        return MechanismSample(
            p_WB=data.xpos[self._bodies],
            v_WB=twists[:, 3:],
            w_WB=twists[:, :3],
            q_WB=data.xquat[self._bodies],
            joint_force=force,
            joint_torque=torque,
            **by_law,
        )

    def _along(self, data: Any) -> dict[str, Array]:
        """Efforts of actuators, forces of couplings, motions, dry friction and stops, along coordinates [N or N m]."""
        model, (single, dofs, equalities) = self._model, self._numbers
        friction, stop = self._at_rest.copy()
        held = {"coupling": np.zeros(len(self._mechanism.couplings)), "drive": np.full(len(friction), np.nan)}
        kinds = data.efc_type[: data.nefc].tolist()
        rows = self._rows(data, data.nefc) if kinds else None
        for row, (kind, item_id) in enumerate(zip(kinds, data.efc_id[: data.nefc].tolist(), strict=True)):
            force = float(data.efc_force[row])
            if kind == _ROW.mjCNSTR_EQUALITY and item_id in equalities:
                field, number = equalities[item_id]
                held[field][number] = force
            elif kind == _ROW.mjCNSTR_FRICTION_DOF and item_id in dofs:
                friction[dofs[item_id]] = force
            elif kind == _ROW.mjCNSTR_LIMIT_JOINT and item_id in single and rows is not None:
                # a stop pushes up where the coordinate has a positive sign in its row
                stop[single[item_id]] += force * float(np.sign(rows[row, int(model.jnt_dofadr[item_id])]))
        return {"effort": data.actuator_force * self._gears, **held, "friction": friction, "stop": stop}

    def _reactions(self, data: Any) -> tuple[Array, Array]:
        """Forces [N] and moments about the joint [N m] of joints and loops on the child, world axes.

        A sensor reads the load that passes through its joint, including the joint's own spring, damper and drive, but
        not the load that tendons and loops carry past it.
        """
        force, torque = unsaid(self._mechanism)
        count = len(self._mechanism.joints)
        for number, site in enumerate(self._sites):
            R = data.site_xmat[site].reshape(3, 3)
            force[number], torque[number] = (R @ data.sensordata[place : place + 3] for place in self._sensors[number])
        self._loads.take_springs(data, torque)
        rows = {int(data.efc_id[row]): row for row in reversed(range(data.ne))}  # first row of each constraint
        for number, loop in enumerate(self._mechanism.loops):
            if loop.kind == JointKind.FIXED:
                continue
            force[count + number] = torque[count + number] = 0.0
            origin = data.site(f"loop{number}b0").xpos
            if loop.kind == DISTANCE:
                strut = origin - data.site(f"loop{number}a0").xpos
                equality = mujoco.mj_name2id(self._model, mujoco.mjtObj.mjOBJ_EQUALITY, f"loop{number}.0")
                force[count + number] = data.efc_force[rows[equality]] * strut / np.linalg.norm(strut)
                continue
            for point in range(2):
                equality = mujoco.mj_name2id(self._model, mujoco.mjtObj.mjOBJ_EQUALITY, f"loop{number}.{point}")
                if equality not in rows:  # MuJoCo leaves out rows without a part along any velocity
                    continue
                on_b = -data.efc_force[rows[equality] : rows[equality] + 3]  # it acts on the first site's body
                force[count + number] += on_b
                torque[count + number] += cross(data.site(f"loop{number}b{point}").xpos - origin, on_b)
        return force, torque

    def built(self) -> MechanismBuilt:
        """See :class:`proofroll.core.engine.Engine`."""
        model, data, bodies, joints = self._model, self._evaluated(), self._bodies, self._mechanism.joints
        axes = np.zeros((len(bodies), 9))
        for flat, body in zip(axes, bodies, strict=True):
            mujoco.mju_quat2Mat(flat, model.body_iquat[body])
        R = axes.reshape(-1, 3, 3)
        rows = self._rows(data, data.ne)
        rank = row_rank(rows)
        accelerations = self._accelerations(data)
        with self._without_steps():
            M, h, g = equation_matrices(self._mechanism, model, data)
        return MechanismBuilt(
            mass=model.body_mass[bodies].copy(),
            com=model.body_ipos[bodies].copy(),
            inertia=np.einsum("nij,nj,nkj->nik", R, model.body_inertia[bodies], R),
            joint_position=np.array([data.site(f"{number}").xpos for number in range(len(joints))]),
            joint_axis=np.array([self._axis(data, joint) for joint in joints]),
            gravity=model.opt.gravity.copy(),
            mass_matrix=M,
            velocity_forces=h,
            gravity_forces=g,
            rows=len(rows),
            rank=rank,
            mobility=int(model.nv) - rank,
            acceleration=accelerations["acceleration"],
            angular_acceleration=accelerations["angular_acceleration"],
            regularised=self._softened(data, rows, accelerations),
        )

    def _axis(self, data: Any, joint: Joint) -> Array:
        """World direction of the joint axis (z of the joint's frame), shape (3,); NaN if the kind has no axis."""
        if joint.kind not in WITH_AXIS:
            return np.full(3, np.nan)
        names = mechanism_model.part_names(joint)
        return np.array(data.xaxis[self._model.joint(names[0 if joint.kind == JointKind.UNIVERSAL else -1]).id])

    def _rows(self, data: Any, count: int) -> Array:
        """The first rows of all constraints on MuJoCo's velocities, shape (count, nv)."""
        J = np.zeros((data.nefc, self._model.nv))
        if count and mujoco.mj_isSparse(self._model):
            mujoco.mju_sparse2dense(J, data.efc_J, data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind)
        elif count:
            J[:] = np.reshape(data.efc_J, J.shape)
        return J[:count]

    def _accelerations(self, data: Any) -> dict[str, Array]:
        """Accelerations of the bodies' origins, and angular ones, shape (bodies, 3) each."""
        mujoco.mj_rnePostConstraint(self._model, data)
        rows = np.zeros((len(self._bodies), 6))
        for row, body in zip(rows, self._bodies, strict=True):
            mujoco.mj_objectAcceleration(self._model, data, mujoco.mjtObj.mjOBJ_XBODY, body, row, 0)
        # MuJoCo reports what an accelerometer would: without gravity.
        return {"acceleration": rows[:, 3:] + self._model.opt.gravity, "angular_acceleration": rows[:, :3].copy()}

    def _softened(self, data: Any, rows: Array, soft: dict[str, Array]) -> dict[str, Regularised]:
        """Tolerances for MuJoCo's soft rows: of loops, and of dry friction in joints."""
        loops = self._softened_loops(data, rows, soft) if len(rows) else {}
        if not any(joint.friction for joint in self._mechanism.joints):
            return loops
        because = "dry friction is a soft row, which slow motion does not saturate; a hard one would change that much"
        tolerances = dict(loops)
        for name, hard in self._with_hard_friction(self._evaluated()).items():
            relative = _MARGIN * longest(hard - soft[name]) / (longest(hard) or np.finfo(float).tiny) + DEPENDENT
            loop = loops.get(name)
            tolerances[name] = (
                Regularised(relative, because)
                if loop is None
                else Regularised(relative + loop.tolerance, f"{loop.because}; {because}")
            )
        return tolerances

    def _with_hard_friction(self, data: Any) -> dict[str, Array]:
        """Accelerations with dry friction against any motion, however slow; keyed as :meth:`_accelerations`."""
        kept = self._model.dof_solimp.copy(), self._model.dof_solref.copy()
        self._model.dof_solimp[:, :2], self._model.dof_solref[:] = LARGEST_IMPEDANCE, (-1.0, -_BRAKE)
        try:
            with self._without_steps():
                self._forward(data)
                return self._accelerations(data)
        finally:
            self._model.dof_solimp[:], self._model.dof_solref[:] = kept

    def _softened_loops(self, data: Any, rows: Array, soft: dict[str, Array]) -> dict[str, Regularised]:
        """Tolerances for MuJoCo's soft loops: difference between its response and that of hard loops.

        The hard response uses MuJoCo's own matrices and meets its reference accelerations (``efc_aref``) exactly. So
        the tolerance covers softness and nothing else: a wrong or missing row is in both responses. Forces of couplings
        have tolerances of their own, for a light wheel hardly changes the largest acceleration.
        """
        forces = self._forces(data)
        into = np.linalg.solve(mass_matrix(self._model, data), rows.T)
        without = data.qacc - into @ data.efc_force[: data.ne]
        missing = data.efc_aref[: data.ne] - rows @ without
        data.efc_force[: data.ne] = np.linalg.pinv(rows @ into, DEPENDENT, hermitian=True) @ missing
        data.qacc[:] = without + into @ data.efc_force[: data.ne]
        at_rest = self._settings.impedances[0]
        because = f"loops are soft, of impedance {at_rest:g} at rest; hard ones would change that much"
        regularised = {}
        for name, hard in self._accelerations(data).items():
            difference = longest(hard - soft[name]) / max(longest(hard), np.finfo(float).tiny)
            regularised[name] = Regularised(_MARGIN * difference + DEPENDENT, because)
        hard_forces = self._forces(data)
        law_sizes = [np.abs(hard_forces[name]).max() for name in ("couplings", "drives") if name in hard_forces]
        least = DEPENDENT * float(max(law_sizes, default=0.0)) or 1.0
        for name, hard in hard_forces.items():
            difference = float(np.nanmax(np.abs(hard - forces[name])))
            size = max(float(np.nanmax(np.abs(hard))), least)
            regularised[name] = Regularised(_MARGIN * difference / size + DEPENDENT, because)
        return regularised

    def _forces(self, data: Any) -> dict[str, Array]:
        """Reactions of joints, forces of couplings and of motions, from accelerations and forces of rows."""
        mujoco.mj_rnePostConstraint(self._model, data)
        self._model.opt.disableflags &= ~_NO_SENSORS
        mujoco.mj_sensorAcc(self._model, data)
        self._model.opt.disableflags |= _NO_SENSORS
        force, torque = self._reactions(data)
        by_law, driven = (
            self._along(data),
            [self._mechanism.joint_index[k.name] for k, _, _ in self._mechanism.prescribed],
        )
        couplings, drives = by_law["coupling"], by_law["drive"][driven]
        forces = {"forces": force, "torques": torque, "couplings": couplings, "drives": drives}
        return {name: values for name, values in forces.items() if values.size}

    def _evaluate(self, data: Any) -> None:
        self._drive_at_pose(data)
        self._model.opt.disableflags &= ~_NO_SENSORS
        with self._without_steps():
            self._forward(data)
        self._model.opt.disableflags |= _NO_SENSORS

    @contextlib.contextmanager
    def _without_steps(self) -> Iterator[None]:
        """Takes away the armature of implicit damping: it belongs to a step, and not to the forces of a state."""
        model = self._model
        kept = model.dof_armature.copy(), model.dof_M0.copy()
        model.dof_M0 -= model.dof_armature - self._armature  # the mass matrix of bodies on one simple joint
        model.dof_armature[:] = self._armature
        try:
            yield
        finally:
            model.dof_armature[:], model.dof_M0[:] = kept

    def _forward(self, data: Any) -> None:
        super()._evaluate(data)


def _signals(model: Any, mechanism: Mechanism) -> list[tuple[Signal, str, int]]:
    """Signals (targets of actuators, drives that vary), each with the field of MjData that it sets and its index."""
    drives = [(joint.torque, joint.name) for joint in mechanism.joints if varies(joint.torque)]
    return [
        *((item.target, "ctrl", number) for number, item in enumerate(mechanism.actuators)),
        *((torque, "qfrc_applied", int(model.joint(name).dofadr[0])) for torque, name in drives),
    ]


def equation_matrices(mechanism: Mechanism, model: Any, data: Any) -> tuple[Array, Array, Array]:
    """M, h and g of M v̇ + h + g = τ, (nv, nv), (nv), (nv), at the state of ``data``.

    MuJoCo has its own order of velocities, and those of a free joint along the axes of the parent.
    """
    T, still = _velocities(mechanism, model)
    M, bias = mass_matrix(model, data), np.array(data.qfrc_bias)
    resting = mujoco.MjData(model)
    mujoco.mj_copyData(resting, model, data)
    resting.qvel[:] = 0.0
    mujoco.mj_fwdVelocity(model, resting)
    weights = np.array(resting.qfrc_bias)
    return T.T @ M @ T, T.T @ (bias - weights + M @ still), T.T @ weights


def _velocities(mechanism: Mechanism, model: Any) -> tuple[Array, Array]:
    """Derivative of MuJoCo's velocities by the tree's, (nv, nv), and their rate at constant velocities of the tree."""
    T, still = np.zeros((model.nv, mechanism.nv)), np.zeros(model.nv)
    q, v = mechanism.start()
    for joint, at_q, columns in zip(mechanism.joints, mechanism.q_slices, mechanism.v_slices, strict=True):
        parts = [model.joint(name) for name in mechanism_model.part_names(joint)]
        if not parts:
            continue
        dof = int(parts[0].dofadr[0])
        T[dof : dof + joint.nv, columns] = np.eye(joint.nv)
        if joint.kind != JointKind.FREE:
            continue
        R = child_in_parent(joint.kind, q[at_q])[1]
        arm = np.zeros(3)
        if len(parts) == 1:  # velocity of the origin of the body's frame in the world
            R = joint.parent_frame @ R
            arm = R @ joint.child_position
        linear, turning = R @ v[columns][:3], R @ v[columns][3:]
        T[dof : dof + 3, columns.start : columns.start + 3] = R
        T[dof : dof + 3, columns.start + 3 : columns.stop] = skews(arm[None])[0] @ R
        still[dof : dof + 3] = cross(turning, linear - cross(turning, arm))
    return T, still
