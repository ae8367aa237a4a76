"""Causes that close the difference of an engine, each with the difference before and after."""

import dataclasses
import math
from collections.abc import Callable
from xml.etree.ElementTree import Element

from proofroll.robots.hypotheses import RobotEvidence, RobotHypothesis, hypotheses
from proofroll.robots.layers import LAYERS, RobotTruth, differences, first_failing
from proofroll.robots.model import Robot
from proofroll.robots.protocol import Reading
from proofroll.robots.robot_file import RobotFile

# A cause that leaves more than this part of a difference explains nothing, not even together with others.
_HELPS = 0.999
# Where no cause closes a layer alone, so many of the best are followed: the largest step is not always a right one.
_BRANCHES = 3
# At so many states hypotheses are tried: random ones tell two robots apart. The causes found are proven at all states.
_TRIED_AT = 2


@dataclasses.dataclass(frozen=True)
class RobotCause:
    """A cause with its proof.

    Attributes:
        id: function of the hypothesis.
        name: behaviour of the engine.
        layer: the first at which it shows.
        before, after: difference at that layer without and with the hypothesis.
        remedy: action of a user.
        known: engines and versions in which it was seen.
    """

    id: str
    name: str
    layer: str
    before: float
    after: float
    remedy: str
    known: str


@dataclasses.dataclass(frozen=True)
class _Step:
    """Truth of the robot, and the engine's reading, as changed by the causes found so far."""

    truth: RobotTruth
    reading: Reading
    found: dict[str, float]
    causes: tuple[RobotCause, ...] = ()


@dataclasses.dataclass(frozen=True)
class Search:
    """Looks for the causes of what an engine holds.

    Attributes:
        file: the file that was read.
        reading: model that the engine holds.
        engine: its name.
        tolerances: up to which a layer holds.
        recompiled, reread: see :class:`proofroll.robots.hypotheses.RobotEvidence`.
    """

    file: RobotFile
    reading: Reading
    engine: str
    tolerances: dict[str, float]
    recompiled: Callable[[Element], Robot | None] = lambda _: None
    reread: Callable[[Element], Reading | None] = lambda _: None

    def causes(self, truth: RobotTruth) -> tuple[tuple[RobotCause, ...], str | None]:
        """The causes of all differences, and the first layer that they leave unexplained.

        They are looked for at a few of the states, and proven at all; where that fails all states are searched.
        """
        if truth.states.count > _TRIED_AT:
            few = dataclasses.replace(self, reading=self.reading.first(_TRIED_AT), reread=self._reread_at_few)
            causes, layer = few._searched(truth.first(_TRIED_AT))
            step = self._proven(truth, causes)
            if step is not None and first_failing(step.found, self.tolerances) == layer:
                return step.causes, layer
        return self._searched(truth)

    def _reread_at_few(self, root: Element) -> Reading | None:
        reading = self.reread(root)
        return None if reading is None else reading.first(_TRIED_AT)

    def _proven(self, truth: RobotTruth, causes: tuple[RobotCause, ...]) -> _Step | None:
        """The step after causes that were found at other states; None: one gives no other robot here."""
        known = {item.id: item for item in hypotheses()}
        step: _Step | None = self._begun(truth)
        for cause in causes:
            step = None if step is None else self._tried(step, known[cause.id], cause.layer)
        return step

    def _begun(self, truth: RobotTruth) -> _Step:
        return _Step(truth, self.reading, differences(truth, self.reading))

    def _searched(self, truth: RobotTruth) -> tuple[tuple[RobotCause, ...], str | None]:
        """See :meth:`causes`, at the states of the truth."""
        step = self._begun(truth)
        while (layer := first_failing(step.found, self.tolerances)) is not None:
            closed = self._closed(step, layer)
            if closed is None:
                return step.causes, layer
            step = closed
        return step.causes, None

    def _closed(self, step: _Step, layer: str) -> _Step | None:
        """The step after the causes that close a layer: one alone if there is one, else several one after another."""
        limit = self.tolerances[layer]
        ranked = sorted(hypotheses(), key=lambda item: self.engine not in item.known)
        best = [step]
        while best and best[0].found[layer] > limit:
            candidates: list[_Step] = []
            for begun in best:
                for hypothesis in ranked:
                    if hypothesis.id in {cause.id for cause in begun.causes}:
                        continue
                    if self.engine not in hypothesis.known and any(item.found[layer] <= limit for item in candidates):
                        break  # one that is known of this engine closes the layer
                    tried = self._tried(begun, hypothesis, layer, _HELPS * begun.found[layer])
                    if tried is not None:
                        candidates.append(tried)
            best = sorted(candidates, key=lambda item: self._rank(item, layer))[:_BRANCHES]
        return best[0] if best else None

    def _tried(self, step: _Step, hypothesis: RobotHypothesis, layer: str, most: float = math.inf) -> _Step | None:
        """The step after a hypothesis; None: no other robot comes of it, or the layer is off by more than ``most``."""
        truth, reading = step.truth, step.reading
        changed = hypothesis.change(RobotEvidence(self.file, truth.robot, reading, self.recompiled, self.reread))
        if changed is None or changed is truth.robot:
            return None
        if isinstance(changed, Reading):
            reading = changed
        elif reading.joints and not changed.moving:
            return None
        else:
            truth = RobotTruth.of(changed, truth.states, like=truth)
        if not differences(truth, reading, layer).get(layer, math.inf) <= most:
            return None
        left = differences(truth, reading)
        known = ", ".join(f"{name} {versions}".strip() for name, versions in hypothesis.known.items())
        before, after = step.found[layer], left[layer]
        cause = RobotCause(hypothesis.id, hypothesis.name, layer, before, after, hypothesis.remedy, known)
        return _Step(truth, reading, left, (*step.causes, cause))

    def _rank(self, step: _Step, layer: str) -> tuple[int, float]:
        """Best first: one after which the most layers hold from the start, then the smallest difference."""
        failing = first_failing(step.found, self.tolerances)
        order = list(LAYERS)
        return (-(order.index(failing) if failing else len(order)), step.found[layer])
