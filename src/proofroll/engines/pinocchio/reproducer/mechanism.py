"""A program that runs a mechanism with Pinocchio's terms alone, its numbers read from Pinocchio's own model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from proofroll.core.errors import Refused
from proofroll.core.program_text import assigned
from proofroll.elements.mechanism.joint import FACTS
from proofroll.engines.pinocchio.constraint_dynamics import ConstraintDynamics
from proofroll.engines.pinocchio.mechanism_run import MechanismRun
from proofroll.engines.pinocchio.reproducer.stepping import ADAPTIVE_STEPS
from proofroll.engines.pinocchio.settings import PinocchioSettings

_MODEL = """
KINDS = {
    "JointModelRZ": pin.JointModelRZ,
    "JointModelPZ": pin.JointModelPZ,
    "JointModelUniversal": lambda: pin.JointModelUniversal(np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])),
    "JointModelSpherical": pin.JointModelSpherical,
    "JointModelFreeFlyer": pin.JointModelFreeFlyer,
    "JointModelComposite": lambda: pin.JointModelComposite(pin.JointModelPX()),  # in a plane
}
model = pin.Model()
model.gravity.linear = np.array(GRAVITY)
for parent, kind, pose, mass, centre, inertia in JOINTS:
    joint = KINDS[kind]()
    if kind == "JointModelComposite":
        joint.addJoint(pin.JointModelPY())
        joint.addJoint(pin.JointModelRZ())
    number = model.addJoint(parent, joint, pin.SE3(np.array(pose)), f"joint {model.njoints}")
    model.appendBodyToJoint(number, pin.Inertia(mass, np.array(centre), np.array(inertia)), pin.SE3.Identity())
FRAMES = [
    model.addFrame(pin.Frame(f"frame {number}", joint, pin.SE3(np.array(pose)), pin.FrameType.OP_FRAME), False)
    for number, (joint, pose) in enumerate(ATTACHED)
]
model.armature = np.array(ARMATURE)
data, nq = model.createData(), model.nq


def seen(q, v):
    \"\"\"Of every frame place, axes, Jacobian, velocity, and acceleration where no joint accelerates; world axes.\"\"\"
    pin.forwardKinematics(model, data, q, v, np.zeros(model.nv))
    pin.computeJointJacobians(model, data, q)
    pin.updateFramePlacements(model, data)
    found, axes = [], pin.LOCAL_WORLD_ALIGNED
    for frame in FRAMES:
        pose, J, twist, rate = data.oMf[frame], np.zeros((6, model.nv)), np.zeros(6), np.zeros(6)
        if model.frames[frame].parentJoint:
            J = pin.getFrameJacobian(model, data, frame, axes).reshape(6, model.nv)
            twist = pin.getFrameVelocity(model, data, frame, axes).vector
            rate = pin.getFrameClassicalAcceleration(model, data, frame, axes).vector
        found.append((pose.translation.copy(), pose.rotation.copy(), J.copy(), twist.copy(), rate.copy()))
    return found


def loop_rows(frames):
    \"\"\"Residuals of the loops, their rows C with C v = 0, and Cdot v.\"\"\"
    residual, C, drift = [], [], []
    for first, second, places, turns in LOOPS:
        (p_a, A, J_a, v_a, a_a), (p_b, B, J_b, v_b, a_b) = frames[first], frames[second]
        d, dv, w_a, w_b = p_b - p_a, (v_b - v_a)[:3], v_a[3:], v_b[3:]
        for k in places:
            n, r, rate = A[:, k], np.cross(A[:, k], d), np.cross(w_a, A[:, k])
            residual.append(n @ d)
            C.append(n @ (J_b - J_a)[:3] + r @ J_a[3:])
            drift.append(n @ (a_b - a_a)[:3] + r @ a_a[3:] + 2 * rate @ dv + np.cross(w_a, rate) @ d)
        for i, j in turns:
            x, y = A[:, i], B[:, j]
            t, x_rate, y_rate = np.cross(y, x), np.cross(w_a, x), np.cross(w_b, y)
            residual.append(x @ y)
            C.append(t @ (J_b - J_a)[3:])
            bend = np.cross(w_a, x_rate) @ y + x @ np.cross(w_b, y_rate) + 2 * x_rate @ y_rate
            drift.append(t @ (a_b - a_a)[3:] + bend)
    return np.array(residual), np.array(C), np.array(drift)


