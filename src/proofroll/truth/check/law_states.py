"""Record of each route at one state, in numbers, for the law check: poses and forces as they act."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.joint_laws import mode_of_joints
from proofroll.elements.mechanism.contact.modes import ContactMode, features_of
from proofroll.elements.mechanism.contact.touching import Touching
from proofroll.elements.mechanism.dynamics.named_forces import named_forces
from proofroll.elements.mechanism.scene.rotations import Array, from_quaternion
from proofroll.truth.bodies.contact_bodies import ContactBodies
from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates
from proofroll.truth.switching.contact_guards import Touchable, borne_forces
from proofroll.truth.tree.contact_tree import ContactTree

_FIELDS = "effort", "drive", "coupling"  # named forces of a record, in its order


def by_the_tree(route: ContactTree, state: Array, mode: ContactMode) -> Array:
    """Record of the first route at a state, in natural units; for its order see :class:`LawRecorder`."""
    dynamics = route.dynamics
    m, contacts = dynamics.mechanism, dynamics.contacts
    q, v, time = dynamics.parts(state)
    q = dynamics.equations.tree.normalised(q)
    solution = dynamics.solve(q, v, mode, time)
    motion, named, loops = solution.state.solution.motion, np.zeros(0), np.zeros(0)
    forces = borne_forces(contacts, solution.state.touching, solution)
    if _has_named(m):
        joints = mode_of_joints(dynamics.equations.switched, contacts, mode)
        sample = dynamics.equations.sample(q, v, joints, time, *dynamics.loads(solution.state, forces))
        named, loops = stated_named(m, sample["named"]), sample["wrench"][len(m.joints) :].ravel()
    poses = motion.p_WB[:-1], motion.R_WB[:-1], motion.v_WB[:-1], motion.w_WB[:-1]
    return _vector(poses, contacts, solution.state.touching, forces, named, loops)


def by_the_bodies(route: ContactBodies, second: MaximalCoordinates, state: Array, mode: ContactMode) -> Array:
    """Record of the second route at a state, in natural units; for its order see :class:`LawRecorder`."""
    equations, m = route.equations, route.equations.mechanism
    state = np.append(equations.equations.normalised(state[:-1]), state[-1])
    bodies = equations.at(state, features_of(mode))
    solution, named, loops = equations.accelerated(bodies, mode), np.zeros(0), np.zeros(0)
    force = borne_forces(equations.contacts, bodies.touching, solution)
    if _has_named(m):
        _, wrenches = equations.applied(bodies, force)
        second.take_functions(equations.equations.functions)
        reactions, forces = second.reactions(float(state[-1]), state[:-1], equations.switched(state, mode), wrenches)
        named, loops = stated_named(m, forces), reactions[len(m.joints) :].ravel()
    p, v, quaternions, w = equations.equations.poses(state[:-1])
    rotations = np.array([from_quaternion(quaternion) for quaternion in quaternions])
    return _vector((p, rotations, v, w), equations.contacts, bodies.touching, force, named, loops)


def _has_named(m: Mechanism) -> bool:
    return bool(m.actuators or m.couplings or m.prescribed or m.loops)


def stated_named(m: Mechanism, named: Array) -> Array:
    """Efforts, drives and couplings, of named forces."""
    places = {field: [k for k, item in enumerate(named_forces(m)) if item.field == field] for field in _FIELDS}
    return named[[k for field in _FIELDS for k in places[field]]]


def _vector(
    poses: tuple[Array, Array, Array, Array],
    contacts: Sequence[Touchable],
    touching: Sequence[Touching],
    forces: Array,
    named: Array,
    loops: Array,
) -> Array:
    """Record at one state, flat."""
    of_bodies = np.concatenate([part.reshape(len(poses[0]), -1) for part in poses], 1)
    of_contacts = np.zeros((len(touching), 9))
    for row, contact, touch, force in zip(of_contacts, contacts, touching, forces, strict=True):
        row[:3] = force
        if contact.pressed_by is None:
            row[3:] = *touch.place, *touch.normal
    return np.concatenate([of_bodies.ravel(), of_contacts.ravel(), named, loops])
