"""Compares any trajectory with the truth of a scene, and describes the result."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.arrays import FloatArray, largest_distance, largest_magnitude, magnitudes
from proofroll.core.columns import UNCERTAIN
from proofroll.core.comparison import Tolerance
from proofroll.core.dataset import BETWEEN, CONTINUOUS, impact_samples, off_impacts
from proofroll.core.diagnosis.scene_diagnosis import diagnose_scene
from proofroll.core.element_abilities import MovesFreely, step_bound
from proofroll.core.errors import InputError, require_known
from proofroll.core.multi_element import REQUIRED
from proofroll.core.number_format import be, number, spaced
from proofroll.core.observable import Role
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.core.verdict import Allowance, Judgement, RunCurve, TrueCurve, Verdict, judge_curve
from proofroll.core.whole_turns import samples_between
from proofroll.files.scene_file import load_scene
from proofroll.studies.judging import run_values
from proofroll.studies.judging.asked_tolerance import bounds_of, judged_names
from proofroll.studies.judging.causes import GivenVariable, begun_later, causes_of
from proofroll.studies.judging.reference import Reference
from proofroll.studies.judging.run_values import turned_alike
from proofroll.studies.judging.user_trajectory import GivenRun, RunInput, begun, read_run, start_words
from proofroll.studies.result_table import gauge, html_table

if TYPE_CHECKING:
    import xarray as xr

_USUAL = Tolerance(0.01, True)
_LEAST = 0.01
_MILLI = 1e3
_NO_TOLERANCE = "no tolerance is given"
_UNDETERMINED = "the truth does not determine it"
_CONTRADICTS = "that is against the state of the same trajectory"
_MOST_TRUTHS = 64
_truths: dict[tuple[str, bytes, bytes], xr.Dataset] = {}


@dataclass(frozen=True)
class Compared:
    """One quantity of a trajectory.

    Attributes:
        judgement: see :class:`proofroll.core.verdict.Judgement`.
        at: time of the largest difference [s]; None if the quantity is no function of time.
        lost: words on the rows without a finite number; empty: all have one.
    """

    judgement: Judgement
    at: float | None
    lost: str = ""

    @property
    def agrees(self) -> bool:
        """True if the error is within its tolerance, and the truth is known well enough to judge."""
        return self.judgement.verdict is Verdict.AGREES

    def __str__(self) -> str:
        """Largest difference with its time, the tolerance, and the error bar of the truth."""
        judgement = self.judgement
        unit = spaced(judgement.unit)
        when = "" if self.at is None else f" at {self.at:.4g} s"
        error, allowed = number(judgement.error, 3), number(judgement.tolerance, 3)
        quantity, verb = judgement.observable, be(judgement.observable)
        difference = f"{quantity} {verb} off by {error}{unit}{when}, allowed {allowed}{unit}"
        if not np.isfinite(judgement.error):
            counts = judgement.reason.removeprefix("the question is ill-posed here; ").partition(";")[0]
            unlike = f"has {counts}" if ", the truth has " in counts else f"{verb} not finite{self.lost}"
            difference = f"{quantity} {unlike}{when}"
        bar = f"the truth is known to {number(judgement.truth_error_bar)}{unit}"
        if judgement.verdict is Verdict.NOT_JUDGED:
            bar = f"not judged, for {bar} only"
        remarks = ["the question is ill-posed here"] if judgement.verdict is Verdict.ILL_POSED else []
        return "; ".join([difference, bar, *remarks, *judgement.remarks])


@dataclass(frozen=True, repr=False)
class Judged:
    """A trajectory compared with the truth of a scene.

    Attributes:
        scene: its name.
        compared: each judged quantity, the one farthest beyond its tolerance first.
        because: reason of the tolerances; empty if not given.
        unjudged: given variable that is not judged -> reason.
        ended: time and reason of an early end of the truth, behind which nothing is judged; empty: there is none.
        quiet: sentences on a truth that begins as the trajectory does, in which nothing moves, or nothing touches.
        step_bound: clause on the longest stable step of an explicit scheme; empty: nothing bounds it.
        causes: clauses on mistakes that explain a difference.
    """

    scene: str
    compared: tuple[Compared, ...]
    because: str = ""
    unjudged: Mapping[str, str] = field(default_factory=dict)
    ended: str = ""
    quiet: str = ""
    step_bound: str = ""
    causes: tuple[str, ...] = ()

    @property
    def agrees(self) -> bool:
        """True if every quantity agrees."""
        return all(item.agrees for item in self.compared)

    def __str__(self) -> str:
        """A headline, then a line for each quantity, and a line for each reason why given variables are not judged."""
        why = f" (tolerance: {self.because})" if self.because else ""
        head = f"{'agrees with' if self.agrees else 'differs from'} the truth of {self.scene}{why}"
        lines = [f"  {'ok' if item.agrees else '!!'} {item}" for item in self.compared]
        lines += [f"  cause: {cause}" for cause in self.causes]
        for why in dict.fromkeys(self.unjudged.values()):
            lines.append(f"  not judged: {', '.join(name for name, its in self.unjudged.items() if its == why)}; {why}")
        if self.ended:
            lines.append(f"  not judged: what lies behind, for {self.ended}")
        lines += [f"  {sentence}" for sentence in (self.quiet, self.step_bound) if sentence]
        return "\n".join([head, *lines])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        """HTML table with gauges for a notebook, with the content of the text."""
        head, *lines = str(self).splitlines()
        rows = []
        for item in self.compared:
            judgement, sign = item.judgement, "✓" if item.agrees else "✗"
            unit = spaced(judgement.unit)
            numbers = (
                number(value) + unit for value in (judgement.error, judgement.tolerance, judgement.truth_error_bar)
            )
            when = "" if item.at is None else f"{item.at:.4g} s"
            rows.append((judgement.observable, f"{sign} {judgement.verdict.value}", *numbers, when))
        columns = ("", "verdict", "off by", "allowed", "truth known to", "at")
        gauges = [gauge(item.judgement.error, item.judgement.tolerance) for item in self.compared]
        return html_table(head, columns, rows, map(str.strip, lines[len(rows) :]), gauges=gauges)

    def content(self) -> dict[str, Any]:
        """Plain data for JSON."""
        names = ("observable", "unit", "error", "tolerance", "truth_error_bar", "scale")
        rows = [
            {name: getattr(item.judgement, name) for name in names}
            | {"at": item.at, "verdict": item.judgement.verdict.value, "remarks": list(item.judgement.remarks)}
            for item in self.compared
        ]
        head = {"scene": self.scene, "agrees": self.agrees, "because": self.because}
        return head | {
            "compared": rows,
            "unjudged": dict(self.unjudged),
            "ended": self.ended,
            "quiet": self.quiet,
            "step_bound": self.step_bound,
            "causes": list(self.causes),
        }


def judge(
    run: RunInput,
    scene: str | Scene,
    tolerance: Mapping[str, object] | str | Sequence[str] | float | None = None,
    *,
    because: str = "",
    columns: Mapping[str, str] | None = None,
) -> Judged:
    """Compares a trajectory with the truth of a scene at the trajectory's own times.

    Args:
        run: from :func:`proofroll.simulate`, the path of a file (netCDF, CSV or ``.npz``), or arrays by name: ``time``
            [s], and the state (``p_WB``, ``v_WB``, ``w_WB``, as in :class:`proofroll.core.engine.Sample`, one row for
            each time; for mechanisms ``q_WB``; finite, quaternions of length 1), or variables that the truth has, such
            as ``q.hinge``, ``tip.x``, ``positions``, ``z``; in the truth's units.
        scene: name, path of a folder, or :func:`proofroll.load_scene`.
        tolerance: observable or variable -> ``"1 %"`` of its scale, ``"1e-3 m"``, or a number in its unit; or texts as
            of ``--tolerance``; one without a name bounds the main motion and the place of every body, or all that a
            table gives, in its unit. A single number is for the deciding observable. None: 1 % of each main quantity,
            of every force and moment, and of given positions, velocities, angular velocities and orientations; for the
            time of the first slip the sampling interval. A run that reports sticking while it slips never agrees.
        because: reason for these tolerances.
        columns: name in the trajectory -> name of a variable of the truth, perhaps with a unit that is converted:
            ``{"theta": "q.pivot[deg]"}``.

    Raises:
        InputError: an argument names something unknown or makes no sense.
        Refused, Diverged: there is no truth of this scene.
    """
    scene = load_scene(scene) if isinstance(scene, str) else scene
    user_run = read_run(run, scene, columns)
    dataset = user_run.dataset
    given_scene, scene = scene, begun(scene, dataset)
    between = dataset[BETWEEN].to_numpy() if BETWEEN in dataset else np.zeros(0)
    _require_seconds(scene, dataset)
    asked = scene.fully_asked if "q_WB" in {str(name).partition(".")[0] for name in dataset.data_vars} else scene
    reference = Reference.of(scene, _truth(asked, dataset["time"].to_numpy(), between))
    user_run.require_units(reference.dataset)
    observed: dict[str, FloatArray] = {}
    if "scene_digest" in dataset.attrs:  # all variables of a run
        laws = run_values.laws_behind_the_end(reference, dataset)
        reference, cut = reference.common_span({0: dataset})
        observed = run_values.observables_of(reference, cut[0]) | laws
        dataset = cut[0]
    else:
        dataset = off_impacts(scene, reference.dataset, {0: dataset})[0]
    given_variables = dataset.variables  # indexing a dataset would make coordinates, too
    sure = [str(name) for name in dataset.data_vars if UNCERTAIN not in given_variables[name].attrs]
    bounds = _bounds(tolerance, reference, observed, sure)
    compared = [_compared(name, bound, reference, observed, dataset) for name, bound in bounds.items()]
    further = {
        name: bound for name, bound in run_values.always_judged(reference, observed).items() if name not in bounds
    }
    rates = run_values.contradicted_rates(reference, given_variables, bounds)
    further |= {name: Tolerance(run_values.CONTRADICTS, True) for name, _ in rates if name in sure}
    unasked = [_compared(name, bound, reference, observed, dataset) for name, bound in further.items()]
    compared += [item for item in unasked if item.judgement.verdict is Verdict.DIFFERS]
    against = dict(_against_state(user_run, reference, bounds))
    compared = [item for item in compared if item.judgement.observable not in against] + [*against.values()]
    compared.sort(key=lambda item: item.judgement.of_allowed, reverse=True)
    unjudged = _unjudged(user_run, reference, bounds) | _unsure(dataset, reference, bounds)
    if tolerance is None:
        unjudged |= _events_left(scene, observed, bounds)
        if any(scene.observables[name].role is Role.REACTION for name in bounds if name in scene.observables):
            unjudged = {name: why for name, why in unjudged.items() if name not in user_run.reactions}
        unjudged |= dict.fromkeys((name for name in observed if _unknown(reference, name)), _UNDETERMINED)
    parts = (f"parts of {item.judgement.observable}" for item in compared if _in_parts(reference, item))
    unjudged |= dict.fromkeys(parts, _UNDETERMINED)
    for item in compared:  # judged observables, though perhaps derived from other given variables
        unjudged.pop(item.judgement.observable, None)
    bound = step_bound(scene.elements)
    differs = any(item.judgement.verdict is Verdict.DIFFERS for item in compared)
    causes = _causes(reference, user_run, dataset) if differs else []
    return Judged(
        scene=scene.name,
        compared=tuple(compared),
        because=because,
        unjudged=unjudged,
        ended=reference.ended,
        quiet="; ".join(filter(None, (start_words(given_scene, scene, dataset), reference.quiet))),
        step_bound=bound,
        causes=tuple(causes),
    )


def _require_seconds(scene: Scene, run: xr.Dataset) -> None:
    """Raises InputError for times that are farther apart than the scene's motion lasts, if they are milliseconds."""
    times = run["time"].to_numpy()
    if len(times) < 2 or float(np.min(np.diff(times))) < scene.natural_time or "scene_digest" in run.attrs:
        return
    sooner = run.assign_coords(time=times / _MILLI)
    variables = _given(sooner, _truth(scene, times / _MILLI, np.zeros(0)))
    if variables and not any(item.wrong for item in variables.values()):
        advice = "with these times in milliseconds it follows the truth; say --map COLUMN=time[ms], or give seconds"
        raise InputError("run", f"times up to {times[-1]:g} s", advice)