def forces(frames, q, v):
    \"\"\"Generalised forces of drives, dampers and springs.\"\"\"
    tau = np.array(DRIVES) - np.array(DAMPING) * v
    for stiffness, rest, at_q, at_v in SPRUNG:
        tau[at_v] -= stiffness * (q[at_q] - rest)
    for first, second, stiffness, damping, length in SPRINGS:
        d, dv = (frames[second][part] - frames[first][part] for part in (0, 3))
        distance = np.linalg.norm(d)
        pull = stiffness * (distance - length) + damping * dv[:3] @ d / distance
        tau += pull * d / distance @ (frames[first][2] - frames[second][2])[:3]
    return tau


def split(q, C):
    \"\"\"The rows' split of velocities in the metric of the mass matrix, of a rank found once.\"\"\"
    M = pin.crba(model, data, q)
    M = np.triu(M) + np.triu(M, 1).T
    into = np.linalg.inv(np.linalg.cholesky(M)).T
    U, S, Vt = np.linalg.svd(C @ into, full_matrices=False)
    return into, into @ Vt[:RANK].T, U[:, :RANK].T / S[:RANK, None]

"""
_NULL_SPACE = """
def acceleration(q, v):
    \"\"\"Of the joints, with the loops by projection on the null space of their rows.\"\"\"
    frames = seen(q, v)
    tau = forces(frames, q, v)
    if not RANK:
        return pin.aba(model, data, q, v, tau).copy()
    _, C, drift = loop_rows(frames)
    into, locked, back = split(q, C)
    free = into @ (into.T @ (tau - pin.rnea(model, data, q, v, np.zeros(model.nv))))
    return free - locked @ (back @ (drift + C @ free))

"""
_CONSTRAINT_DYNAMICS = """
constraints, results = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
for one, place_1, two, place_2 in POINTS:
    ends = one, pin.SE3(np.array(place_1)), two, pin.SE3(np.array(place_2))
    constraints.append(pin.RigidConstraintModel(pin.ContactType.CONTACT_3D, model, *ends, pin.LOCAL))
    results.append(constraints[-1].createData())
pin.initConstraintDynamics(model, data, constraints, results)
proximal = pin.ProximalSettings(*PROXIMAL)


def acceleration(q, v):
    \"\"\"Of the joints, with the loops as Pinocchio's constraints.\"\"\"
    tau = forces(seen(q, v), q, v)
    return pin.constraintDynamics(model, data, q, v, tau, constraints, results, proximal).copy()

"""
_MOTION = """
def rates(y):
    \"\"\"Of configuration and velocity together.\"\"\"
    q, v = pin.normalize(model, y[:nq]), y[nq:]
    return np.concatenate([pin.tangentMap(model, q) @ v, acceleration(q, v)])


def accepted(y):
    \"\"\"A state after a step, with violations of the loops taken away.\"\"\"
    q, v = pin.normalize(model, y[:nq]), y[nq:]
    if ELIMINATES:
        residual, C, _ = loop_rows(seen(q, v))
        _, locked, back = split(q, C)
        v = v - locked @ (back @ (C @ v))
        q = pin.integrate(model, q, -locked @ (back @ residual))
    return np.concatenate([q, v])


def state(y):
    \"\"\"Places [m], energy [J] and how far loops are open [m].\"\"\"
    q, v = y[:nq], y[nq:]
    frames = seen(q, v)
    energy = pin.computeKineticEnergy(model, data, q, v) + pin.computePotentialEnergy(model, data, q)
    energy += sum(stiffness * (q[at] - rest) ** 2 / 2 for stiffness, rest, at, _ in SPRUNG)
    for first, second, stiffness, _, length in SPRINGS:
        energy += stiffness * (np.linalg.norm(frames[second][0] - frames[first][0]) - length) ** 2 / 2
    opened = np.abs(loop_rows(frames)[0]).max(initial=0.0)
    return [frames[place][0] for place in PLACES], float(energy), float(opened)


def run(times):
    \"\"\"The state at each time.\"\"\"
    try:
        yield from (state(y) for y in states(times))
    except np.linalg.LinAlgError as error:
        raise RuntimeError(f"the equations became singular ({error})") from None

"""
_RK4 = """
def states(times):
    \"\"\"By the classical Runge-Kutta method.\"\"\"
    y, done, h = np.array(START), 0, STEP_SIZE
    for t in times:
        while done < round(t / h):
            k1 = rates(y)
            k2 = rates(y + h / 2 * k1)
            k3 = rates(y + h / 2 * k2)
            y, done = accepted(y + h / 6 * (k1 + 2 * (k2 + k3) + rates(y + h * k3))), done + 1
            if not np.isfinite(y.sum()):
                raise RuntimeError(f"the state is not finite at {done * h:g} s")
        yield y
