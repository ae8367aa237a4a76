"""A mechanism in MuJoCo: start, steps, and what is read back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from proofroll.core.arrays import cross
from proofroll.core.engine import Sample
from proofroll.core.errors import Refused
from proofroll.elements.mechanism import Joint
from proofroll.elements.mechanism.capabilities import ALL_JOINTS, FORCES, MechanismCapability, require
from proofroll.elements.mechanism.joint import child_in_parent
from proofroll.elements.mechanism.rotations import Array, to_quaternion
from proofroll.elements.mechanism.sampling import MechanismBuilt, mechanism_of, unsaid
from proofroll.engines.mujoco import mechanism_model
from proofroll.engines.mujoco.mechanism_built import read_back
from proofroll.engines.mujoco.running import SteppedModel, compiled, forget_callbacks, silent
from proofroll.engines.mujoco.settings import MujocoSettings, check

_CAPABILITY = MechanismCapability
_NO_SENSORS = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
PROVIDES = (
    ALL_JOINTS
    | FORCES
    | {_CAPABILITY.FIXED_LOOP, _CAPABILITY.REVOLUTE_LOOP, _CAPABILITY.SPHERICAL_LOOP, _CAPABILITY.REDUNDANT}
    | {_CAPABILITY.JOINT_FRICTION, _CAPABILITY.ARMATURE}
)
_NO_ROWS = "MuJoCo's equality constraints hold points or whole frames together, and no single angle or direction"
LACKING: Mapping[str, str] = {
    _CAPABILITY.PRISMATIC_LOOP: _NO_ROWS,
    _CAPABILITY.UNIVERSAL_LOOP: _NO_ROWS,
    _CAPABILITY.PLANAR_LOOP: _NO_ROWS,
}


class MujocoMechanism(SteppedModel):
    """See :class:`proofroll.core.engine.Engine` for the methods."""

    def __init__(self, scene: Any, settings: MujocoSettings) -> None:
        check(settings, bounded=False)
        mechanism = mechanism_of(scene)
        require(mechanism, PROVIDES, LACKING)
        forget_callbacks()
        super().__init__(compiled(mechanism_model.write(mechanism, settings)), settings)
        self._mechanism = mechanism
        self._bodies = [self._model.body(body.name).id for body in mechanism.bodies]
        self._sites = [self._model.site(f"{number}").id for number in range(len(mechanism.joints))]
        # Sensors tell reactions; in each of the steps between samples they would cost a twentieth to a fifth of it.
        self._model.opt.disableflags |= _NO_SENSORS
        for number, joint in enumerate(mechanism.joints):
            self._start(number, joint)
        with silent():
            mujoco.mj_forward(self._model, self._data)

    def model_file(self) -> str:
        """MJCF, whose keyframe ``start`` is time 0.

        Raises:
            Refused: a joint has a constant drive, which is no part of a model but of its state.
        """
        driven = [joint.name for joint in self._mechanism.joints if joint.torque]
        if driven:
            raise Refused(f"the constant drive of {driven[0]} is set from outside in every step, and in no MJCF")
        spec = mechanism_model.write(self._mechanism, self._settings)
        spec.add_key(name="start", qpos=self._data.qpos, qvel=self._data.qvel)
        compiled(spec)
        return str(spec.to_xml())

    def _start(self, number: int, joint: Joint) -> None:
        """Puts a joint's coordinates, velocities and drive into the state."""
        parts = [self._model.joint(f"{number}.{part}") for part in range(len(mechanism_model.parts_of(joint)))]
        if not parts:
            return
        q, v = np.array(joint.q0), np.array(joint.v0)
        if len(parts) == 1 and joint.kind == "free":  # qpos: the body's frame in the world; qvel: its origin's velocity
            origin, S = child_in_parent(joint.kind, q)
            R = joint.parent_frame @ S
            arm = R @ joint.child_position
            place = np.array(joint.position) + joint.parent_frame @ origin - arm
            q = np.concatenate([place, to_quaternion(R)])
            v = np.concatenate([R @ v[:3] - cross(R @ v[3:], arm), v[3:]])
        elif joint.kind == "free":
            v = np.concatenate([child_in_parent(joint.kind, q)[1] @ v[:3], v[3:]])
        self._data.qpos[parts[0].qposadr[0] :][: len(q)] = q
        first = parts[0].dofadr[0]
        self._data.qvel[first : first + len(v)] = v
        if joint.torque:
            self._data.qfrc_applied[first] = joint.torque

    def sample(self) -> Sample:
        """See :class:`proofroll.core.engine.Engine`."""
        data = self._evaluated()
        twists = np.zeros((len(self._bodies), 6))
        for row, body in zip(twists, self._bodies, strict=True):
            mujoco.mj_objectVelocity(self._model, data, mujoco.mjtObj.mjOBJ_XBODY, body, row, 0)
        force, torque = self._reactions(data)
        return Sample(
            p_WB=data.xpos[self._bodies].copy(),
            v_WB=twists[:, 3:].copy(),
            w_WB=twists[:, :3].copy(),
            q_WB=data.xquat[self._bodies].copy(),
            joint_force=force,
            joint_torque=torque,
        )

    def _reactions(self, data: Any) -> tuple[Array, Array]:
        """Forces and moments of joints and loops on the child, about the joint, world axes.

        The sensors tell what passes through a joint, with its own spring, damper and drive, but without what tendons
        and loops carry past it.
        """
        force, torque = unsaid(self._mechanism)
        count = len(self._mechanism.joints)
        for number, site in enumerate(self._sites):
            R = data.site_xmat[site].reshape(3, 3)
            force[number] = R @ data.sensor(f"FORCE{number}").data
            torque[number] = R @ data.sensor(f"TORQUE{number}").data
        rows = {int(data.efc_id[row]): row for row in reversed(range(data.ne))}  # first row of each constraint
        for number, loop in enumerate(self._mechanism.loops):
            if loop.kind == "fixed":
                continue
            force[count + number] = torque[count + number] = 0.0
            origin = data.site(f"loop{number}b0").xpos
            for point in range(2):
                equality = mujoco.mj_name2id(self._model, mujoco.mjtObj.mjOBJ_EQUALITY, f"loop{number}.{point}")
                if equality < 0:
                    continue
                on_b = -data.efc_force[rows[equality] : rows[equality] + 3]  # it acts on the first site's body
                force[count + number] += on_b
                torque[count + number] += cross(data.site(f"loop{number}b{point}").xpos - origin, on_b)
        return force, torque

    def built(self) -> MechanismBuilt:
        """See :class:`proofroll.core.engine.Engine`."""
        return read_back(self._model, self._evaluated(), self._mechanism, self._settings.impedances[0])

    def _evaluate(self, data: Any) -> None:
        self._model.opt.disableflags &= ~_NO_SENSORS
        super()._evaluate(data)
        self._model.opt.disableflags |= _NO_SENSORS
