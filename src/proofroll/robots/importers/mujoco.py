"""MuJoCo's own importer of URDF and MJCF, with the compiled model read back."""

import importlib.metadata
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import mujoco
import numpy as np

from proofroll.core.errors import Refused
from proofroll.elements.mechanism.scene.joint_kinds import ONE_COORDINATE, JointKind
from proofroll.elements.mechanism.scene.rotations import from_quaternion, to_quaternion
from proofroll.engines.mujoco.running import mass_matrix, written
from proofroll.robots.importers.mujoco_model import actuators_of, is_off, near_shapes, reflected
from proofroll.robots.model import NO_BODY, Array, Cord, Mimic, Robot, RobotBody, RobotJoint, RobotLoop, Tie, composed
from proofroll.robots.protocol import AtState, Reading, Request, Whole, evaluate

# Springs and dampers; MuJoCo up to 3.3 has one flag for both.
_PASSIVE = sum(
    int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{name}", 0))
    for name in (("SPRING", "DAMPER") if hasattr(mujoco.mjtDisableBit, "mjDSBL_DAMPER") else ("PASSIVE",))
)
_NOT_COMPARED = ("EQUALITY", "LIMIT", "CONTACT", "ACTUATION")


class MujocoRobots:
    """Robot files as MuJoCo's compiler reads them."""

    title: ClassVar[str] = "MuJoCo"
    kinds: ClassVar[tuple[str, ...]] = ("urdf", "mjcf")
    defines: ClassVar[str] = "mjcf"
    options: ClassVar[Mapping[str, str]] = {
        "fusestatic": "merge bodies without a joint into their parents (default for URDF)",
        "balanceinertia": "replace an inertia that breaks the triangle inequality by a sphere's",
        "boundmass": "raise every mass to 1e-6 kg and every inertia to 1e-8 kg m²",
    }
    says: ClassVar[str] = ""
    near_shapes = staticmethod(near_shapes)

    @property
    def tolerances(self) -> dict[str, float]:
        """Tolerances by layer; up to 3.13, half angles from 1 − cos leave principal axes half of the digits."""
        if tuple(int(part) for part in self.version().split(".")[:2]) >= (3, 14):
            return {}
        torques = ("mass matrix", "gravity", "bias", "inverse dynamics", "forward dynamics")
        return {"bodies": 5e-6, **dict.fromkeys(torques, 1e-7)}

    def version(self) -> str:
        """Version of the package."""
        return importlib.metadata.version("mujoco")

    def compiled(self, path: Path) -> Robot:
        """The compiled model of an MJCF as plain data."""
        return robot_of(mujoco.MjModel.from_xml_path(str(path)))

    def expanded(self, path: Path) -> str:
        """Text of an MJCF file with repetitions, attached models and composites written out."""
        spec = mujoco.MjSpec.from_file(str(path))
        spec.compile()
        return written(spec)

    def as_written(self, request: Request) -> Whole:
        """Degrees of freedom and moving mass [kg] of the unchanged file, loaded from its path."""
        spec = mujoco.MjSpec.from_file(str(request.path))
        for option, on in request.options.items():
            if option == "boundmass":
                spec.compiler.boundmass, spec.compiler.boundinertia = (1e-6, 1e-8) if on else (0.0, 0.0)
            else:
                setattr(spec.compiler, option, on)
        model = _with_base(spec, request).compile()
        moved = model.body_dofnum[model.body_weldid] > 0
        return Whole(int(model.nv), float(model.body_mass[moved].sum()))

    def read(self, request: Request) -> Reading:
        """Compiled model without actuators, tendons, medium and constraints but dry friction of joints.

        Friction rows are hard: how soft the file has them is a remark.
        """
        model = _compile(request)
        off = mujoco.mjtDisableBit
        model.opt.disableflags |= sum(int(getattr(off, f"mjDSBL_{name}")) for name in _NOT_COMPARED)
        model.opt.density = model.opt.viscosity = 0.0
        for name in ("body_gravcomp", "tendon_stiffness", "tendon_damping", "tendon_frictionloss"):
            if hasattr(model, name):
                getattr(model, name)[:] = 0.0
        if request.kind == "urdf":
            model.opt.gravity = request.gravity
        data = mujoco.MjData(model)
        softness = _softness_of_friction(model, data)
        joints = tuple(model.joint(index).name for index in range(model.njnt))
        dofs = tuple({0: 6, 1: 3}.get(int(kind), 1) for kind in model.jnt_type)
        home = {
            joints[index]: int(model.jnt_bodyid[index])
            for index in range(model.njnt)
            if index == model.njnt - 1 or model.jnt_bodyid[index + 1] != model.jnt_bodyid[index]
        }
        frames: list[tuple[Array, Array]] = []
        arrays = evaluate(request, joints, dofs, lambda k: _at(request, model, data, joints, dofs, k, frames))
        groups = {name: _group(model, body) for name, body in home.items()}
        followers = model.eq_obj1id[model.eq_type == int(mujoco.mjtEq.mjEQ_JOINT)]
        return Reading(
            joints=joints,
            dofs=dofs,
            mass={name: body.mass for name, body in groups.items()},
            com={name: body.com for name, body in groups.items()},
            inertia={name: body.inertia for name, body in groups.items()},
            position={name: np.array([p[body] for p, _ in frames]) for name, body in home.items()},
            rotation={name: np.array([R[body].reshape(3, 3) for _, R in frames]) for name, body in home.items()},
            coupled=tuple(joints[number] for number in followers.tolist()),
            remarks=softness,
            **arrays,
        )


