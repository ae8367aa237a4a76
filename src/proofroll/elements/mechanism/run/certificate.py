"""Certificate of a mechanism, line by line."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.arrays import FloatArray, longest
from proofroll.core.certificate import ROUNDINGS, Line, require_shapes, tolerated
from proofroll.core.engine import EPSILON, Regularised
from proofroll.core.errors import Refused
from proofroll.elements.mechanism.contact.start import TOUCHING, touches
from proofroll.elements.mechanism.contact.tree_contacts import ContactDynamics
from proofroll.elements.mechanism.dynamics.matrices import matrices_of
from proofroll.elements.mechanism.dynamics.named_forces import lengths, named_forces
from proofroll.elements.mechanism.run.dataset import along, reactions
from proofroll.elements.mechanism.run.sampling import MechanismBuilt, MechanismSample
from proofroll.elements.mechanism.scene.joint import Joint
from proofroll.elements.mechanism.scene.joint_kinds import WITH_AXIS

if TYPE_CHECKING:
    from proofroll.elements.mechanism.run.element import MechanismElement

# Engines compose poses and inertias of chains of bodies by themselves; each product costs a few machine epsilons.
COMPOSED = 1e-9
# Least scale of efforts and forces of couplings, relative to the natural one.
_FAINT = 1e-3
# Least scale of differences of angular acceleration, relative to the natural one: a pose may have no acceleration.
_LEAST = 1e-2
_COMPOSED = "composed along the tree by the engine's own arithmetic"
# Three evaluations sample the noise without bounding it, and the engine's own is as large.
_MARGIN = 10.0
_NOISY = "round-off of the scene's own accelerations, which many bodies in a row magnify"
_FORCES = ("forces", "torques", "couplings", "drives", "forces of contact")
FROM_ACCELERATIONS = ("acceleration", "angular acceleration", *_FORCES)
# Quantities that a model may soften -> largest relative difference that is accepted for any reason, and why.
CAPS: Mapping[str, Regularised] = {
    # with a tolerance of 1, a mechanism that does not set off at all would pass
    name: Regularised(0.5, "a loop that is held by a stiff spring pulls in proportion to its opening")
    for name in FROM_ACCELERATIONS
}
# Quantities with a tolerance of their own, and why.
_ROUGH = {"inverse friction": (0.02, "no engine's cone is unbounded; a coefficient of 50 or more stands for it")}
_KNOWN = ("mass", "centre of mass", "inertia", "gravity")  # None says that they are not known; NaN is a wrong number
# Accepted shapes: -1 is any number, for bodies or joints may be missing; of one body the index may be left out.
_SHAPES = {
    "mass": ((-1,), ()),
    **dict.fromkeys(("com", "acceleration", "angular_acceleration", "joint_position", "joint_axis"), ((-1, 3), (3,))),
    "inertia": ((-1, 3, 3), (3, 3)),
    "gravity": ((3,), (1, 3)),
    **dict.fromkeys(("contact_gap", "contact_friction", "contact_restitution"), ((-1,), ())),
    **dict.fromkeys(("contact_static", "contact_tangential", "contact_rolling"), ((-1,), ())),
    **dict.fromkeys(("contact_normal", "contact_place"), ((-1, 3), (3,))),
    "contact_response": ((-1, 3, -1, 3),),
    **dict.fromkeys(("rows", "rank", "mobility", "mass_matrix_error"), ((), (1,))),
}
# Quantity, unit, expected and given values, scale of their difference.
_Compare = Callable[[str, str, Any, Any, float], None]


def _require_readable(built: MechanismBuilt, nv: int) -> None:
    """Raises Diverged, naming the field, if a field has another shape or type than the protocol requires."""
    of_velocities = dict.fromkeys(("velocity_forces", "gravity_forces"), ((nv,),))
    require_shapes(built, {**_SHAPES, "mass_matrix": ((nv, nv),), **of_velocities})


def certify(element: MechanismElement, built: MechanismBuilt, sample: MechanismSample) -> list[Line]:
    """Lines that compare what was built, and the sample at time 0, with the mechanism; a missing value has one too."""
    _require_readable(built, element.mechanism.nv)
    mechanism, start, motion = element.mechanism, element.start, element.first_motion
    lines: list[Line] = []

    def compare(quantity: str, unit: str, expected: Any, reported: Any, scale: float) -> None:
        want = np.asarray(expected, dtype=np.float64)
        if want.size and np.all(np.isnan(want)):
            return  # nothing is known: a line would pass without any comparison
        if reported is None or (quantity not in _KNOWN and np.all(np.isnan(reported))):
            lines.append(
                Line(
                    quantity=quantity,
                    unit=unit,
                    expected=tuple(np.ravel(want).tolist()),
                    found=(),
                    difference=None,
                    tolerance=COMPOSED,
                )
            )
            return
        got = np.asarray(reported, dtype=np.float64)
        if len(mechanism.bodies) == 1 and got.size == want.size:
            got = got.reshape(want.shape)  # of one body the index may be left out
        difference = _apart(want, got, partly=quantity not in _KNOWN) / scale
        soft = built.regularised.get(quantity.replace(" ", "_"))
        if soft is None and quantity in _FORCES:  # as soft as what they accelerate
            soft = max(built.regularised.values(), key=lambda softness: softness.tolerance, default=None)
        tolerance, because = tolerated(soft, element.caps.get(quantity), *_ROUGH.get(quantity, (COMPOSED, _COMPOSED)))
        unit_scale = scale if "acceleration" in quantity else motion.scale
        noise = _MARGIN * element.noise / unit_scale if quantity in FROM_ACCELERATIONS else 0.0
        tolerance, because = max((tolerance, because), (noise, _NOISY))
        roundings = max(ROUNDINGS, noise / EPSILON["double"])
        expected, numbers = tuple(np.ravel(want).tolist()), tuple(np.ravel(got).tolist())
        lines.append(
            Line(
                quantity=quantity,
                unit=unit,
                expected=expected,
                found=numbers,
                difference=difference,
                tolerance=tolerance,
                because=because,
                roundings=roundings,
            )
        )

    size, gravity = element.length, np.array(mechanism.gravity)
    masses, coms, inertias = (
        np.array([getattr(body, name) for body in mechanism.bodies]) for name in ("mass", "com", "inertia")
    )
    compare("mass", "kg", masses, built.mass, float(np.max(masses)))
    compare("centre of mass", "m", coms, built.com, size)
    compare("inertia", "kg m^2", inertias, built.inertia, float(np.max(np.abs(inertias))) or 1.0)
    compare("gravity", "m/s^2", gravity, built.gravity, float(np.linalg.norm(gravity)) or 1.0)
    places = np.array([start.point(joint.child, joint.child_position)[0] for joint in mechanism.joints])
    axes = np.array([_axis(element, joint) for joint in mechanism.joints])
    if len(mechanism.joints):
        compare("joint positions", "m", places, built.joint_position, size)
        compare("joint axes", "1", axes, built.joint_axis, 1.0)
    _compare_contacts(element, built, compare)
    compare("mobility", "1", element.analysis.mobility, built.mobility, 1.0)
    compare("error of the mass matrix", "1", 0.0, built.mass_matrix_error, 1.0)
    compare("position", "m", start.p_WB[0], sample.p_WB, size)
    compare("velocity", "m/s", start.v_WB[0], sample.v_WB, element.speed)
    compare("spin", "rad/s", start.w_WB[0], sample.w_WB, element.speed / size)
    if sample.q_WB is not None:
        turned = np.reshape(sample.q_WB, start.q_WB[0].shape)
        signs = np.sign(np.sum(turned * start.q_WB[0], axis=-1, keepdims=True))
        compare("orientation", "1", start.q_WB[0], turned * signs, 1.0)
    compare("acceleration", "m/s^2", motion.acceleration, _first(element, built, "acceleration"), motion.scale)
    turning = _turning(element, soft="angular_acceleration" in built.regularised)
    rates = motion.angular_acceleration, _first(element, built, "angular_acceleration")
    compare("angular acceleration", "rad/s^2", *rates, turning)
    _compare_reactions(element, built, sample, compare)
    return lines


def _apart(want: FloatArray, got: FloatArray, *, partly: bool) -> float:
    """Largest difference; infinite for another shape, and for NaN unless values may be ``partly`` known."""
    if got.shape != want.shape or not got.size or not (partly or np.isfinite(got).all()):
        return float("inf")
    return float(np.nanmax(np.abs(got - want), initial=0.0))


def _compare_matrices(element: MechanismElement, built: MechanismBuilt, compare: _Compare) -> None:
    """Compares the matrices of the equations of motion that the engine gives."""
    true = matrices_of(element.mechanism)
    sizes = [float(np.max(np.abs(part), initial=0.0)) for part in true]
    natural = element.mechanism.mass * element.first_motion.scale * element.length
    for name, part, size in zip(true._fields, true, sizes, strict=True):
        if (reported := getattr(built, name)) is not None:
            scale = size if name == "mass_matrix" else max(*sizes[1:], _LEAST * natural)
            compare(name.replace("_", " "), "1", part, reported, scale or 1.0)


def _first(element: MechanismElement, built: MechanismBuilt, name: str) -> FloatArray | None:
    """First acceleration that the engine gives; None if contacts are too soft for a first step to show the model."""
    return None if _too_soft(element, built, name) else getattr(built, name)


def _too_soft(element: MechanismElement, built: MechanismBuilt, *names: str) -> bool:
    """True if contacts are too soft for a first step to show the model, by these accelerations or by any of all."""
    softened = [built.regularised.get(name) for name in names or ("acceleration", "angular_acceleration")]
    most = max((soft.tolerance for soft in softened if soft is not None), default=0.0)
    return bool(element.mechanism.contacts) and most > CAPS["acceleration"].tolerance


def _compare_contacts(element: MechanismElement, built: MechanismBuilt, compare: _Compare) -> None:
    """Compares gaps, normals, places and coefficients of contacts."""
    contacts = element.mechanism.contacts
    if not contacts:
        return
    touching = touches(element.mechanism, element._solution.motion)
    compare("gaps", "m", [touch.gap for touch in touching], built.contact_gap, element.length)
    compare("normals of contact", "1", [touch.normal for touch in touching], built.contact_normal, 1.0)
    # of a disc that lies parallel to its plane every point of the edge is as near
    places = [np.full(3, np.nan) if touch.flat else touch.place for touch in touching]
    compare("places of contact", "m", places, built.contact_place, element.length)
    friction = np.array([contact.friction for contact in contacts])
    unbounded, reported = np.isinf(friction), built.contact_friction
    if reported is not None and np.size(reported) == len(friction):
        reported = np.reshape(reported, len(friction))
        with np.errstate(divide="ignore"):
            large = np.where(unbounded, 1 / np.asarray(reported, dtype=np.float64), 0.0)
        if unbounded.any():
            compare("inverse friction", "1", np.where(unbounded, 0.0, np.nan), large, 1.0)
        reported = np.where(unbounded, np.nan, reported)
    friction[unbounded] = np.nan
    compare("friction of contacts", "1", friction, reported, float(np.nanmax(friction, initial=0.0)) or 1.0)
    restitution = [contact.restitution for contact in contacts]
    compare("restitution of contacts", "1", restitution, built.contact_restitution, max(restitution) or 1.0)
    static = np.array([contact.static_friction or np.nan for contact in contacts])
    if not np.isnan(static).all():
        compare("static friction of contacts", "1", static, built.contact_static, float(np.nanmax(static)))
    sideways = np.array([contact.tangential_restitution for contact in contacts])
    if sideways.any():
        compare("tangential restitution of contacts", "1", sideways, built.contact_tangential, 1.0)
    levers = np.array([contact.rolling_resistance for contact in contacts])
    if levers.any():
        compare("rolling resistance", "m", levers, built.contact_rolling, float(levers.max()))
    _compare_response(element, built, compare)


def _compare_response(element: MechanismElement, built: MechanismBuilt, compare: _Compare) -> None:
    """Compares the Delassus matrix of closed contacts, along the directions in which the pairs have forces."""
    mechanism = element.mechanism
    try:
        dynamics = ContactDynamics(mechanism)
    except Refused:  # our equations refuse dry friction along several coordinates; an engine may have it
        return
    state = dynamics.at(*mechanism.start())
    near = TOUCHING * element.length  # a disc that lies flat has no one place, which its response depends on
    touching = state.touching[: len(mechanism.contacts)]
    # an absent contact, as of edges that are parallel, carries nothing however near it is
    shut = [k for k, touch in enumerate(touching) if touch.gap <= near and not touch.flat and not touch.absent]
    if not shut:
        return
    normals = [np.outer(state.touching[k].normal, state.touching[k].normal) for k in shut]
    directions = np.array(
        [np.eye(3) if mechanism.contacts[k].friction else nn for k, nn in zip(shut, normals, strict=True)]
    )
    J = directions @ state.J[shut]
    expected, reported = np.einsum("kin,nm,ljm->kilj", J, state.W, J), built.contact_response
    if reported is not None and np.shape(reported)[0] == np.shape(reported)[2] == len(mechanism.contacts):
        reported = np.einsum(
            "kai,kilj,lbj->kalb", directions, reported[np.ix_(shut, range(3), shut, range(3))], directions
        )
    compare("responses of contacts", "1/kg", expected, reported, float(np.abs(expected).max()))


def _compare_press(
    element: MechanismElement, built: MechanismBuilt, sample: MechanismSample, compare: _Compare
) -> None:
    """Compares first contact forces where they are determinate; those of a very soft model count as not given."""
    if not element.mechanism.contacts:
        return
    true, reported = element.first_press, sample.contact_force
    if reported is not None:
        reported = None if _too_soft(element, built) else np.reshape(reported, true.shape)
    natural = element.mechanism.mass * element.first_motion.scale
    largest = float(np.nanmax(np.abs(true), initial=0.0))
    # forces that are determinate may all be none but for round-off, as across the slide of a box on four corners
    compare("forces of contact", "N", true, reported, largest if largest > _LEAST * natural else natural)


def _compare_reactions(
    element: MechanismElement, built: MechanismBuilt, sample: MechanismSample, compare: _Compare
) -> None:
    """Compares matrices, named forces, and determinate forces and moments of joints if the model gives them."""
    _compare_matrices(element, built, compare)
    _compare_press(element, built, sample, compare)
    withheld = built.acceleration is None and "acceleration" in built.regularised
    # forces that depend on those of contacts count as not given where first accelerations do
    if _too_soft(element, built) or (element.mechanism.contacts and withheld):
        sample = replace(sample, joint_force=None, joint_torque=None, coupling=None, drive=None)
    _compare_named(element, sample, compare)
    if sample.joint_force is None or sample.joint_torque is None:
        return
    first_motion = element.first_motion
    wrench = np.where(element.analysis.determinate, element.first_wrench, np.nan)
    natural = element.mechanism.mass * first_motion.scale
    force = max(float(np.nanmax(np.abs(wrench[:, :3]), initial=0.0)), natural)
    torque = max(float(np.nanmax(np.abs(wrench[:, 3:]), initial=0.0)), force * element.length)
    compare("forces", "N", wrench[:, :3], reactions(element, sample, "joint_force"), force)
    compare("torques", "N m", wrench[:, 3:], reactions(element, sample, "joint_torque"), torque)


def _compare_named(element: MechanismElement, sample: MechanismSample, compare: _Compare) -> None:
    """Compares efforts of actuators, forces of couplings, and forces that impose motions."""
    names, natural = named_forces(element.mechanism), element.first_motion.scale * element.length
    natural *= element.mechanism.mass
    counts, numbers = lengths(element.mechanism), np.array([item.number for item in names], dtype=int)
    for key, quantity in (("effort", "efforts"), ("coupling", "couplings"), ("drive", "drives")):
        mine = np.array([item.field == key for item in names], dtype=bool)
        if mine.any():
            expected = element.first_named[mine]
            reported = None if getattr(sample, key) is None else along(sample, key, counts[key])[numbers[mine]]
            # a servo that starts at its target has an effort of round-off; what imposes a motion is a reaction
            least = natural if key == "drive" else _FAINT * natural
            compare(
                quantity, "N or N m", expected, reported, max(float(np.nanmax(np.abs(expected), initial=0.0)), least)
            )


def _turning(element: MechanismElement, soft: bool) -> float:
    """Scale of angular accelerations [rad/s²]: the largest, at least a part of the natural one (all, if soft)."""
    first_motion = element.first_motion
    least = (1.0 if soft else _LEAST) * first_motion.scale / element.length
    return max(longest(np.nan_to_num(first_motion.angular_acceleration)), least)


def _axis(element: MechanismElement, joint: Joint) -> FloatArray:
    """Axis of a joint in the world at the start; NaN where the joint has none."""
    if joint.kind not in WITH_AXIS:
        return np.full(3, np.nan)
    parent = element.mechanism.body_index[joint.parent]
    return np.asarray(element.start.R_WB[0, parent] @ joint.parent_frame[:, 2])
