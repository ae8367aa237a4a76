"""Formulation ``joints``: a mechanism as an MjSpec of bodies, joints, equality constraints and tendons.

A body's frame stands at ``qpos = 0`` where it stands at q = 0. Universal and planar joints are two hinges, and two
slides and a hinge, of one body; a free joint on another body than the world is three slides and a ball. A loop is
closed by ``connect`` constraints of points (fixed: by a ``weld``). One point holds a spherical loop, and a revolute one
where the mechanism is planar; in space a revolute loop needs two points of its axis: with one, the bodies turn about
it freely, and no drift would reveal that.
"""

from typing import Any

import mujoco
import numpy as np

from proofroll.core.errors import Refused
from proofroll.elements.mechanism import WORLD, Body, Joint, Mechanism, Tree
from proofroll.elements.mechanism.dynamics.loop_points import held_points
from proofroll.elements.mechanism.run.certificate import COMPOSED
from proofroll.elements.mechanism.scene.drives import Actuator, Coupling
from proofroll.elements.mechanism.scene.joint_kinds import DISTANCE, WITH_QUATERNION, JointKind
from proofroll.elements.mechanism.scene.rotations import to_quaternion
from proofroll.elements.mechanism.scene.signal import varies
from proofroll.engines.mujoco.contact.mechanism_contacts import write_contacts
from proofroll.engines.mujoco.settings import MujocoSettings
from proofroll.engines.mujoco.smooth.applied_loads import springs_of_balls

_HINGE, _SLIDE = mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE
_BALL, _FREE = mujoco.mjtJoint.mjJNT_BALL, mujoco.mjtJoint.mjJNT_FREE
# MuJoCo's joints that make up one of ours, in order, each with the column of the joint's frame that is its axis.
PARTS: dict[str, tuple[tuple[Any, int], ...]] = {
    JointKind.FIXED: (),
    JointKind.REVOLUTE: ((_HINGE, 2),),
    JointKind.PRISMATIC: ((_SLIDE, 2),),
    JointKind.CYLINDRICAL: ((_SLIDE, 2), (_HINGE, 2)),
    JointKind.UNIVERSAL: ((_HINGE, 2), (_HINGE, 0)),
    JointKind.SPHERICAL: ((_BALL, 2),),
    JointKind.PLANAR: ((_SLIDE, 0), (_SLIDE, 1), (_HINGE, 2)),
    JointKind.FREE: ((_SLIDE, 0), (_SLIDE, 1), (_SLIDE, 2), (_BALL, 2)),
}


def parts_of(joint: Joint) -> tuple[tuple[Any, int], ...]:
    """MuJoCo's joints that make up a joint."""
    return ((_FREE, 2),) if joint.kind == JointKind.FREE and joint.parent == WORLD else PARTS[joint.kind]


def part_names(joint: Joint) -> list[str]:
    """Names of MuJoCo's joints that make up a joint: its own, or with .0, .1 … where there are several."""
    count = len(parts_of(joint))
    return [joint.name] if count == 1 else [f"{joint.name}.{part}" for part in range(count)]


# s; MuJoCo lifts a shorter time constant to two steps.
_SHORTEST = 1e-9


def set_integration(option: Any, settings: MujocoSettings) -> None:
    """Sets step and integrator in the options of an MjSpec."""
    option.timestep = settings.dt
    option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{settings.integrator.upper()}")
    if settings.damping_armature or not settings.eulerdamp:
        option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_EULERDAMP)


