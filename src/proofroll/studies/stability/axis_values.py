"""Values on the axes of a stability map: the scene at each, with its truth and its runs."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from proofroll.core.errors import ProofrollError
from proofroll.core.limits import STUDY_TIME_LIMIT
from proofroll.core.scene import Scene
from proofroll.core.time_grid import off_grids, time_grid
from proofroll.files.scene_file import load_scene
from proofroll.running.case import Case, EngineFacts, Status
from proofroll.running.engine_questions import on_scene, resolve_with_truth
from proofroll.running.runner import Runner
from proofroll.studies.cases import case_of
from proofroll.studies.failure import Yardstick
from proofroll.studies.stability.axes import Axis, Effort
from proofroll.studies.stability.records import MappedValue

# Sampling intervals per natural time; the coarsest step is one of them, the finer ones divide it.
PER_PERIOD = 8
# Divisors of that interval for the finer steps, two per octave.
_FINEST = 17
_PARTS = [1, *(part for power in range(_FINEST) for part in (2 << power, 3 << power))]
# Most samples of a long run. The interval becomes an odd multiple of that above, so that the samples still visit all
# phases of an oscillation.
_MOST_SAMPLES = 400


@dataclass
class AxisValue:
    """A value of an axis for which there is a scene, with its truth.

    Attributes:
        axis: name of the axis.
        value: of the axis.
        parameters: of the scene, those that differ from the defaults.
        scene: with these parameters.
        until, every: length and sampling interval of every run [s].
        yardstick: truth and sizes by which runs are measured.
        problem: reason why there is no truth here.
    """

    axis: str
    value: float
    parameters: dict[str, float]
    scene: Scene
    until: float
    every: float
    yardstick: Yardstick = field(init=False)
    problem: str | None = None

    @property
    def steps(self) -> list[float]:
        """Fixed steps of the search, coarse first [s]."""
        return [self.scene.natural_time / PER_PERIOD / part for part in _PARTS]


def axis_values(name: str, axes: Sequence[Axis], effort: Effort) -> list[AxisValue | MappedValue]:
    """Values of all axes, without truths yet; a value that gives no scene is a MappedValue with the reason."""
    default = load_scene(name)
    values: list[AxisValue | MappedValue] = []
    for axis in axes:
        for value in effort.values_of(axis):
            # Parameters equal to their defaults are left out, so that axes share runs where they meet.
            defaults = {
                key: number for key, number in axis.at(default, value).items() if number != default.parameters[key]
            }
            try:
                scene = load_scene(name, **defaults)
            except ProofrollError as error:
                values.append(MappedValue(axis.name, value, defaults, str(error)))
                continue
            intervals = round(PER_PERIOD * (value if axis.horizon else effort.periods))
            stride = 1 + 2 * (intervals // (2 * _MOST_SAMPLES))
            every = stride * scene.natural_time / PER_PERIOD
            values.append(
                AxisValue(
                    axis=axis.name,
                    value=value,
                    parameters=defaults,
                    scene=scene,
                    until=every * max(1, intervals // stride),
                    every=every,
                )
            )
    return values


def measure(name: str, values: Sequence[AxisValue], runner: Runner, tell: Callable[[], None]) -> None:
    """Computes the truth at every value and sets its yardstick, and its problem if there is no truth."""
    _, facts = resolve_with_truth([], runner.workers)
    cases = [
        replace(
            case_at(name, value, on_scene(facts, value.scene, runner.workers), STUDY_TIME_LIMIT),
            between=off_grids(time_grid(value.until, value.every), [None, *value.steps]),
        )
        for value in values
    ]
    results = runner.run(cases, lambda *_: tell())
    for value, case in zip(values, cases, strict=True):
        result = results[case.key]
        truth = runner.store.stored(case).dataset if result.status == Status.DONE else None
        if truth is None:
            value.problem = f"there is no truth here: {result.message}"
        value.yardstick = Yardstick.of(value.scene, truth)


def case_at(name: str, value: AxisValue, facts: EngineFacts, limit: float) -> Case:
    """Case at a value with a time limit [s]."""
    return case_of(name, value.scene, value.parameters, facts, value.until, value.every, time_limit=limit)