def _compile(request: Request) -> Any:
    """MjModel of the request; options are written into the file's text, where every version reads them."""
    text = request.path.read_text(encoding="utf-8")
    written = {key: str(on).lower() for key, on in request.options.items() if key != "boundmass"}
    if request.options.get("boundmass"):
        written |= {"boundmass": "1e-6", "boundinertia": "1e-8"}
    if written:
        compiler = "<compiler " + " ".join(f'{key}="{value}"' for key, value in written.items()) + "/>"
        end = "</robot>" if request.kind == "urdf" else "</mujoco>"
        extra = f"<mujoco>{compiler}</mujoco>" if request.kind == "urdf" else compiler
        text = text[: text.rindex(end)] + extra + end
    if request.kind == "urdf" and request.base == "free":
        return _with_base(mujoco.MjSpec.from_string(text), request).compile()
    return mujoco.MjModel.from_xml_string(text)


def _with_base(spec: Any, request: Request) -> Any:
    """The robot; for a URDF with a free base, with a free joint between the world and its root."""
    if request.kind == "urdf" and request.base == "free":
        bodies = spec.worldbody.bodies if hasattr(spec.worldbody, "bodies") else [spec.worldbody.first_body()]
        bodies[0].add_freejoint().name = request.base_joint
    return spec


