"""All variables of a run of a mechanism, from the motion of its bodies and the wrenches of its joints."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.columns import SMALLEST, UNCERTAIN, Columns, Variable, axes
from proofroll.core.errors import Diverged
from proofroll.core.whole_turns import doubt
from proofroll.elements.mechanism.dynamics.link_forces import put_links
from proofroll.elements.mechanism.dynamics.named_forces import lengths, named_forces, pick_named
from proofroll.elements.mechanism.dynamics.placed import TURN, Placed
from proofroll.elements.mechanism.run.contacts.local_frame import local_variables
from proofroll.elements.mechanism.run.contacts.observables import (
    LAWS,
    RESIDUALS,
    follow_contacts,
    given_forces,
    kept_laws,
    moments_along,
    normal_forces,
    residuals,
)
from proofroll.elements.mechanism.run.sampling import MechanismSample
from proofroll.elements.mechanism.scene.joint_kinds import TURNING
from proofroll.elements.mechanism.scene.shapes.geometry import carried_bodies, contact_sums, shared_pairs, turned_bodies

if TYPE_CHECKING:
    import xarray as xr

    from proofroll.elements.mechanism.run.element import MechanismElement

# Reasons why a variable has no value.
UNTURNED = np.array([[1.0, 0.0, 0.0, 0.0]])
_OF_ORIENTATION = ("q_WB", "attitude", "attitudes")
UNDETERMINED, UNSAID = "not determined by the equations", "not given by the engine"


def from_samples(element: MechanismElement, times: FloatArray, samples: Sequence[MechanismSample]) -> Columns:
    """Variables of a run, from one sample per time [s].

    Raises:
        Diverged: the orientation of bodies is missing, or a field has a wrong shape or type.
    """
    if lacking := element.lacks(samples, ()):
        raise Diverged(lacking)
    wrench = np.array([[reactions(element, s, name) for name in ("joint_force", "joint_torque")] for s in samples])
    placed = placed_from(element, times, samples)
    fields = {name: _over_time(samples, name, count) for name, count in lengths(element.mechanism).items()}
    named = pick_named(element.mechanism, fields).T
    whole = columns(element, placed, wrench, given_forces(element.mechanism, samples), named)
    return unturned(whole) if any(sample.q_WB is None for sample in samples) else whole


def quaternions(run: xr.Dataset) -> FloatArray:
    """Quaternions of the bodies, (time, bodies, 4); of a ball without its orientation those of no turn."""
    if "q_WB" in run:
        return np.asarray(run["q_WB"].to_numpy())
    return np.tile(UNTURNED, (run.sizes["time"], 1, 1))


def unturned(run: Columns) -> Columns:
    """The run of a ball without its orientation."""
    kept = {name: variable for name, variable in run.variables.items() if name not in _OF_ORIENTATION}
    return Columns(kept, run.attrs)


def placed_from(element: MechanismElement, times: FloatArray, samples: Sequence[MechanismSample]) -> Placed:
    """Motion of the bodies in samples at these times [s]; a ball without its orientation does not turn."""
    count = len(element.bodies)

    def stacked(name: str, width: int) -> FloatArray:
        return np.array([np.asarray(getattr(sample, name)).reshape(count, width) for sample in samples])

    return Placed(
        mechanism=element.mechanism,
        time=times,
        p_WB=stacked("p_WB", 3),
        v_WB=stacked("v_WB", 3),
        w_WB=stacked("w_WB", 3),
        q_WB=np.array([np.reshape(UNTURNED if s.q_WB is None else s.q_WB, (count, 4)) for s in samples]),
    )


def _over_time(samples: Sequence[MechanismSample], name: str, count: int) -> FloatArray:
    """The field :func:`along` coordinates of all samples, (time, count)."""
    if all(getattr(sample, name) is None for sample in samples):
        return np.full((len(samples), count), np.nan)
    return np.array([along(sample, name, count) for sample in samples])


def along(sample: MechanismSample, name: str, count: int) -> FloatArray:
    """Array of a sample's field with a force for each actuator, coupling or joint [N, N m]; NaN where it is None.

    Raises:
        Diverged: the field has another shape, or is not of numbers.
    """
    value = getattr(sample, name)
    if value is None:
        return np.full(count, np.nan)
    try:
        return np.asarray(value, dtype=np.float64).reshape(count)
    except (TypeError, ValueError):
        raise Diverged(f"the engine gave {name}, which is no array of {count} numbers") from None


def reactions(element: MechanismElement, sample: MechanismSample, name: str) -> FloatArray:
    """``joint_force`` [N] or ``joint_torque`` [N m] of a sample, shape (joints + loops, 3); NaN where it is None.

    Raises:
        Diverged: the field is not of numbers, or has neither this shape nor its flat form, (3 (joints + loops),).
    """
    shape, value = (len(element.mechanism.connections), 3), getattr(sample, name)
    if value is None:
        return np.full(shape, np.nan)
    try:
        values = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise Diverged(f"the engine gave {name}, which is no array of numbers") from None
    if values.shape not in {shape, (3 * shape[0],)}:
        raise Diverged(f"the engine gave {name} with shape {values.shape} instead of {shape}")
    return values.reshape(shape)


def columns(
    element: MechanismElement,
    placed: Placed,
    wrench: FloatArray,
    pressed: FloatArray,
    named: FloatArray,
    sums: FloatArray | None = None,
    unsaid: str = UNSAID,
    work: FloatArray | None = None,
) -> Columns:
    """Variables of a run, from the motion of the bodies and the forces and moments on them.

    ``wrench``: of joints and loops, shape (time, 2, joints + loops, 3); ``pressed``: of contacts on their first bodies,
    (time, contacts, 3), or if known with moments against turning [N m] and normal forces [N], (time, contacts, 7);
    ``sums``: of forces of contacts by :func:`.contact_sums`, then their moments by :func:`.moments_along`,
    (time, sums, 3), by default from ``pressed``; ``unsaid``: reason of what is NaN at the last time;
    ``work``: of drives [J], (time, drives), by default summed over the samples;
    ``named``: see :func:`~proofroll.elements.mechanism.dynamics.named_forces.named_forces`, (time, forces).
    Variables: ``p_WB`` [m], ``v_WB`` [m/s], ``w_WB`` [rad/s] over (time, body, xyz), ``q_WB`` over (time, body, wxyz);
    ``positions`` [m] of the tracked points; ``q.<joint>``, ``v.<joint>`` of joints with one coordinate;
    ``<point>.x|y|z`` [m]; ``force.<joint>.x|y|z`` [N] and ``torque.<joint>.x|y|z`` [N m] on the child, at the joint, in
    world axes, NaN with a reason in the attribute ``absent``; ``forces``, ``torques``: the
    determinate components of all; ``effort.<actuator>``, ``coupling.<name>``, ``friction.<joint>``, ``stop.<joint>``
    [N, N m] along coordinates; ``force.<spring>`` [N], ``force.<bushing>.x|y|z``, ``torque.<bushing>.x|y|z`` on its
    body_b, ``work.effort.<actuator>``, ``work.drive.<joint>`` [J]; ``force.<pair>.x|y|z`` [N] on the body of its first
    geometry, the sum where a pair touches at several places, ``torque.<pair>.x|y|z`` [N m], the moment of rolling
    resistance and of friction against spin on that body, where it is known, ``net_force.<body>.x|y|z`` [N], the sum of
    the contacts of a body that touches in several pairs, ``net_torque.<body>.x|y|z`` [N m], the moment about its centre
    of mass of the contacts of a body that touches at several places, ``gap.<pair>`` [m], ``slip.<pair>`` [m/s], and
    residuals
    of Coulomb's law, see
    :data:`~proofroll.elements.mechanism.run.contacts.observables.RESIDUALS`; ``energy`` [J], ``drift`` [m], and
    ``energy_error`` [J], or ``energy_change`` [J] of what is driven or damped.
    """
    mechanism, determinate = element.mechanism, element.analysis.determinate
    placed = replace(placed, q_WB=_continuous(placed.q_WB, element.start.q_WB[0]))
    variables: dict[str, Variable] = {}

    def put(name: str, values: FloatArray, unit: str, meaning: str, *dims: str, **more: Any) -> None:
        attributes = {"units": unit, "long_name": meaning} | {key: value for key, value in more.items() if value}
        variables[name] = Variable(("time", *dims), values, attributes)

    put("p_WB", placed.p_WB, "m", "origin of each body's frame in the world", "body", "xyz")
    put("v_WB", placed.v_WB, "m/s", "velocity of that origin in the world", "body", "xyz")
    put("w_WB", placed.w_WB, "rad/s", "angular velocity in the world", "body", "xyz")
    put("q_WB", placed.q_WB, "1", "orientation, quaternion scalar first", "body", "wxyz")
    put("attitudes", placed.q_WB, "1", "quaternions of the bodies", "body", "wxyz")
    put("positions", placed.points, "m", "tracked points, or centres of mass", "point", "xyz")
    doubts = _doubts(placed, element.turn_interval)
    for name, (q, rate) in placed.coordinates().items():
        unit = mechanism.joints[mechanism.joint_index[name]].unit
        put(f"q.{name}", q, unit, f"coordinate of {name}", **doubts.get(name, {}))
        put(f"v.{name}", rate, f"{unit}/s", f"rate of {name}")
    for index, point in enumerate(mechanism.points):
        for axis, letter in enumerate("xyz"):
            put(f"{point.name}.{letter}", placed.points[:, index, axis], "m", f"{letter} of the point {point.name}")
    for part, (kind, unit) in enumerate((("force", "N"), ("torque", "N m"))):
        values, mask = wrench[:, part], determinate[:, 3 * part : 3 * part + 3]
        masked = np.where(mask, values, np.nan)
        for index, connection in enumerate(mechanism.connections):
            for axis, letter in enumerate("xyz"):
                meaning = f"{kind} on the child of {connection.name}"
                component = masked[:, index, axis]
                absent = "" if mask[index, axis] else UNDETERMINED
                absent = absent or (unsaid if np.isnan(component[-1]) else "")
                put(f"{kind}.{connection.name}.{letter}", component, unit, meaning, absent=absent)
        if np.any(mask):
            meaning = f"determinate components of the {kind}s on children"
            put(f"{kind}s", values[:, mask], unit, meaning, f"{kind}_component")
    if mechanism.contacts:
        _put_contacts(element, placed, pressed, sums, unsaid, put)
    for values, item in zip(named.T, named_forces(mechanism), strict=True):
        put(item.name, values, str(item.unit), item.meaning, absent=unsaid if np.isnan(values[-1]) else "")
    put_links(placed, named, put, unsaid, work)
    energy = placed.energy()
    wound = [doubts[joint.name][UNCERTAIN] for joint in mechanism.joints if joint.stiffness and joint.name in doubts]
    unsure = {UNCERTAIN: wound[0]} if wound else {}
    put("energy", energy, "J", "kinetic and potential energy", **unsure)
    # Where something drives or damps, no law keeps the energy: then it is no error.
    gained = "energy_error" if element.conservative else "energy_change"
    begun = placed if placed.time[0] <= 0.0 else element.start  # the first sample may be later than the start
    change = energy - begun.energy()[0]
    put(gained, change, "J", "energy now minus energy at the start", **unsure)
    kept = kept_laws(mechanism)
    if kept:
        momenta = zip(placed.momentum(), begun.momentum(), strict=True)
        changes = (np.maximum(change, 0.0), *(part - first[0] for part, first in momenta))
        for (name, unit, meaning), value in zip(LAWS, changes, strict=True):
            if name in kept:
                put(name, value, unit, meaning, *(("xyz",) if value.ndim > 1 else ()))
    put("drift", placed.drift(), "m", "how far joints and loops are open")
    variables |= _local(element, placed, pressed[..., :3])
    variables |= axes(placed.time) | {"body": Variable(("body",), np.array(element.bodies, dtype=str))}
    return Columns(variables, _smallest(variables))


def _smallest(variables: Mapping[str, Variable]) -> dict[str, float]:
    """Least normal force on a ball at the samples [N] but time 0, where several engines know none; {} without one."""
    values = variables["N"][1] if "N" in variables else np.zeros(0)
    return {f"{SMALLEST}N": float(np.min(values[1:] if len(values) > 1 else values))} if len(values) else {}


def _local(element: MechanismElement, placed: Placed, pressed: FloatArray) -> dict[str, Variable]:
    """Variables in the local frame of a wall, of an element that is described in it."""
    body = element.on_wall
    if body is None:
        return {}
    p, v, w, q = (values[:, body.index] for values in (placed.p_WB, placed.v_WB, placed.w_WB, placed.q_WB))
    force = body.sign * pressed[:, body.contact_index]
    forces = None if np.isnan(force[1:]).any() else force
    attitude = Variable(("time", "wxyz"), q, {"units": "1", "long_name": "quaternion of the ball"})
    return {"attitude": attitude} | local_variables(body, placed.time, p, v, w, forces, element.turn_interval)


def _put_contacts(
    element: MechanismElement,
    placed: Placed,
    borne: FloatArray,
    sums: FloatArray | None,
    unsaid: str,
    put: Callable[..., None],
) -> None:
    """Puts gaps, slips, forces and residuals of Coulomb's law, of each contact, pair and of all together.

    ``borne``: forces, moments and normal forces as in :func:`columns`.
    """
    followed, pressed, moments = follow_contacts(placed), borne[..., :3], borne[..., 3:6]
    contacts = placed.mechanism.contacts
    shared, carried, turned = shared_pairs(contacts), carried_bodies(contacts), turned_bodies(contacts)
    if sums is None:
        parts = [(row, np.flatnonzero(row)) for row in contact_sums(contacts)]
        summed = [np.einsum("k,tki->ti", row[of], pressed[:, of])[:, None] for row, of in parts]
        sums = np.concatenate([*summed, moments_along(placed, followed.place, pressed)], axis=1)
    of_carried, of_turned = np.split(sums[:, len(shared) :], [len(carried)], axis=1)
    for index, (name, numbers) in enumerate(shared.items()):
        for axis, letter in enumerate("xyz"):
            component = sums[:, index, axis]
            absent = unsaid if np.isnan(component[-1]) else ""
            meaning = f"sum of the forces of {name} on {placed.mechanism.contacts[numbers[0]].body_a}"
            put(f"force.{name}.{letter}", component, "N", meaning, absent=absent)
    if shared:
        meaning = "sums of the forces of pairs that touch at several places"
        put("pair_forces", sums[:, : len(shared)], "N", meaning, "pair", "xyz")
    for kind, unit, what, bodies, values in (
        ("force", "N", "sums of the contact forces on bodies that touch in several pairs", carried, of_carried),
        ("torque", "N m", "moments of the contact forces on bodies that touch at several places", turned, of_turned),
    ):
        if bodies:
            put(f"net_{kind}s", values, unit, what, "carried" if kind == "force" else "turned", "xyz")
        for body, net in zip(bodies, np.moveaxis(values, 1, 0), strict=True):
            for component, letter in zip(net.T, "xyz", strict=True):
                absent = unsaid if np.isnan(component[-1]) else ""
                meaning = f"{'sum' if kind == 'force' else 'moment'} of the contact forces on {body}"
                put(f"net_{kind}.{body}.{letter}", component, unit, meaning, absent=absent)
    for index, contact in enumerate(placed.mechanism.contacts):
        resists = contact.rolling_resistance or contact.spinning_friction
        of_contact = [("force", "N", "force", pressed)]
        of_contact += [("torque", "N m", "moment against turning", moments)] if resists and moments.size else []
        for kind, unit, what, values in of_contact:
            for component, letter in zip(values[:, index].T, "xyz", strict=True):
                absent = unsaid if np.isnan(component[-1]) else ""
                meaning = f"{what} of {contact.name} on {contact.body_a}"
                put(f"{kind}.{contact.name}.{letter}", component, unit, meaning, absent=absent)
        put(f"gap.{contact.name}", followed.gap[:, index], "m", f"distance of what {contact.name} may touch")
        put(f"slip.{contact.name}", followed.slip[:, index], "m/s", f"speed of slip of {contact.name}")
    put("gaps", followed.gap, "m", "distances between what may touch", "contact")
    put("slips", followed.slip, "m/s", "slip speeds of the contacts", "contact")
    put("normal_forces", normal_forces(followed, borne), "N", "normal forces between what may touch", "contact")
    put("contact_forces", pressed, "N", "forces between what may touch", "contact", "xyz")
    friction, static = (
        np.array([getattr(contact, name) for contact in placed.mechanism.contacts]) for name in ("friction", "static")
    )
    left = residuals(followed, borne, friction, element.force, element.speed, static)
    put("unpressed", left["unpressed"], "1", "share of samples so far without a normal force", "contact")
    for name, unit, meaning in RESIDUALS:
        put(name, left[name], unit, meaning, "contact")


def _doubts(placed: Placed, interval: float | None) -> dict[str, dict[str, Any]]:
    """Warnings, by joint, that angles may be off by whole turns; see :func:`proofroll.core.whole_turns.doubt`."""
    warnings: dict[str, dict[str, Any]] = {}
    if placed.known_q is not None:
        return warnings
    for joint in placed.mechanism.joints:
        if joint.kind in TURNING:
            for angle, rate in zip(*(values.T for values in placed.along(joint)), strict=True):
                if warning := doubt(placed.time, angle, rate, TURN, interval):
                    warnings[joint.name] = warning
    return warnings


def _continuous(q_WB: FloatArray, start: FloatArray) -> FloatArray:
    """Quaternions with signs chosen for continuity, the first nearest to the scene's start."""
    previous = np.concatenate([start[None], q_WB[:-1]])
    signs = np.where(np.sum(previous * q_WB, axis=-1, keepdims=True) < 0, -1.0, 1.0)
    return np.asarray(q_WB * np.cumprod(signs, axis=0))