def write(mechanism: Mechanism, settings: MujocoSettings) -> Any:
    """MjSpec of a mechanism; joints are named by :func:`part_names`, joint k has a site ``k`` and two sensors.

    Raises:
        Refused: MuJoCo's least mass or inertia of a moving body is not small beside those of the mechanism.
    """
    _require_heavy(mechanism)
    spec = mujoco.MjSpec()
    spec.compiler.degree = False  # or springs of hinges would have their rest in degrees
    option = spec.option
    option.gravity = mechanism.gravity
    set_integration(option, settings)
    settings.set_solver(option, contacts=bool(mechanism.contacts))
    # Without autoreset, a state that is not finite stays as it is instead of starting anew at time 0.
    option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    if not mechanism.contacts:
        option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    bodies, added = {WORLD: spec.worldbody}, damping_armatures(mechanism, settings)
    springs = springs_of_balls(mechanism)
    data = {body.name: body for body in mechanism.bodies}
    for number, joint in enumerate(mechanism.joints):
        bodies[joint.child] = _add_body(spec, bodies[joint.parent], number, joint, data[joint.child], settings)
        bushing = springs.get(joint.name)
        if bushing is not None:
            _set_law(spec.joint(part_names(joint)[0]), bushing.stiffness[3], joint.damping)
        for name in part_names(joint) if joint.name in added else ():
            spec.joint(name).armature += added[joint.name]
    for number, loop in enumerate(mechanism.loops):
        add = _add_strut if loop.kind == DISTANCE else _add_loop
        add(spec, bodies, number, mechanism, settings)
    for number, spring in enumerate(mechanism.springs):
        tendon = spec.add_tendon(name=f"spring{number}")
        for end, body, position in (("a", spring.body_a, spring.position_a), ("b", spring.body_b, spring.position_b)):
            bodies[body].add_site(name=f"spring{number}{end}", pos=position)
            tendon.wrap_site(f"spring{number}{end}")
        _set_law(tendon, spring.stiffness, spring.damping)
        tendon.springlength = [spring.length, spring.length]
    for actuator in mechanism.actuators:
        _add_actuator(spec, actuator)
    for coupling in mechanism.couplings:
        settings.soften(_add_coupling(spec, coupling))
    for joint, _, _ in mechanism.prescribed:
        moves = spec.add_equality(
            name=motion_name(joint), type=mujoco.mjtEq.mjEQ_JOINT, objtype=mujoco.mjtObj.mjOBJ_JOINT
        )
        moves.name1, moves.data[:5] = joint.name, (joint.q0[0], 0.0, 0.0, 0.0, 0.0)
        settings.soften(moves)
    if mechanism.contacts:
        write_contacts(spec, bodies, mechanism, settings)
    return spec


def damping_armatures(mechanism: Mechanism, settings: MujocoSettings) -> dict[str, float]:
    """Joint -> armature that stands for its implicit damping, h (c + n² kd) [kg m² or kg]; empty: there is none.

    A servo with a limit has none: while it is clamped, its damping acts on nothing.
    """
    if not settings.damping_armature:
        return {}
    damping = {joint.name: joint.damping for joint in mechanism.joints}
    for actuator in mechanism.actuators:
        damping[actuator.joint] += actuator.gear**2 * actuator.kd if actuator.limit is None else 0.0
    return {name: settings.dt * value for name, value in damping.items() if value}


def _add_coupling(spec: Any, coupling: Coupling) -> Any:
    """An equality of two joints, or of more joints through a fixed tendon whose length is held."""
    name = coupling_name(coupling)
    if len(coupling.terms) == 2:
        (joint, _), (leader, factor) = coupling.terms
        added = spec.add_equality(name=name, type=mujoco.mjtEq.mjEQ_JOINT, objtype=mujoco.mjtObj.mjOBJ_JOINT)
        added.name1, added.name2 = joint, leader
        added.data[:2] = coupling.place, -factor
        return added
    tendon = spec.add_tendon(name=name)
    for joint, factor in coupling.terms:
        tendon.wrap_joint(joint, factor)
    added = spec.add_equality(name=name, type=mujoco.mjtEq.mjEQ_TENDON, objtype=mujoco.mjtObj.mjOBJ_TENDON)
    added.name1 = name
    added.data[0] = coupling.place
    return added