def _at(
    request: Request, model: Any, data: Any, joints: tuple[str, ...], dofs: tuple[int, ...], k: int, frames: list[Any]
) -> AtState:
    states = request.states
    T = np.eye(model.nv)
    data.qpos[:], data.qvel[:] = model.qpos0, 0.0
    for index, name in enumerate(joints):
        q, v = int(model.jnt_qposadr[index]), int(model.jnt_dofadr[index])
        if name in states.rotation:
            R = states.rotation[name][k]
            if dofs[index] == 6:
                data.qpos[q : q + 3] = states.position[name][k]
                T[v + 3 : v + 6, v + 3 : v + 6] = R.T  # its angular velocity has body axes
                q += 3
            data.qpos[q : q + 4] = to_quaternion(R)
        elif name in states.angle:
            data.qpos[q] += states.angle[name][k]
    mujoco.mj_forward(model, data)
    g = data.qfrc_bias.copy()
    for index, name in enumerate(joints):
        v = int(model.jnt_dofadr[index])
        if name in states.velocity:
            data.qvel[v : v + dofs[index]] = states.velocity[name][k]
    data.qvel[:] = T @ data.qvel
    data.qfrc_applied[:] = 0.0
    mujoco.mj_forward(model, data)
    frames.append((data.xpos.copy(), data.xmat.copy()))
    M = mass_matrix(model, data)

    def inverse(acceleration: Array) -> Array:
        data.qacc[:] = acceleration
        flags = model.opt.disableflags
        # Else passive forces are added and subtracted again, which leaves round-off.
        model.opt.disableflags |= _PASSIVE | int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
        mujoco.mj_inverse(model, data)
        model.opt.disableflags = flags
        return np.array(data.qfrc_inverse + data.qfrc_passive)

    def forward(torque: Array) -> Array:
        data.qfrc_applied[:] = torque
        mujoco.mj_forward(model, data)
        data.qfrc_applied[:] = 0.0
        return np.array(data.qacc)

    return AtState(T=T, drift=np.zeros(model.nv), M=M, g=g, h=data.qfrc_bias.copy(), inverse=inverse, forward=forward)


def _softness_of_friction(model: Any, data: Any) -> tuple[str, ...]:
    """Remark on the softness of dry friction in the file's own rows, which are hard from then on."""
    mujoco.mj_forward(model, data)
    rows = np.flatnonzero(data.efc_type[: data.nefc] == int(mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF))
    # The row resists with (damping · speed) / R until it reaches its friction, and the joint's own damping beside it.
    dampings = model.dof_damping[data.efc_id[rows]]
    speeds = data.efc_frictionloss[rows] / (data.efc_KBIP[rows, 1] / data.efc_R[rows] + dampings)
    model.dof_solref[:], model.dof_solimp[:, :2] = (-1.0, -1e9), mujoco.mjMAXIMP
    model.opt.solver, model.opt.iterations, model.opt.tolerance = int(mujoco.mjtSolver.mjSOL_NEWTON), 100, 0.0
    if not rows.size:
        return ()
    worst = int(speeds.argmax())
    joint = model.joint(int(model.dof_jntid[data.efc_id[rows[worst]]]))
    unit = "m/s" if joint.type[0] == mujoco.mjtJoint.mjJNT_SLIDE else "rad/s"
    return (
        f"its dry friction is soft: joint {joint.name} creeps at up to {speeds[worst]:.2g} {unit} under a load that "
        "its friction should hold (solreffriction, solimpfriction); compared as hard",
    )


def _group(model: Any, body: int) -> RobotBody:
    """Composite of a body and all bodies welded to it, in the body's frame."""
    poses = {body: (np.zeros(3), np.eye(3))}
    parts = []
    for index in range(body, model.nbody):
        if index != body:
            parent = int(model.body_parentid[index])
            if int(model.body_weldid[index]) != body or parent not in poses:
                continue
            p, R = poses[parent]
            poses[index] = (p + R @ model.body_pos[index], R @ matrix(model.body_quat[index]))
        parts.append((body_of(model, index, ""), *poses[index]))
    return composed("", parts)


_KINDS = {0: JointKind.FREE, 1: JointKind.SPHERICAL, 2: JointKind.PRISMATIC, 3: JointKind.REVOLUTE}