def _given(run: xr.Dataset, true: xr.Dataset) -> dict[str, GivenVariable]:
    """Variables with finite values that a trajectory and the truth have."""
    variables = {}
    for name, item in run.data_vars.items():
        exact = true.variables.get(name)
        if item.dims[:1] == ("time",) and exact is not None and exact.shape == item.shape:
            samples, values = item.to_numpy(), exact.values
            if samples.dtype.kind == "f" and np.isfinite(samples).all() and np.isfinite(values).all():
                samples = turned_alike(samples, values) if exact.dims[-1:] == ("wxyz",) else samples
                variables[str(name)] = GivenVariable(samples, values, str(exact.attrs.get("units", "")))
    return variables


def _causes(reference: Reference, user_run: GivenRun, run: xr.Dataset) -> list[str]:
    """Clauses on typical mistakes in a trajectory that differs, and on causes that its whole state proves."""
    scene, true = reference.scene, reference.dataset
    points = [name for element in scene.elements if isinstance(element, MovesFreely) for name in element.free_points]
    free = [f"{name}.{axis}" for name in points for axis in "xyz"]
    laws = {name for name, item in scene.observables.items() if item.role is Role.RESIDUAL}
    names = (user_run.besides.keys() or set(_states(reference, list(map(str, run.data_vars))))) - laws
    times = run["time"].to_numpy()
    given_columns = {name: item for name, item in _given(run, true).items() if name in names}
    if times[0] > 0 and len(times) > 1 and "scene_digest" not in run.attrs:
        sooner = run.assign_coords(time=times - times[0])
        from_start = _given(sooner, _truth(scene, times - times[0], np.zeros(0)))
        if begun := begun_later(given_columns, from_start, float(times[0])):
            return [begun]
    causes = causes_of(given_columns, times, free)
    if causes or not user_run.twice or not user_run.besides:  # proofroll's own engines have studies that say more
        return causes
    return [item.sentence for item in diagnose_scene(scene, [], run, true)]


