"""Search for the causes of an engine's differences, each proven by the difference without and with it."""

import dataclasses
import math
from collections.abc import Callable
from xml.etree.ElementTree import Element

from proofroll.robots.check.layers import LAYERS, RobotTruth, differences, first_failing
from proofroll.robots.files.robot_file import RobotFile
from proofroll.robots.hypotheses import RobotEvidence, RobotHypothesis, hypotheses
from proofroll.robots.model import Robot
from proofroll.robots.protocol import Reading

# A cause counts only if it reduces the difference to less than this part.
_HELPS = 0.999
# Where no single cause closes a layer, the search follows this many of the best: the largest step may be wrong.
_BRANCHES = 3
# Number of states at which hypotheses are tried first: two random ones distinguish robots. Causes are proven at all.
_TRIED_AT = 2


@dataclasses.dataclass(frozen=True)
class RobotCause:
    """A cause with its proof.

    Attributes:
        id: name of the hypothesis, which is that of its function.
        name: behaviour of the engine.
        layer: first layer at which it shows.
        before, after: difference at that layer without and with the hypothesis.
        remedy: action that a user can take.
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
    """Node of the search: truth and reading as changed by the ``causes`` so far; ``found`` is layer -> difference."""

    truth: RobotTruth
    reading: Reading
    found: dict[str, float]
    causes: tuple[RobotCause, ...] = ()


@dataclasses.dataclass(frozen=True)
class Search:
    """Search for the causes of an engine's differences.

    Attributes:
        file: the file that was read.
        reading: model that the engine holds.
        engine: name of the engine.
        tolerances: layer -> largest difference at which it holds.
        recompiled, reread: see :class:`proofroll.robots.hypotheses.RobotEvidence`.
    """

    file: RobotFile
    reading: Reading
    engine: str
    tolerances: dict[str, float]
    recompiled: Callable[[Element], Robot | None] = lambda _: None
    reread: Callable[[Element], Reading | None] = lambda _: None

    def causes(self, truth: RobotTruth) -> tuple[tuple[RobotCause, ...], str | None]:
        """Causes of all differences, and the first layer that they leave unexplained (None: none).

        Causes are searched at a few states and proven at all; if the proof fails, the search repeats at all states.
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
        """Step after applying causes that were found at fewer states; None: one of them changes nothing."""
        by_id = {item.id: item for item in hypotheses()}
        step: _Step | None = self._begun(truth)
        for cause in causes:
            step = None if step is None else self._tried(step, by_id[cause.id], cause.layer)
        return step

    def _begun(self, truth: RobotTruth) -> _Step:
        return _Step(truth, self.reading, differences(truth, self.reading))

    def _searched(self, truth: RobotTruth) -> tuple[tuple[RobotCause, ...], str | None]:
        """Causes and first unexplained layer, searched at the states of ``truth``; see :meth:`causes`."""
        step = self._begun(truth)
        while (layer := first_failing(step.found, self.tolerances)) is not None:
            closed_step = self._closed(step, layer)
            if closed_step is None:
                return step.causes, layer
            step = closed_step
        return step.causes, None

    def _closed(self, step: _Step, layer: str) -> _Step | None:
        """Step after the causes that close a layer: a single one if possible, else a sequence; None: none do."""
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
                        break  # a cause that is known for this engine closes the layer
                    tried = self._tried(begun, hypothesis, layer, _HELPS * begun.found[layer])
                    if tried is not None:
                        candidates.append(tried)
            best = sorted(candidates, key=lambda item: self._rank(item, layer))[:_BRANCHES]
        return best[0] if best else None

    def _tried(self, step: _Step, hypothesis: RobotHypothesis, layer: str, most: float = math.inf) -> _Step | None:
        """Step after a hypothesis; None: it changes nothing, or leaves a difference above ``most`` at the layer."""
        truth, reading = step.truth, step.reading
        evidence = RobotEvidence(
            file=self.file, robot=truth.robot, reading=reading, recompiled=self.recompiled, reread=self.reread
        )
        result = next(iter(hypothesis.test(evidence)), None)
        if result is None or result is truth.robot:
            return None
        if isinstance(result, Reading):
            reading = result
        elif reading.joints and not result.moving:
            return None
        else:
            truth = RobotTruth.of(result, truth.states, like=truth)
        if not differences(truth, reading, layer).get(layer, math.inf) <= most:
            return None
        left = differences(truth, reading)
        versions_text = ", ".join(f"{name} {versions}".strip() for name, versions in hypothesis.known.items())
        difference, remainder = step.found[layer], left[layer]
        cause = RobotCause(
            id=hypothesis.id,
            name=hypothesis.grounds,
            layer=layer,
            before=difference,
            after=remainder,
            remedy=hypothesis.remedy,
            known=versions_text,
        )
        return _Step(truth, reading, left, (*step.causes, cause))

    def _rank(self, step: _Step, layer: str) -> tuple[int, float]:
        """Sort key of a step, best first: most layers that hold before the first failure, then smallest difference."""
        failing = first_failing(step.found, self.tolerances)
        order = list(LAYERS)
        return (-(order.index(failing) if failing else len(order)), step.found[layer])
