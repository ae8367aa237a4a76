"""Rolling resistance and friction against spin, by iteration around Pinocchio's solver, which has no moments."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from proofroll.core.errors import Diverged
from proofroll.elements.mechanism.contact.rolling_and_spin import largest_response, turning_frictions
from proofroll.elements.mechanism.contact.touching import Touching
from proofroll.elements.mechanism.run.contacts.step_events import SLIP, States
from proofroll.elements.mechanism.scene.rotations import Array, skew
from proofroll.engines.pinocchio.smooth.joint_tree import JointTree

# Most solutions of a step, and change of moments that counts as none, in the solver's tolerances of the largest one:
# what the iteration leaves is not seen beside what the solver leaves.
_MOST, _SETTLED = 100, 1e-2


class Pressed(NamedTuple):
    """Outcome of the contacts of a step for given moments.

    Attributes:
        v: velocities after it, (nv,).
        normal: impulse along the normal of each contact whose friction against turning acts [N s].
        held: rows that its contacts hold at zero, (rows, nv).
        states: of all contacts.
    """

    v: Array
    normal: Array
    held: Array
    states: States


class TurningImpulses:
    """Friction against turning of all contacts.

    While a body turns, the moment opposes the mean of the angular velocities before and after a step; it holds what it
    can stop within the step. Against the motion of a ball that slips it opposes the mean of that motion.
    """

    def __init__(self, tree: JointTree, tolerance: float) -> None:
        """Takes the tolerance of the contact solver [1]."""
        self._tree, self._tolerance = tree, tolerance
        self.frictions = turning_frictions(tree.mechanism.contacts)

    def rows(self, data: pin.Data, touching: Sequence[Touching], frames: Sequence[Array], J: Array) -> Array:
        """Derivatives of resisted angular velocities, and of what moments oppose, by joint velocities, from ``data``.

        (2, frictions, 3, nv); ``J``: those of the slides along the ``frames`` of the normals, (contacts, 3, nv).
        """
        index, model = self._tree.mechanism.body_index, self._tree.model
        rows = np.zeros((2, len(self.frictions), 3, model.nv))
        for k, friction in enumerate(self.frictions):
            contact, normal = self._tree.mechanism.contacts[friction.pressed_by], touching[friction.pressed_by].normal
            for body, sign in ((contact.body_a, 1.0), (contact.body_b, -1.0)):
                if index[body] >= 0:
                    frame = self._tree.body[index[body]]
                    rows[0, k] += sign * pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)[3:]
            rows[0, k] = friction.resisted(normal, rows[0, k])
            rows[1, k] = rows[0, k]
            if friction.bend:
                rows[1, k] += friction.bend * skew(normal) @ frames[friction.pressed_by] @ J[friction.pressed_by]
        return rows

    def found(
        self, rows: Array, v: Array, inverse: Array, pressed: Callable[[Array], Pressed], time: float
    ) -> tuple[Array, Array]:
        """Impulsive moments of all frictions [N m s], (frictions, 3), and the joint impulses that they are, (nv,).

        Args:
            rows: see :meth:`rows`.
            v: joint velocities before the step.
            inverse: of the mass matrix.
            pressed: contacts for joint impulses of the moments.
            time: for messages [s].

        Raises:
            Diverged: the iterations do not settle.
        """
        moments, impulses = np.zeros((len(self.frictions), 3)), np.zeros(len(v))
        coefficients = np.array([friction.friction for friction in self.frictions])
        eases = dict[tuple[int, bytes], float]()  # what is held is mostly the same in all solutions of a step
        for _ in range(_MOST):
            outcome, last = pressed(impulses), moments.copy()
            bounds, held = coefficients * outcome.normal, outcome.held.tobytes()
            for k, (row, opposed, bound) in enumerate(zip(*rows, bounds.tolist(), strict=True)):
                if (k, held) not in eases:
                    ways = inverse @ row.T
                    of_held = outcome.held @ inverse @ outcome.held.T
                    eases[k, held] = largest_response(row @ ways, outcome.held @ ways, of_held)
                if eases[k, held]:
                    moments[k] -= row @ outcome.v / eases[k, held]
                moves = self.frictions[k].bend and outcome.states[self.frictions[k].pressed_by] == SLIP
                if moves or math.hypot(*moments[k].tolist()) > bound:
                    turning = opposed @ (v + outcome.v)
                    moments[k] = -bound * turning / (math.hypot(*turning.tolist()) or 1.0)
            impulses = moments.ravel() @ rows[0].reshape(moments.size, -1)
            if np.abs(moments - last).max() <= _SETTLED * self._tolerance * bounds.max():
                return moments, impulses
        raise Diverged(f"the moments of friction against turning at {time:g} s are not found in {_MOST} iterations")