def _unjudged(user_run: GivenRun, reference: Reference, judged: Mapping[str, Tolerance]) -> dict[str, str]:
    """Given variable that is not judged -> reason."""
    reasons = {}
    for name, why in user_run.besides.items():
        if not _comparable(reference, name):
            reasons[name] = "the truth has nothing of that name"
        elif why or name not in judged:
            # What follows from the state is judged with it only where places of all bodies are.
            reasons[name] = why if why and REQUIRED[0] in judged else _NO_TOLERANCE
    return reasons


def _events_left(scene: Scene, observed: Mapping[str, FloatArray], judged: Mapping[str, Tolerance]) -> dict[str, str]:
    """Observable of events that is not judged -> reason; for runs without a given tolerance."""
    names = [name for name in observed if scene.observables[name].role is Role.EVENT and name not in judged]
    return dict.fromkeys(names, _NO_TOLERANCE) if any(observed[name].size for name in names) else {}


def _unsure(dataset: xr.Dataset, reference: Reference, judged: Mapping[str, Tolerance]) -> dict[str, str]:
    """Reasons for variables that are sampled too coarsely; a judged one appears as ``turns of NAME``."""
    reasons, variables = {}, dataset.variables
    for name in judged.keys() | {name for name, item in reference.scene.observables.items() if item.headline}:
        if name in variables and UNCERTAIN in variables[name].attrs:
            reasons[f"turns of {name}" if name in judged else name] = str(variables[name].attrs[UNCERTAIN])
    return dict(sorted(reasons.items()))


