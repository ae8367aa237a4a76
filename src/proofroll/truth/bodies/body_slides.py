"""Slides of the contacts of separate bodies without forces of contacts."""

import numpy as np

from proofroll.elements.mechanism.contact.free_slides import FreeSlides, free_slides
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.truth.bodies.contact_equations import BodiesState
from proofroll.truth.bodies.independent_rows import accelerated_by


def slides_of(bodies: BodiesState) -> FreeSlides:
    """Slides of the contacts of bodies without forces of contacts."""
    free = accelerated_by(bodies.mass, bodies.force, bodies.C, -bodies.of_joints)
    loose: Array = np.asarray(np.linalg.inv(bodies.mass), dtype=np.float64)
    root = np.linalg.cholesky(bodies.mass)
    locked = np.linalg.qr(np.linalg.solve(root, bodies.C.T))[0]
    ways = np.linalg.solve(root.T, np.eye(len(root)) - locked @ locked.T)
    joint_force = bodies.mass @ free - bodies.force
    return free_slides(bodies.touching, bodies.J, bodies.bias, free, ways @ ways.T, loose, joint_force)