def robot_of(model: Any) -> Robot:
    """Robot of a compiled model; a body with several joints hangs on massless bodies, one for each further joint.

    Coordinates count from ``qpos0``, the pose that the file describes.

    Raises:
        Refused: the model has armature of a tendon, or springs or dampers that are not linear.
    """
    if np.any(getattr(model, "tendon_armature", np.zeros(0))):
        raise Refused("a tendon has armature, which the check does not cover")
    if any(np.any(getattr(model, f"{name}poly", 0)) for name in ("jnt_stiffness", "dof_damping", "actuator_damping")):
        raise Refused("a joint has a spring or damper that is not linear, which the check does not cover")
    names = [NO_BODY, *(model.body(index).name for index in range(1, model.nbody))]
    bodies: dict[str, RobotBody] = {}
    joints: list[RobotJoint] = []
    actuators = actuators_of(model)
    driven = {actuator.joint for actuator in actuators}
    for index in range(1, model.nbody):
        name, parent = names[index], names[int(model.body_parentid[index])]
        bodies[name] = body_of(model, index, name)
        position, rotation = np.array(model.body_pos[index]), matrix(model.body_quat[index])
        begin, count = int(model.body_jntadr[index]), int(model.body_jntnum[index])
        if not count:
            joints.append(
                RobotJoint(
                    name=f"({name})",
                    kind=JointKind.FIXED,
                    parent=parent,
                    child=name,
                    position=position,
                    rotation=rotation,
                    axis=np.array([0.0, 0.0, 1.0]),
                )
            )
        for joint in range(begin, begin + count):
            last = joint == begin + count - 1
            child = name if last else f"{name}/{joint - begin}"
            if not last:
                bodies[child] = RobotBody(child, 0.0, np.zeros(3), np.zeros((3, 3)))
            joints.append(_joint(model, joint, parent, child, position, rotation, model.joint(joint).name in driven))
            parent, position, rotation = child, np.zeros(3), np.eye(3)
    gravity = np.zeros(3) if is_off(model, "GRAVITY") else np.array(model.opt.gravity)
    loops, ties, further = _constraints(model, names)
    cords, laws_of_tendons = _tendons(model, names)
    carrying = np.flatnonzero(model.jnt_actgravcomp & model.jnt_actfrclimited & model.body_gravcomp.any())
    within = [f"gravity compensation within the actuatorfrcrange of {model.joint(k).name}" for k in carrying.tolist()]
    robot = Robot(
        name="robot",
        bodies=bodies,
        joints=tuple(joints),
        mimics=_mimics(model),
        gravity=gravity,
        sources=_sources(model, names),
        loops=loops,
        ties=ties,
        cords=cords,
        further=(*further, *laws_of_tendons, *within),
        actuators=actuators,
    )
    laws = {"SPRING": "stiffness", "DAMPER": "damping", "FRICTIONLOSS": "friction"}
    off = {law: 0.0 for flag, law in laws.items() if is_off(model, flag)}
    return robot.with_joints(**off | ({"friction": 0.0} if is_off(model, "CONSTRAINT") else {}))


def body_of(model: Any, index: int, name: str) -> RobotBody:
    """One of MuJoCo's bodies, in its own frame."""
    A = matrix(model.body_iquat[index])
    inertia = A @ np.diag(model.body_inertia[index]) @ A.T
    com, mass = np.array(model.body_ipos[index]), float(model.body_mass[index])
    return RobotBody(name, mass, com, inertia, compensation=float(model.body_gravcomp[index]))


def _sources(model: Any, names: list[str]) -> dict[str, dict[str, Any]]:
    """Body -> its pose in the file, and whether each of its shapes, in the file's order, collides with anything."""
    sources: dict[str, dict[str, Any]] = {
        names[index]: {
            "collides": [],
            "position": np.array(model.body_pos[index]),
            "rotation": matrix(model.body_quat[index]),
        }
        for index in range(1, model.nbody)
    }
    for index in range(model.ngeom):
        name = names[int(model.geom_bodyid[index])]
        if name in sources:
            sources[name]["collides"].append(bool(model.geom_contype[index] or model.geom_conaffinity[index]))
    return sources