def _truth(scene: Scene, times: FloatArray, between: FloatArray) -> xr.Dataset:
    """The truth at these times and at samples off the grid, cached, as tests ask for it again and again."""
    key = scene.digest, times.tobytes(), between.tobytes()
    if key not in _truths:
        late = times[0] > 0
        asked = np.concatenate([[0.0], times]) if late else times
        dataset = truth(scene, asked, samples_between(scene, asked), between)
        _truths[key] = dataset.isel(time=slice(1, None)) if late else dataset
        while len(_truths) > _MOST_TRUTHS:
            del _truths[next(iter(_truths))]
    return _truths[key]


def _bounds(
    bounds: Mapping[str, object] | str | Sequence[str] | float | None,
    reference: Reference,
    observed: Mapping[str, FloatArray],
    variables: Sequence[str],
) -> dict[str, Tolerance]:
    """Judged quantity -> its tolerance: observables of a complete run, otherwise variables that the truth has, too."""
    scene = reference.scene
    able = list(dict.fromkeys([*observed, *(name for name in variables if _comparable(reference, name))]))
    if not able:
        names = ", ".join(str(name) for name in reference.dataset.data_vars if _comparable(reference, str(name)))
        advice = f"the truth has none of these; say which is which, as --map theta=q.pivot[deg]; it has {names}"
        raise InputError("run", ", ".join(variables), advice)

    def unit_of(name: str) -> str:
        require_known("tolerance", name, able, "this trajectory has")
        return _unit(reference, name)

    if bounds is None:
        items = {name: scene.observables[name] for name in observed if not _unknown(reference, name)}
        forces = {name for name, item in items.items() if item.role is Role.REACTION and item.unit != "1"}
        main = [name for name, item in items.items() if item.headline or name in forces]
        events = [name for name in observed if (item := scene.observables[name]).watched and item.role is Role.EVENT]
        every = Tolerance(2 * reference.sampled_bar, False, "s")
        tolerances = dict.fromkeys([*main, *_states(reference, variables)] if main else able, _USUAL)
        return tolerances | dict.fromkeys(events, every)
    if bounds and isinstance(bounds, Sequence):
        main = [name for name in dict.fromkeys([scene.deciding, *judged_names(scene)]) if name in observed] or able
        texts = [bounds] if isinstance(bounds, str) else bounds
        return bounds_of(texts, {name: _unit(reference, name) for name in main}, unit_of)
    if not isinstance(bounds, Mapping):
        if len(able) > 1 and scene.deciding not in able:
            raise InputError("tolerance", bounds, f"say of which variable: {', '.join(able)}")
        bounds = {scene.deciding if scene.deciding in able else able[0]: bounds}
    if not bounds:
        raise InputError("tolerance", "{}", "give a tolerance for each quantity")
    units = {name: unit_of(name) for name in bounds}
    return {name: Tolerance.of_quantity(f"tolerance of {name}", text, units[name]) for name, text in bounds.items()}