def _require_heavy(mechanism: Mechanism) -> None:
    """Raises Refused, naming a body, if MuJoCo's least mass or inertia would change the mechanism."""
    moving = {joint.child for joint in mechanism.joints if joint.nv}
    largest_mass = max((body.mass for body in mechanism.bodies), default=0.0)
    largest = max((float(np.abs(body.inertia).max()) for body in mechanism.bodies), default=0.0)
    for body in mechanism.bodies if largest else ():
        inertia = float(np.linalg.eigvalsh(body.inertia)[0])
        for least, size, unit in ((body.mass, largest_mass, "kg"), (inertia, largest, "kg m^2")):
            part = (mujoco.mjMINVAL - least) / size
            if body.name in moving and part > COMPOSED:
                raise Refused(
                    f"MuJoCo gives a moving body at least {mujoco.mjMINVAL:g} {unit}; {body.name} has "
                    f"{max(least, 0.0):.3g}, and the difference is {part:.1g} of the largest here; write the scene in "
                    "smaller units (g, mm), which changes no motion"
                )


def _add_body(spec: Any, parent: Any, number: int, joint: Joint, body: Body, settings: MujocoSettings) -> Any:
    turned = joint.parent_frame @ joint.child_frame.T
    place = np.array(joint.position) - turned @ joint.child_position
    added = parent.add_body(name=body.name, pos=place, quat=to_quaternion(turned))
    added.explicitinertial = True
    moments, axes = np.linalg.eigh(body.inertia)
    axes[:, 2] *= np.sign(np.linalg.det(axes))
    if np.count_nonzero(body.inertia) == np.count_nonzero(np.diag(body.inertia)):
        moments, axes = np.diag(body.inertia), np.eye(3)
    # MuJoCo refuses a moving body of less mass or inertia, even if its children have enough: theirs outweighs this.
    least = mujoco.mjMINVAL if joint.nv else 0.0
    added.mass, added.inertia = max(body.mass, least), np.maximum(moments, least)
    added.ipos, added.iquat = body.com, to_quaternion(axes)
    for name, (kind, column) in zip(part_names(joint), parts_of(joint), strict=True):
        part = added.add_joint(name=name, type=kind, pos=joint.child_position, axis=joint.child_frame[:, column])
        _set_law(part, joint.stiffness, joint.damping)
        part.springref = joint.rest
        part.frictionloss, part.armature = joint.friction, joint.armature
        _set_switches(part, joint, settings)
    added.add_site(name=f"{number}", pos=joint.child_position)
    for kind in ("FORCE", "TORQUE"):
        spec.add_sensor(
            name=f"{kind}{number}",
            type=getattr(mujoco.mjtSensor, f"mjSENS_{kind}"),
            objtype=mujoco.mjtObj.mjOBJ_SITE,
            objname=f"{number}",
        )
    return added


def coupling_name(coupling: Coupling) -> str:
    """Name of a coupling's equality constraint."""
    return f"coupling.{coupling.name}"


def motion_name(joint: Joint) -> str:
    """Name of the equality constraint that moves a joint."""
    return f"motion.{joint.name}"


def _add_actuator(spec: Any, actuator: Actuator) -> None:
    """MuJoCo's motor, velocity or position actuator; its limits are those of the motor, before the gear."""
    added = spec.add_actuator(name=actuator.name, trntype=mujoco.mjtTrn.mjTRN_JOINT, target=actuator.joint)
    added.gear[0] = actuator.gear
    added.gaintype, added.gainprm[0] = mujoco.mjtGain.mjGAIN_FIXED, 1.0
    if actuator.kind != "torque":
        added.biastype = mujoco.mjtBias.mjBIAS_AFFINE
        added.gainprm[0] = actuator.kp if actuator.kind == "position" else actuator.kd
        added.biasprm[:3] = 0.0, -actuator.kp, -actuator.kd
    if actuator.limit is not None:
        most = actuator.limit / abs(actuator.gear)
        added.forcelimited, added.forcerange = True, (-most, most)