def _joint(
    model: Any, index: int, parent: str, child: str, position: Array, rotation: Array, driven: bool
) -> RobotJoint:
    kind = _KINDS[int(model.jnt_type[index])]
    dof, start = int(model.jnt_dofadr[index]), int(model.jnt_qposadr[index])
    anchor = np.array(model.jnt_pos[index]) * (kind != JointKind.FREE)
    shift = float(model.qpos0[start]) * (kind in ONE_COORDINATE)
    bounded = bool(model.jnt_limited[index])
    least, greatest = model.jnt_actfrcrange[index].tolist()
    return RobotJoint(
        name=model.joint(index).name, kind=kind, parent=parent, child=child,
        position=position + rotation @ anchor if kind != JointKind.FREE else np.zeros(3),
        rotation=rotation if kind != JointKind.FREE else np.eye(3),
        axis=np.array(model.jnt_axis[index]), child_position=anchor,
        damping=_first(model.dof_damping[dof]) + reflected(model, "damping", index),
        friction=float(model.dof_frictionloss[dof]),
        armature=float(model.dof_armature[dof]) + reflected(model, "armature", index),
        stiffness=_first(model.jnt_stiffness[index]),
        rest=float(model.qpos_spring[start]) - shift,
        lower=float(model.jnt_range[index, 0]) - shift if bounded and kind in ONE_COORDINATE else None,
        upper=float(model.jnt_range[index, 1]) - shift if bounded else None,
        effort=greatest if model.jnt_actfrclimited[index] and greatest == -least else None,
        actuated=driven,
        ref=shift,
    )  # fmt: skip


def _equalities(model: Any) -> list[int]:
    """Numbers of the equality constraints that act."""
    if is_off(model, "EQUALITY") or is_off(model, "CONSTRAINT"):
        return []
    return [index for index in range(model.neq) if model.eq_active0[index]]


def _mimics(model: Any) -> tuple[Mimic, ...]:
    """Linear couplings of joints; the comparison leaves out other constraints."""
    mimics, coupling = [], int(mujoco.mjtEq.mjEQ_JOINT)
    for index in _equalities(model):
        joint_1, joint_2 = int(model.eq_obj1id[index]), int(model.eq_obj2id[index])
        factors = model.eq_data[index][:5]
        if model.eq_type[index] == coupling and joint_2 >= 0 and not np.any(factors[2:]):
            mimics.append(
                Mimic(model.joint(joint_1).name, model.joint(joint_2).name, float(factors[1]), float(factors[0]))
            )
    return tuple(mimics)


def _constraints(model: Any, names: Sequence[str]) -> tuple[tuple[RobotLoop, ...], tuple[Tie, ...], tuple[str, ...]]:
    """Active equality constraints as loops, as ties of joints, and clauses on all others but mimics.

    Coordinates count from ``qpos0``, where a tendon that an equality holds has the length that is kept.
    """
    kinds = mujoco.mjtEq
    loops: list[RobotLoop] = []
    ties: list[Tie] = []
    further: list[str] = []
    for index in _equalities(model):
        kind, data = int(model.eq_type[index]), np.array(model.eq_data[index])
        a, b = int(model.eq_obj1id[index]), int(model.eq_obj2id[index])
        word = kinds(kind).name.removeprefix("mjEQ_").lower()
        name = model.equality(index).name or f"{word}{index}"
        if kind in {int(kinds.mjEQ_CONNECT), int(kinds.mjEQ_WELD)}:
            if model.eq_objtype[index] == mujoco.mjtObj.mjOBJ_SITE:
                (a, at_a, R_a), (b, at_b, R_b) = (_site(model, site) for site in (a, b))
                place, turn = (at_a, at_b), R_a @ R_b.T
            elif kind == int(kinds.mjEQ_CONNECT):
                place, turn = (data[:3], data[3:6]), np.eye(3)
            else:
                place, turn = (data[3:6], data[:3]), matrix(data[6:10])
            closing = JointKind.SPHERICAL if kind == int(kinds.mjEQ_CONNECT) else JointKind.FIXED
            loops.append(
                RobotLoop(
                    name=name,
                    kind=closing,
                    body_a=names[a],
                    body_b=names[b],
                    position_a=place[0],
                    position_b=place[1],
                    rotation=turn,
                )
            )
        elif kind == int(kinds.mjEQ_TENDON) and (terms := _held_sum(model, a, b, data)):
            ties.append(Tie(name, tuple(terms), tuple(terms.values()), float(data[0])))
        elif kind != int(kinds.mjEQ_JOINT) or b < 0 or np.any(data[2:5]):
            further.append(f"the equality constraint {word} {name}")
    return tuple(loops), tuple(ties), tuple(further)