def _unknown(reference: Reference, name: str) -> bool:
    """True for a force that the truth never knows, as across a line to which joints confine it."""
    return reference.scene.observables[name].role is Role.REACTION and name not in reference.curves


def _in_parts(reference: Reference, item: Compared) -> bool:
    """True for a compared force that the truth determines in some of its components, or at some times, only."""
    name = item.judgement.observable
    lacks = reference.scene.observables.get(name) is None or name in reference.determinate
    variable = reference.dataset.variables.get(name)
    return lacks and variable is not None and bool(np.isnan(variable.values[1:]).any())


def _states(reference: Reference, variables: Sequence[str]) -> list[str]:
    """Given variables of the state, judged directly: positions, velocities, angular velocities and orientations."""
    scene = reference.scene
    states = {scene.label(element, name) for element in scene.elements for name in element.sample_type.widths}
    return [name for name in variables if name in states and _comparable(reference, name)]


def _size(reference: Reference, name: str, true: FloatArray, unit: str) -> float:
    """Size to which a percentage refers, but at least a hundredth of its natural size.

    It is the way of places and angles, and of energies, whose zero is anywhere; the largest value or way of all else.
    """
    if unit == "1":
        return 1.0  # of quaternions
    natural = 0.0
    for element in reference.scene.elements:
        speed = 2 * np.pi / element.natural_time
        sizes = {"m": element.length, "m/s": element.length * speed, "rad/s": speed, "rad": 1.0}
        natural = max(natural, sizes.get(unit, 0.0))
    size = largest_distance(true, reference.vectors(name))
    if unit not in {"m", "rad", "J"}:
        size = max(size, largest_magnitude(true, reference.vectors(name)))
    laws = {key: item for key, item in reference.scene.observables.items() if item.role is Role.RESIDUAL}
    whole = max((reference.sizes.get(key, 0.0) for key, item in laws.items() if item.unit == unit == "J"), default=0.0)
    return max(reference.sizes.get(name, 0.0), size, whole, _LEAST * natural) or 1.0


