"""What MuJoCo built of a mechanism, read back from its model and from its state at time 0."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from proofroll.core.engine import Regularised
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.rotations import Array
from proofroll.elements.mechanism.sampling import DEPENDENT, WITH_AXIS, MechanismBuilt, independent
from proofroll.engines.mujoco.mechanism_model import PARTS
from proofroll.engines.mujoco.running import mass_matrix

# The hard answer has round-off of its own, most where rows depend on each other.
_MARGIN = 1.1


def read_back(model: Any, data: Any, mechanism: Mechanism, impedance: float) -> MechanismBuilt:
    """Everything that the certificate asks, from an evaluated state at time 0, which is overwritten.

    ``impedance`` is that of the loops at rest.
    """
    bodies = [model.body(body.name).id for body in mechanism.bodies]
    axes = np.zeros((len(bodies), 9))
    for flat, body in zip(axes, bodies, strict=True):
        mujoco.mju_quat2Mat(flat, model.body_iquat[body])
    R = axes.reshape(-1, 3, 3)
    rows = _equality_rows(model, data)
    rank = independent(rows)
    found = _accelerations(model, data, bodies)
    return MechanismBuilt(
        mass=model.body_mass[bodies].copy(),
        com=model.body_ipos[bodies].copy(),
        inertia=np.einsum("nij,nj,nkj->nik", R, model.body_inertia[bodies], R),
        joint_position=np.array([data.site(f"{number}").xpos for number in range(len(mechanism.joints))]),
        joint_axis=np.array([_axis(model, data, number, joint.kind) for number, joint in enumerate(mechanism.joints)]),
        gravity=model.opt.gravity.copy(),
        rows=len(rows),
        rank=rank,
        mobility=int(model.nv) - rank,
        acceleration=found["acceleration"],
        angular_acceleration=found["angular_acceleration"],
        regularised=_softened(model, data, bodies, rows, found, impedance) if len(rows) else {},
    )


def _axis(model: Any, data: Any, number: int, kind: str) -> Array:
    """Of the turning or sliding along z of a joint's frame, in the world."""
    if kind not in WITH_AXIS:
        return np.full(3, np.nan)
    part = 0 if kind == "universal" else len(PARTS[kind]) - 1
    return np.array(data.xaxis[model.joint(f"{number}.{part}").id])


def _equality_rows(model: Any, data: Any) -> Array:
    """Rows of the equality constraints on MuJoCo's velocities, shape (rows, nv)."""
    J = np.zeros((data.nefc, model.nv))
    if data.ne and mujoco.mj_isSparse(model):
        mujoco.mju_sparse2dense(J, data.efc_J, data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind)
    elif data.ne:
        J[:] = np.reshape(data.efc_J, J.shape)
    return J[: data.ne]


def _accelerations(model: Any, data: Any, bodies: list[int]) -> dict[str, Array]:
    """Of the bodies' origins, and angular, shape (bodies, 3) each."""
    mujoco.mj_rnePostConstraint(model, data)
    found = np.zeros((len(bodies), 6))
    for row, body in zip(found, bodies, strict=True):
        mujoco.mj_objectAcceleration(model, data, mujoco.mjtObj.mjOBJ_XBODY, body, row, 0)
    # MuJoCo's are those that a sensor feels
    return {"acceleration": found[:, 3:] + model.opt.gravity, "angular_acceleration": found[:, :3].copy()}


def _softened(
    model: Any, data: Any, bodies: list[int], rows: Array, soft: dict[str, Array], impedance: float
) -> dict[str, Regularised]:
    """What MuJoCo's soft loops change: its answer against that of its own matrices with hard loops.

    Hard loops have the accelerations that MuJoCo's own terms want (``efc_aref``), exactly. The tolerance is thus what
    softness explains and no more: rows that are wrong or missing are so in both answers.
    """
    into = np.linalg.solve(mass_matrix(model, data), rows.T)
    without = data.qacc - into @ data.efc_force[: data.ne]
    missing = data.efc_aref[: data.ne] - rows @ without
    data.qacc[:] = without + into @ np.linalg.pinv(rows @ into, DEPENDENT, hermitian=True) @ missing
    because = f"loops are soft, of impedance {impedance:g} at rest; hard ones would change that much"
    found = {}
    for name, hard in _accelerations(model, data, bodies).items():
        difference = float(np.abs(hard - soft[name]).max() / max(np.abs(hard).max(), np.finfo(float).tiny))
        found[name] = Regularised(_MARGIN * difference + DEPENDENT, because)
    return found
