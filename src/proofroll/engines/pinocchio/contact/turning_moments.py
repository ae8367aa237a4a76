"""Rolling resistance and friction against spin, by iteration around Pinocchio's solver, which has no moments."""

import math
from collections.abc import Callable, Sequence
from operator import sub

import numpy as np
import pinocchio as pin

from proofroll.core.errors import Diverged
from proofroll.elements.mechanism.contact.rolling_and_spin import largest_response, turning_frictions
from proofroll.elements.mechanism.contact.touching import Touching
from proofroll.elements.mechanism.run.contacts.step_events import OPEN, SLIP, States
from proofroll.elements.mechanism.scene.rotations import Array, minus, plus, scaled, skew
from proofroll.engines.pinocchio.contact.step_terms import Impulses
from proofroll.engines.pinocchio.smooth.joint_tree import JointTree

# Most solutions of a step, and change of moments that counts as none, in the solver's tolerances of the largest one:
# what the iteration leaves is not seen beside what the solver leaves.
_MOST, _SETTLED = 100, 1e-2
# Cross product of a normal with a vector, in the frame whose last axis it is.
_ACROSS = skew((0.0, 0.0, 1.0))


Pressed = tuple[Impulses, list[float]]  # impulses of the contacts, and normal one of each friction that acts [N s]


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
                rows[1, k] += friction.bend * frames[friction.pressed_by] @ _ACROSS @ J[friction.pressed_by]
        return rows

    def found(
        self, rows: Array, J: Array, v: Array, inverse: Array, pressed: Callable[[Array], Pressed], time: float
    ) -> tuple[Impulses, Array, Array]:
        """Impulses beside those of all frictions [N m s], (frictions, 3), and the joint impulses that these are, (nv,).

        Args:
            rows: see :meth:`rows`.
            J: see :meth:`rows`.
            v: joint velocities before the step.
            inverse: of the mass matrix.
            pressed: gives the contacts for joint impulses of the moments.
            time: for messages [s].

        Raises:
            Diverged: the iterations do not settle.
        """
        both, count = rows.reshape(-1, len(v)), 3 * len(self.frictions)
        turning_rows, before = both[:count], (both[count:] @ v).tolist()
        responses = ((turning_rows @ inverse) * turning_rows).sum(axis=1).reshape(-1, 3).sum(axis=1).tolist()
        moments, impulses = [0.0] * count, np.zeros(len(v))
        eases = dict[tuple[int, States], float]()  # what is held is mostly the same in all solutions of a step
        for _ in range(_MOST):
            (outcome, normal), last, moments = pressed(impulses), moments, [*moments]
            rates = (both @ outcome.v).tolist()
            bounds = [friction.friction * size for friction, size in zip(self.frictions, normal, strict=True)]
            for k, (friction, bound) in enumerate(zip(self.frictions, bounds, strict=True)):
                part, key = slice(3 * k, 3 * k + 3), (k, outcome.states)
                moves = bool(friction.bend) and outcome.states[friction.pressed_by] == SLIP
                # what turns faster is not stopped within the bound: contacts only lessen its response
                moves = moves or math.hypot(*rates[part]) > responses[k] * (bound + math.hypot(*last[part]))
                if not moves:
                    if key not in eases:
                        eases[key] = _ease(rows[0, k], J, inverse, outcome.states)
                    if eases[key]:
                        moments[part] = minus(last[part], scaled(1.0 / eases[key], rates[part]))
                    moves = math.hypot(*moments[part]) > bound
                if moves:
                    direction = plus(before[part], rates[count:][part])
                    moments[part] = scaled(-bound / (math.hypot(*direction) or 1.0), direction)
            impulses = np.array(moments) @ turning_rows
            if max(map(abs, map(sub, moments, last))) <= _SETTLED * self._tolerance * max(bounds):
                return outcome, np.array(moments).reshape(-1, 3), impulses
        raise Diverged(f"the moments of friction against turning at {time:g} s are not found in {_MOST} iterations")


def _ease(row: Array, J: Array, inverse: Array, states: States) -> float:
    """Largest response of a turning, (3, nv), while contacts hold what their states say; see :meth:`.found`."""
    held = [J[k, 2:] if state == SLIP else J[k] for k, state in enumerate(states) if state != OPEN]
    held_rows, ways = np.concatenate([J[:0, 0], *held]), inverse @ row.T
    return largest_response(row @ ways, held_rows @ ways, held_rows @ inverse @ held_rows.T)