def _comparable(reference: Reference, name: str) -> bool:
    variables = reference.dataset.variables  # indexing a dataset would make coordinates, too
    return name in variables and "error_bar" in variables[name].attrs


def _unit(reference: Reference, name: str) -> str:
    item = reference.scene.observables.get(name)
    return item.unit if item else str(reference.dataset.variables[name].attrs["units"])


def _compared(
    name: str, bound: Tolerance, reference: Reference, observed: Mapping[str, FloatArray], dataset: xr.Dataset
) -> Compared:
    item, unit, variables = reference.scene.observables.get(name), _unit(reference, name), dataset.variables
    times = variables["time"].values
    if name in observed:
        run = run_values.run_curve(reference, name, observed[name], dataset)
        true, scale = reference.true(name, run.values), reference.sizes.get(name, 1.0)
    else:
        values, truth_of = variables[name].values, reference.dataset.variables[name]
        true_values = truth_of.values
        if item and item.role is Role.REACTION and times[0] == 0:
            true_values, values = (
                true_values[1:],
                values[1:],
            )  # several engines define reactions only after a first step
        if truth_of.dims[-1:] == ("wxyz",):
            values = turned_alike(values, true_values)
        if (
            name not in reference.curves and values.shape == true_values.shape
        ):  # of forces, where they are not determinate
            determinate = np.isfinite(true_values)
            values, true_values = np.where(determinate, values, 0.0), np.where(determinate, true_values, 0.0)
        between, vectors = run_values.values_off_grid(reference, name, dataset), reference.vectors(name)
        run = RunCurve(values, between=between, vectors=vectors)
        true, scale = (
            TrueCurve(true_values, float(truth_of.attrs["error_bar"])),
            _size(reference, name, true_values, unit),
        )
    judgement = judge_curve(Allowance(name, unit, bound.absolute(scale), scale), run, true)
    return Compared(judgement, _farthest(run, true.values, times), _lost(run.values))


def _lost(values: FloatArray) -> str:
    """Words on the rows of a curve that are not finite; empty: at most one is not."""
    count = sum(not np.isfinite(row).all() for row in values)
    return f" in {count} of {len(values)} rows, first" if count > 1 else ""


def _against_state(
    user_run: GivenRun, reference: Reference, bounds: Mapping[str, Tolerance]
) -> Iterator[tuple[str, Compared]]:
    """Given columns that contradict the state of the same trajectory, which is judged."""
    times = user_run.dataset.variables["time"].values
    on = np.isin(times, reference.dataset.variables["time"].values[impact_samples(reference.scene, reference.dataset)])
    for name, (values, follows) in user_run.twice.items():
        if not _comparable(reference, name) or (name in bounds and not user_run.besides):
            continue  # of a run of proofroll's own the column itself is judged
        unit, vectors = _unit(reference, name), reference.vectors(name)
        scale = _size(reference, name, follows, unit)
        allowance = Allowance(name, unit, bounds.get(name, _USUAL).absolute(scale), scale)
        jumps = on.reshape(-1, *[1] * (values.ndim - 1)) & (unit not in CONTINUOUS)
        curve = RunCurve(np.where(jumps, follows, values), vectors=vectors)
        bar = float(reference.dataset.variables[name].attrs["error_bar"])
        judgement = judge_curve(allowance, curve, TrueCurve(follows, bar))
        if judgement.verdict is Verdict.DIFFERS:
            judgement = replace(judgement, remarks=(*judgement.remarks, _CONTRADICTS))
            yield name, Compared(judgement, _farthest(curve, follows, times))


def _farthest(run: RunCurve, true: FloatArray, times: FloatArray) -> float | None:
    """Time of the largest difference of two curves, or of the first that is not finite [s]; None if undefined."""
    values = run.values
    if values.shape != true.shape or not values.size or len(values) not in {len(times), len(times) - 1}:
        return None
    apart = magnitudes(values - true, run.vectors).max(axis=1, initial=0.0)
    finite, sampled = np.isfinite(apart), times[len(times) - len(values) :]
    return float(sampled[int(np.argmax(apart) if finite.all() else np.argmin(finite))])
