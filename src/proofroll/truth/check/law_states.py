"""Named forces of each route at one state, in numbers, as they act."""

from __future__ import annotations

from proofroll.elements.mechanism.contact.joint_laws import mode_of_joints
from proofroll.elements.mechanism.contact.modes import ContactMode, features_of
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.truth.bodies.contact_bodies import ContactBodies
from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates
from proofroll.truth.tree.contact_tree import ContactTree


def named_by_the_tree(route: ContactTree, state: Array, mode: ContactMode) -> Array:
    """Named forces of the first route at a state, in natural units; see :func:`.named_forces`."""
    dynamics = route.dynamics
    q, v, time = dynamics.parts(state)
    q = dynamics.equations.tree.normalised(q)
    joints = mode_of_joints(dynamics.equations.switched, dynamics.contacts, mode)
    loads = dynamics.loads(dynamics.at(q, v, time, features_of(mode)), route.borne(state, mode)[1])
    named: Array = dynamics.equations.sample(q, v, joints, time, *loads)["named"]
    return named


def named_by_the_bodies(route: ContactBodies, second: MaximalCoordinates, state: Array, mode: ContactMode) -> Array:
    """Named forces of the second route at a state, in natural units; ``second``: its equations of all joints."""
    equations = route.equations
    bodies = equations.at(state, features_of(mode))
    wrenches = equations.applied(bodies, route.borne(state, mode)[1])[1]
    second.take_functions(equations.equations.functions)
    return second.reactions(float(state[-1]), state[:-1], equations.switched(state, mode), wrenches)[1]