"""
_DOP853 = """
def accept(solver):
    \"\"\"Takes away violations of loops.\"\"\"
    solver.y = accepted(solver.y)
    solver.f = rates(solver.y)


def states(times):
    \"\"\"At each time.\"\"\"
    return steps(DOP853(lambda _, y: rates(y), 0.0, np.array(START), np.inf, rtol=RTOL, atol=RTOL), times, accept)
"""


def source(run: MechanismRun, settings: PinocchioSettings) -> str:
    """The program's part that runs a model, given at time 0.

    Raises:
        Refused: it has actuators, couplings, or drives in time.
    """
    tree, mechanism = run.tree, run.tree.mechanism
    if mechanism.actuators or mechanism.couplings or tree.varies:
        raise Refused("programs hold no actuators, couplings or drives in time yet")
    model = tree.model
    attached: dict[tuple[int, str], int] = {}
    frames = {body.name: frame for body, frame in zip(mechanism.bodies, tree.body, strict=True)}

    def at(frame: int, place: Sequence[float] = (0.0, 0.0, 0.0)) -> int:
        """The program's number of a frame, or of a place in its axes."""
        carrier = model.frames[frame]
        pose = np.array(carrier.placement.homogeneous)
        pose[:3, 3] += pose[:3, :3] @ np.array(place)
        key = int(carrier.parentJoint), repr(pose.tolist())
        return attached.setdefault(key, len(attached))

    loops = [
        (at(a), at(b), FACTS[loop.kind].translations, FACTS[loop.kind].rotations)
        for loop, (a, b) in zip(mechanism.loops, tree.loops, strict=True)
    ]
    springs = [(at(a), at(b), spring.stiffness, spring.damping, spring.length) for spring, a, b in tree.springs]
    followed = [(point.body, point.position) for point in mechanism.points]
    followed = followed or [(body.name, (0.0, 0.0, 0.0)) for body in mechanism.bodies]
    places = [at(frames[body], position) for body, position in followed]
    joints = [
        f"    ({model.parents[k]}, {model.joints[k].shortname()!r}, {model.jointPlacements[k].homogeneous.tolist()!r}, "
        f"{item.mass!r}, {item.lever.tolist()!r}, {item.inertia.tolist()!r}),\n"
        for k, item in enumerate(model.inertias)
        if k
    ]
    values = {
        "GRAVITY": list(mechanism.gravity),
        "ARMATURE": model.armature,
        "LOOPS": loops,
        "SPRINGS": springs,
        "PLACES": places,
        "DRIVES": tree.drive,
        "DAMPING": tree.damping,
        "SPRUNG": [(stiffness, rest, q.start, v.start) for stiffness, rest, q, v in tree.sprung],
        "START": np.concatenate([tree.q0, tree.v0]),
        "RANK": run.rank,
        "ELIMINATES": settings.projection and run.rank > 0,
        "RTOL" if settings.integrator == "dop853" else "STEP_SIZE": getattr(settings, settings.resolution),
    }
    if loops and isinstance(run.dynamics, ConstraintDynamics):
        held = run.dynamics.constraints
        ends = [(one.joint1_id, one.joint1_placement, one.joint2_id, one.joint2_placement) for one in held]
        values["POINTS"] = [(i, a.homogeneous.tolist(), j, b.homogeneous.tolist()) for i, a, j, b in ends]
        values["PROXIMAL"] = run.dynamics.proximal
    poses = "".join(f"    ({joint}, {pose}),\n" for joint, pose in attached)
    by_constraints, adaptive = "POINTS" in values, settings.integrator == "dop853"
    return "".join(
        [
            "import numpy as np\nimport pinocchio as pin\n" + "from scipy.integrate import DOP853\n" * adaptive,
            "\n# Parent, kind, pose on it; mass, centre and inertia that the joint carries. Depth-first.\n",
            f"JOINTS = [\n{''.join(joints)}]\n",
            f"# Places that something is attached to: joint, and pose on it.\nATTACHED = [\n{poses}]\n",
            assigned(**values),
            _MODEL,
            _CONSTRAINT_DYNAMICS if by_constraints else _NULL_SPACE,
            _MOTION,
            ADAPTIVE_STEPS + _DOP853 if adaptive else _RK4,
        ]
    )
