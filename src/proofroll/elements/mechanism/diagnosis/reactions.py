"""Hypotheses of wrongly reported reactions: other body, joint, point or axes.

Components in the world that a loop leaves undetermined are not compared.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from proofroll.core.arrays import FloatArray, known_difference
from proofroll.core.diagnosis import CLOSES, Cause, Evidence, hypothesis
from proofroll.core.diagnosis.samples import departure, forced_otherwise, run_and_truth
from proofroll.core.diagnosis.vectors import ReportedVector, product
from proofroll.core.errors import Diverged
from proofroll.elements.mechanism.diagnosis.equations import is_motion, placed_of
from proofroll.elements.mechanism.diagnosis.reporting_errors import BODY
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.dynamics.switches import switched_joints
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.rotations import skews
from proofroll.elements.mechanism.scene.signal import Formula, Table

# Distance of joints without any comparable components, in sizes of the forces: they are matched last.
_FAR = 1e3
# Largest difference of equal reactions, relative to the difference to be explained.
_SAME = 1e-2
# Largest error of velocities, in parts of their changes, of a motion that is nearly right.
_RIGHT = 1e-3
PARENT = "the axes of the parent body"
_KINDS = (
    ("force", "N", "the force on the child at the joint"),
    ("torque", "N m", "the moment on the child at the joint"),
)


@dataclass(frozen=True)
class Reactions:
    """Forces or moments of joints and loops, reported and true.

    Attributes:
        reported: of the connections with values on both sides, shape (time, connections, 3).
        which: their indices among the mechanism's connections.
        placed: the bodies at these times.
        force: the true forces of the same connections [N].
    """

    reported: ReportedVector
    which: list[int]
    placed: Placed
    force: FloatArray

    @property
    def mechanism(self) -> Mechanism:
        """Mechanism of the reactions."""
        return self.placed.mechanism

    def causes(self, step: float | None) -> Iterator[Cause]:
        """Possible causes of wrong reactions; none if the reactions are right."""
        if self.reported.differs:
            yield from self.reported.causes(step)
            yield from self._of_other_joints()
            if self.reported.name == "torque":
                yield from self._about_other_points()

    def _of_other_joints(self) -> Iterator[Cause]:
        """Hypothesis: reactions are reported at other joints than their own."""
        reported, true = self.reported.reported, self.reported.true
        off = np.abs(reported[:, :, None] - true[:, None])
        shared = np.any(np.isfinite(off), axis=(0, 3))
        distance = np.where(shared, np.max(np.nan_to_num(off), axis=(0, 3)), np.inf)
        order = linear_sum_assignment(np.minimum(distance, _FAR * self.reported.size))[1].tolist()
        if order == list(range(len(order))):
            return
        names = [self.mechanism.connections[k].name for k in self.which]
        sure = np.sum(distance <= _SAME * self.reported.before, axis=1) == 1  # two joints may carry equal reactions
        moves = [(i, j) for i, j in enumerate(order) if i != j and sure[i]]
        moved = "; ".join(f"at {names[i]} stands that of {names[j]}" for i, j in moves)
        says = f"the {self.reported.name} is of another joint{': ' if moved else ''}{moved}"
        yield self.reported.cause("other joint", says, true[:, order], "look at the order of joints in the engine")

    def _about_other_points(self) -> Iterator[Cause]:
        """Hypothesis: moments are about the centre of mass of the child, or about the world's origin."""
        coms = {body.name: body.com for body in self.mechanism.bodies}
        ends = [self.mechanism.connections[k] for k in self.which]
        places = np.stack([self.placed.point(end.b, end.position_b) for end in ends], axis=1)
        centre = np.stack([self.placed.point(end.b, coms.get(end.b, (0, 0, 0))) for end in ends], axis=1)
        for point_words, arm in (("centre of mass of the child", places - centre), ("origin of the world", places)):
            moved = self.reported.true + product(skews(arm.reshape(-1, 3)).reshape(*arm.shape, 3), self.force)
            says = f"torque is the moment about the {point_words}, not at the joint"
            yield self.reported.cause("point of moment", says, moved, "give the moment at the joint")