def _tendons(model: Any, names: Sequence[str]) -> tuple[tuple[Cord, ...], tuple[str, ...]]:
    """Limited tendons between two sites as cords, and clauses on all other limits and laws of tendons."""
    cords: list[Cord] = []
    further: list[str] = []
    laws = {"stiffness": "SPRING", "stiffnesspoly": "SPRING", "damping": "DAMPER", "dampingpoly": "DAMPER"}
    laws |= {"frictionloss": "FRICTIONLOSS"}
    for index in range(model.ntendon):
        begin = int(model.tendon_adr[index])
        wraps = [int(kind) for kind in model.wrap_type[begin : begin + int(model.tendon_num[index])]]
        kind = "fixed" if mujoco.mjtWrap.mjWRAP_JOINT in wraps else "spatial"
        name = model.tendon(index).name or f"tendon{index}"
        values = {law: getattr(model, f"tendon_{law}", None) for law in laws}
        if any(
            item is not None and np.any(item[index]) and not is_off(model, laws[law]) for law, item in values.items()
        ):
            further.append(f"the tendon {kind} {name}")
        if not model.tendon_limited[index] or is_off(model, "LIMIT"):
            continue
        low, high = model.tendon_range[index].tolist()
        if wraps != [mujoco.mjtWrap.mjWRAP_SITE] * 2 or low > 0:
            further.append(f"the range of the tendon {kind} {name}")
            continue
        (a, at_a, _), (b, at_b, _) = (_site(model, int(site)) for site in model.wrap_objid[begin : begin + 2])
        cord = Cord(name=name, body_a=names[a], body_b=names[b], position_a=at_a, position_b=at_b, at_most=high)
        cords.append(cord)
    return tuple(cords), tuple(further)


def _site(model: Any, site: int) -> tuple[int, Array, Array]:
    """Body of a site, and the site's position and axes in that body's frame."""
    return int(model.site_bodyid[site]), np.array(model.site_pos[site]), matrix(model.site_quat[site])


def _held_sum(model: Any, number: int, second: int, data: Array) -> dict[str, float]:
    """Coefficient of each joint in the sum that an equality of one or two fixed tendons holds; empty if it is none."""
    if second >= 0 and (np.any(data[2:5]) or not _fixed_tendon(model, second)):
        return {}
    terms: dict[str, float] = {}
    for tendon, factor in ((number, 1.0), *(((second, -float(data[1])),) if second >= 0 else ())):
        for joint, coefficient in _fixed_tendon(model, tendon):
            terms[joint] = terms.get(joint, 0.0) + factor * coefficient
    return terms if _fixed_tendon(model, number) else {}


def _fixed_tendon(model: Any, tendon: int) -> list[tuple[str, float]]:
    """Joints of a fixed tendon with their coefficients; empty for a tendon through sites."""
    parts = range(int(model.tendon_adr[tendon]), int(model.tendon_adr[tendon] + model.tendon_num[tendon]))
    if any(model.wrap_type[part] != mujoco.mjtWrap.mjWRAP_JOINT for part in parts):
        return []
    return [(model.joint(int(model.wrap_objid[part])).name, float(model.wrap_prm[part])) for part in parts]


def _first(value: Any) -> float:
    """Linear coefficient; newer versions of MuJoCo have a polynomial, which starts with it."""
    return float(np.ravel(value)[0])


def matrix(quaternion: Array) -> Array:
    """Rotation matrix of a quaternion w, x, y, z, shape (3, 3)."""
    return from_quaternion(quaternion)
