"""A program that runs a mechanism with Pinocchio's terms alone, its numbers read from Pinocchio's own model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from proofroll.core.errors import Refused
from proofroll.core.program_text import assigned, module_text
from proofroll.elements.mechanism.joint import FACTS
from proofroll.engines.pinocchio.constraint_dynamics import ConstraintDynamics
from proofroll.engines.pinocchio.mechanism_run import MechanismRun
from proofroll.engines.pinocchio.reproducer import mechanism_loop
from proofroll.engines.pinocchio.reproducer.mechanism_loop import MechanismLoop
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
constraints = pin.StdVec_RigidConstraintModel()
for one, place_1, two, place_2 in POINTS:
    ends = one, pin.SE3(np.array(place_1)), two, pin.SE3(np.array(place_2))
    constraints.append(pin.RigidConstraintModel(pin.ContactType.CONTACT_3D, model, *ends, pin.LOCAL))
LOOP = MechanismLoop(
    model, np.array(START), [(FRAMES[a], FRAMES[b], *rows) for a, b, *rows in LOOPS],
    [(FRAMES[a], FRAMES[b], *law) for a, b, *law in SPRINGS], SPRUNG, np.array(DRIVES), np.array(DAMPING), RANK,
    ELIMINATES, STEP_SIZE, RTOL, (constraints, pin.ProximalSettings(*PROXIMAL)) if POINTS else None,
)


def run(times):
    \"\"\"Places [m], energy [J] and how far loops are open [m] at each time.\"\"\"
    yield from LOOP.run(times, [FRAMES[place] for place in PLACES])
"""


def source(run: MechanismRun, settings: PinocchioSettings) -> str:
    """The program's part that runs a model, given at time 0; refuses as :func:`loop_of`."""
    tree, mechanism = run.tree, run.tree.mechanism
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
    loop = loop_of(run, settings)
    constraints = run.dynamics.constraints if isinstance(run.dynamics, ConstraintDynamics) and loops else []
    ends = [(one.joint1_id, one.joint1_placement, one.joint2_id, one.joint2_placement) for one in constraints]
    values = {
        "GRAVITY": list(mechanism.gravity),
        "ARMATURE": model.armature,
        "LOOPS": loops,
        "SPRINGS": springs,
        "PLACES": places,
        "DRIVES": loop.drives,
        "DAMPING": loop.damping,
        "SPRUNG": loop.sprung,
        "START": loop.start,
        "RANK": loop.rank,
        "ELIMINATES": loop.eliminates,
        "STEP_SIZE": loop.dt,
        "RTOL": loop.rtol,
        "POINTS": [(i, a.homogeneous.tolist(), j, b.homogeneous.tolist()) for i, a, j, b in ends],
        "PROXIMAL": run.dynamics.proximal if isinstance(run.dynamics, ConstraintDynamics) else (),
    }
    poses = "".join(f"    ({joint}, {pose}),\n" for joint, pose in attached)
    return "".join(
        [
            module_text(mechanism_loop),
            "\n\n# Parent, kind, pose on it; mass, centre and inertia that the joint carries. Depth-first.\n",
            f"JOINTS = [\n{''.join(joints)}]\n",
            f"# Places that something is attached to: joint, and pose on it.\nATTACHED = [\n{poses}]\n",
            assigned(**values),
            _MODEL,
        ]
    )


def loop_of(run: MechanismRun, settings: PinocchioSettings) -> MechanismLoop:
    """The loop without the adapter, on the model of a run at time 0.

    Raises:
        Refused: the mechanism has actuators, couplings, or drives in time.
    """
    if run.tree.mechanism.actuators or run.tree.mechanism.couplings or run.tree.varies:
        raise Refused("programs hold no actuators, couplings or drives in time yet")
    tree, constraints = run.tree, run.dynamics if isinstance(run.dynamics, ConstraintDynamics) else None
    adaptive = settings.integrator == "dop853"
    return MechanismLoop(
        tree.model,
        np.concatenate([tree.q0, tree.v0]),
        [
            (a, b, FACTS[loop.kind].translations, FACTS[loop.kind].rotations)
            for loop, (a, b) in zip(tree.mechanism.loops, tree.loops, strict=True)
        ],
        [(a, b, spring.stiffness, spring.damping, spring.length) for spring, a, b in tree.springs],
        [(stiffness, rest, q.start, v.start) for stiffness, rest, q, v in tree.sprung],
        tree.drive,
        tree.damping,
        run.rank,
        bool(settings.projection and run.rank),
        0.0 if adaptive else settings.dt or 0.0,
        settings.rtol or 0.0 if adaptive else 0.0,
        (constraints.constraints, pin.ProximalSettings(*constraints.proximal)) if constraints and tree.loops else None,
    )