def _reactions(
    evidence: Evidence,
    placed: Placed,
    reported: Mapping[str, FloatArray],
    true: Mapping[str, FloatArray],
    bars: Mapping[str, float],
) -> Iterator[Reactions]:
    """Reported and true forces, then moments, of the connections with known values.

    ``reported`` and ``true``: by kind, shape (time, connections, 3); ``bars``: error bar of the truth, by kind.
    """
    element = evidence.element
    ends = element.mechanism.connections
    bodies = element.mechanism.body_index
    force = element.mechanism.mass * element.first_motion.scale
    for kind, unit, what in _KINDS:
        finite = np.isfinite(true[kind])
        heard = np.all(np.isfinite(reported[kind]) | ~finite, axis=(0, 2)) & np.any(finite, axis=(0, 2))
        which = np.flatnonzero(heard).tolist()
        if not which or f"{kind}s" in evidence.settled:
            continue
        frames = {
            name: np.stack([placed.R_WB[:, bodies[ends[k].b if name == BODY else ends[k].a]] for k in which], axis=1)
            for name in (BODY, PARENT)
        }
        values = np.where(finite, reported[kind], np.nan)[:, which]
        least = force if kind == "force" else force * element.length
        vector = ReportedVector(
            name=kind,
            what=what,
            unit=unit,
            reported=values,
            true=true[kind][:, which],
            time=placed.time,
            frames=frames,
            least=least,
            bar=bars.get(kind, 0.0),
        )
        yield Reactions(vector, which, placed, true["force"][:, which])


@hypothesis("reactions", "the engine reports the true wrench with another sign, frame, point, joint or time")
def reactions(evidence: Evidence) -> Iterator[Cause]:
    """Hypotheses on forces and moments of joints and loops along the run, where they are determinate."""
    pair = run_and_truth(evidence)
    if pair is None:
        return
    run, truth = (data.isel(time=slice(1, None)) for data in pair)
    names = [connection.name for connection in evidence.element.mechanism.connections]
    reported, true = ({kind: _stacked(data, kind, names) for kind, _, _ in _KINDS} for data in (run, truth))
    bars = {kind: float(truth[f"{kind}s"].attrs.get("error_bar", 0.0)) for kind, _, _ in _KINDS if f"{kind}s" in truth}
    for connection in _reactions(evidence, placed_of(evidence.element.mechanism, truth), reported, true, bars):
        causes = [cause for cause in connection.causes(evidence.step) if cause.proven]
        if causes and not (
            forced_otherwise(evidence, connection.reported) and _may_be_motion(evidence, run, connection)
        ):
            yield from causes


def _may_be_motion(evidence: Evidence, run: Any, seen: Reactions) -> bool:
    """False if the motion is nearly right, and reactions at the run's own states are the true ones.

    Of contacts, friction, stops and what is given over time the state alone does not tell the forces.
    """
    mechanism, true = seen.mechanism, seen.reported.true
    driven = any(isinstance(signal, Formula | Table) for signal in mechanism.signals)
    if driven or mechanism.contacts or switched_joints(mechanism) or not is_motion(run):
        return True
    if any(departure(evidence, name) > _RIGHT for name in ("v_WB", "w_WB")):
        return True
    equations, placed = JointCoordinates(mechanism), placed_of(mechanism, run)
    try:
        samples = [equations.sample(q, v, time=t) for q, v, t in zip(*placed.of_tree(), placed.time, strict=True)]
    except Diverged:  # at a singular pose
        return True
    forces, moments = np.split(np.array([sample["wrench"] for sample in samples])[:, seen.which], 2, axis=-1)
    reference = forces if seen.reported.name == "force" else moments
    return known_difference(np.where(np.isnan(true), np.nan, reference), true) > CLOSES * seen.reported.before


@hypothesis(
    "reactions at time 0",
    "the certificate's wrenches have another sign, frame, point or joint, and nothing else differs",
)
def reactions_at_start(evidence: Evidence) -> Iterator[Cause]:
    """Hypotheses on forces and moments at time 0."""
    if {str(line["quantity"]) for line in evidence.lines if not line["holds"]} - {"forces", "torques"}:
        return
    count, reported, true = len(evidence.element.mechanism.connections), {}, {}
    for kind, _, _ in _KINDS:
        pair, empty = evidence.vectors(f"{kind}s", count), np.full((1, count, 3), np.nan)
        reported[kind] = empty if pair is None or evidence.read_back(f"{kind}s") else pair[0][None]
        expected = (line["expected"] for line in evidence.lines if line["quantity"] == f"{kind}s")
        true[kind] = np.reshape(next(expected, empty), empty.shape)
    for kind_of in _reactions(evidence, evidence.element.start, reported, true, {}):
        yield from kind_of.causes(evidence.step)


def _stacked(data: Any, kind: str, names: list[str]) -> FloatArray:
    """Components of a kind of reaction, (time, connections, 3); NaN where not reported or not determinate."""
    empty = np.full(data.sizes["time"], np.nan)
    rows = [
        [data[f"{kind}.{name}.{a}"].to_numpy() if f"{kind}.{name}.{a}" in data else empty for a in "xyz"]
        for name in names
    ]
    return np.moveaxis(np.array(rows, dtype=np.float64), -1, 0)