def add_constant_drives(spec: Any, mechanism: Mechanism) -> int:
    """Number of actuators that are added, one for each constant drive of a joint; they need no control."""
    driven = [joint for joint in mechanism.joints if joint.torque and not varies(joint.torque)]
    for joint in driven:
        added = spec.add_actuator(
            name=f"drive.{joint.name}", trntype=mujoco.mjtTrn.mjTRN_JOINT, target=part_names(joint)[0]
        )
        added.gaintype, added.gainprm[0] = mujoco.mjtGain.mjGAIN_FIXED, 0.0
        added.biastype, added.biasprm[0] = mujoco.mjtBias.mjBIAS_AFFINE, joint.torque
    return len(driven)


def _set_switches(part: Any, joint: Joint, settings: MujocoSettings) -> None:
    """Sets the stops of a joint, and the softness of stops and of dry friction.

    The row of dry friction has the reference acceleration -B v, B = 2/(dmax time constant). A joint slower than its
    free acceleration over B is pushed along its motion. The shortest time constant makes B the inverse of the step.
    """
    if joint.limits is not None:
        part.limited, part.range = True, joint.limits
        if settings.time_constant is not None:
            part.solref_limit = (settings.contact_time, 1.0)
    if settings.time_constant is not None:
        part.solref_friction = (_SHORTEST, 1.0)
    if settings.impedance is not None:
        part.solimp_limit = part.solimp_friction = settings.solimp


def _set_law(item: Any, stiffness: float, damping: float) -> None:
    """Sets linear stiffness and damping: one number in MuJoCo 3.5, later the first coefficient of a polynomial."""
    for name, value in (("stiffness", stiffness), ("damping", damping)):
        if np.ndim(getattr(item, name)):
            getattr(item, name)[0] = value
        else:
            setattr(item, name, value)


def _add_strut(spec: Any, bodies: dict[str, Any], number: int, mechanism: Mechanism, settings: MujocoSettings) -> None:
    """A tendon between two sites whose length is held; MuJoCo holds it relative to that at qpos = 0."""
    loop, name = mechanism.loops[number], f"loop{number}"
    tendon = spec.add_tendon(name=name)
    for end, body, position in (("a0", loop.body_a, loop.position_a), ("b0", loop.body_b, loop.position_b)):
        bodies[body].add_site(name=f"{name}{end}", pos=position)
        tendon.wrap_site(f"{name}{end}")
    added = spec.add_equality(name=f"{name}.0", type=mujoco.mjtEq.mjEQ_TENDON, objtype=mujoco.mjtObj.mjOBJ_TENDON)
    added.name1 = name
    tree, q = Tree(mechanism), np.zeros(mechanism.nq)
    for joint, place in zip(mechanism.joints, mechanism.q_slices, strict=True):
        if joint.kind in WITH_QUATERNION:
            q[place.stop - 4] = 1.0
    motion = tree.at(q, np.zeros(mechanism.nv))
    a, b = (
        tree.point(motion, body, np.array(position))[0]
        for body, position in ((loop.body_a, loop.position_a), (loop.body_b, loop.position_b))
    )
    added.data[0] = loop.length - float(np.linalg.norm(b - a))
    settings.soften(added)


def _add_loop(spec: Any, bodies: dict[str, Any], number: int, mechanism: Mechanism, settings: MujocoSettings) -> None:
    loop = mechanism.loops[number]
    kind = mujoco.mjtEq.mjEQ_WELD if loop.kind == JointKind.FIXED else mujoco.mjtEq.mjEQ_CONNECT
    for point, place in enumerate(held_points(mechanism, loop)):
        names = [f"loop{number}{end}{point}" for end in "ab"]
        ends = ((loop.body_a, loop.position_a, loop.frame_a), (loop.body_b, loop.position_b, loop.frame_b))
        for name, (body, position, frame) in zip(names, ends, strict=True):
            bodies[body].add_site(name=name, pos=position + place * frame[:, 2], quat=to_quaternion(frame))
        added = spec.add_equality(name=f"loop{number}.{point}", type=kind, objtype=mujoco.mjtObj.mjOBJ_SITE)
        added.name1, added.name2 = names
        settings.soften(added)
