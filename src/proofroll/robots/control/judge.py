"""Judgement of a record of a robot under a controller, from any simulator or a real robot."""

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from proofroll.core.errors import InputError
from proofroll.core.number_format import counted, error
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.run.step_limits import servo_steps
from proofroll.robots.control.base_frames import BaseFrame
from proofroll.robots.control.bookkeeping.law import ControlLaw
from proofroll.robots.control.bookkeeping.mistakes import LAYERS, SEARCH_TIME, SearchTime
from proofroll.robots.control.columns import (
    StateReading,
    framed_readings,
    reading_in_degrees,
    readings_by_frames,
    readings_of_early_rates,
    readings_of_late_efforts,
    state_readings,
    untold_lags,
)
from proofroll.robots.control.controlled import MOST, ControlledScenes
from proofroll.robots.control.differences import DIFFERENCES
from proofroll.robots.control.layers import InAir, record_layers
from proofroll.robots.control.record import BASE, FITTED, ControlRecord, Layer, read_record, record_of
from proofroll.robots.control.record_arrays import ARRAYS, LAYOUTS, columns_of, floats, read_arrays

_Judged = tuple[StateReading, list[Layer]]
_LAGS = ("late", "early")  # ids of rates at other rows
_OF_JOINTS = {"instants", "target", "effort"}  # layers that are computed without the base, where actions are recorded
_BASE = {name[:4] for name in BASE}
_SAME_STEP = 1e-3  # part of the interval between rows by which the step of the program may differ from it


@dataclass(frozen=True)
class RecordJudgement:
    """Layers of a record.

    Attributes:
        record, robot, control: files; an empty ``control``: there is none.
        base: ``free`` or ``fixed``, as the record has columns of a base or not.
        rows: number of times.
        step: mean interval between them [s].
        layers: in their order.
        remarks: sentences on limits of the robot file that the record passes.
        step_bound: clause on the longest stable step of explicit servos, if the rows are farther apart; else empty.
    """

    record: str
    robot: str
    control: str
    base: str
    rows: int
    step: float
    layers: Sequence[Layer]
    remarks: Sequence[str] = ()
    step_bound: str = ""

    @property
    def agrees(self) -> bool:
        """True if every layer that was looked at holds."""
        return all(layer.holds for layer in self.layers)

    @property
    def looked_at(self) -> bool:
        """True if at least one layer was looked at."""
        return any(layer.residual is not None for layer in self.layers)

    @property
    def decided(self) -> bool:
        """True if no layer differs without the record telling whether that counts."""
        return not any(layer.undecided for layer in self.layers)

    def lines(self) -> Iterator[str]:
        """Lines of text: a headline, one for each layer, and the causes at the first that does not hold."""
        failed_layer = next((layer for layer in self.layers if not layer.holds), None)
        rows = f"{counted(self.rows, 'rows')} every {self.step:.4g} s, {self.base} base"
        if self.step_bound:
            yield f"{self.step_bound}."
        if not self.looked_at:
            yield f"{self.record} ({rows}): no layer could be looked at"
        elif failed_layer is None and not self.decided:
            undecided = next(layer.name for layer in self.layers if layer.undecided)
            yield f"{self.record} ({rows}): the {undecided} is not decided; every other layer that was looked at holds"
        elif failed_layer is None:
            yield f"{self.record} ({rows}): every layer that was looked at holds"
        else:
            yield f"{self.record} ({rows}): the {failed_layer.name} is the first layer that does not hold"
        for layer in self.layers:
            yield f"  {_mark(layer)} {layer.name} ({LAYERS[layer.name]}): {_found(layer)}"
            if layer.noise or (not layer.holds and (layer is failed_layer or layer.causes)):
                shown = layer.causes if layer.noise else layer.causes[:3]
                yield from (f"       {cause.sentence}" for cause in shown)
                if not (layer.causes or layer.noise):
                    yield f"       {_unexplained(layer)}"
        yield from self.remarks


def _unexplained(layer: Layer) -> str:
    if layer.tried >= layer.known:
        return f"none of {counted(layer.tried, 'known mistakes')} explains it"
    return (
        f"none of {layer.tried} of {counted(layer.known, 'known mistakes')} explains it; the search ended after "
        f"{SEARCH_TIME:.0f} s of processor time"
    )


def _mark(layer: Layer) -> str:
    return "?" if layer.undecided else "–" if layer.residual is None else "✓" if layer.holds else "✗"


def _found(layer: Layer) -> str:
    if layer.residual is None:
        return layer.reason
    place = "" if layer.holds else f", most in {layer.column}"
    place += f" at {layer.time:.4g} s" if place and np.isfinite(layer.time) else ""
    remark = f"; {layer.reason}" if layer.reason else ""
    return f"off by {error(layer.residual)}, rounding {error(layer.bar)}{place}{remark}"


def judge_record(
    record: Path, robot: Path, control: Path | None, names: Mapping[str, str] | None = None, layout: str = ""
) -> RecordJudgement:
    """Judges a record by layers, without a simulation; a robot whose record has columns of a base is free.

    Args:
        record: file of the record.
        robot: file of the robot.
        control: file of its controller; None: its efforts are known from the record alone.
        names: column of the record -> its name here, perhaps with its unit, ``q.hip[deg]``.
        layout: program whose arrays the record has (:data:`.LAYOUTS`); empty: it has columns.

    Raises:
        InputError: a file is wrong, or they do not fit.
    """
    time = SearchTime(SEARCH_TIME)
    scenes = ControlledScenes(control)
    law_of = ControlLaw.of if control else ControlLaw.of_efforts
    stepwise, assumed = False, ""
    if layout:
        if names:
            raise InputError("--map", ", ".join(names), f"--as {layout} names the arrays; leave one of both out")
        arrays = read_arrays(record)
        fixed_robot = scenes.of_record(robot, free=False).mechanism
        free = floats(arrays, layout, sum(joint.nq == 1 for joint in fixed_robot.joints))
        model = scenes.of_record(robot, free=free)
        driven = law_of(model.mechanism).joints
        if control and LAYOUTS[layout].from_refs and model.refs:
            _refuse_refs(control, model.refs)
        times, columns = columns_of(record, arrays, layout, model.mechanism, driven, model.refs)
        eps = [float(np.finfo(item.dtype).eps) for item in arrays.values() if item.dtype.kind == "f"]
        digits = max(eps, default=0.0) / 2
        read = record_of(times, columns, record, digits=digits)
        usual = LAYOUTS[layout].step
        if "sim_dt" in arrays:
            step = arrays["sim_dt"]
            if step.size != 1 or step.dtype.kind not in "fiu":
                raise InputError("sim_dt", record, "it has to be one number, the step of the simulator in seconds")
            stepwise = _are_steps(read, float(step.ravel()[0]))
        elif usual is not None and _are_steps(read, usual):
            rows = f"rows are {usual:.4g} s apart, the usual step of {layout}"
            assumed = f"{rows}: if it stepped so, add sim_dt = {usual:.7g} to the file; else log every step"
    else:
        if record.suffix in ARRAYS:
            raise InputError("--as", "", f"say whose arrays these are: {', '.join(LAYOUTS)}")
        read = read_record(record, names or {})
        free = any(name.startswith("q_WB.") for name in read.columns)
        model = scenes.of_record(robot, free=free)
    law = law_of(model.mechanism)
    law = law.change(reductions=np.array([model.reductions.get(joint, 1.0) for joint in law.joints]))
    names_of_layers = DIFFERENCES if control else ()

    robots: dict[int, tuple[StateReading, InAir]] = {}  # by the identity of a reading, which they keep

    def layers_of(reading: StateReading, within: SearchTime, imported: int = 0) -> list[Layer]:
        state_layers = [] if reading.layer is None else [reading.layer]
        if id(reading) not in robots:
            robots[id(reading)] = (
                reading,
                InAir(
                    held=model.held(reading.frame),
                    reported=reading.reported,
                    stepped=model.held(None) if reading.frame is not None else None,
                    ranges=model.ranges,
                    assumed=assumed,
                ),
            )
        held = replace(robots[id(reading)][1], imported=partial(model.imported, reading.frame, imported))
        return [
            *state_layers,
            *record_layers(
                reading.record,
                law,
                model.mechanism,
                grounded=model.grounded,
                names=names_of_layers,
                stepwise=stepwise,
                in_air=held,
                time=within,
            ),
        ]

    inertial, frames = bool(layout) and LAYOUTS[layout].inertial and free, model.base_frames
    readings = framed_readings(read, law, frames) if inertial else state_readings(read, law)
    reading, layers = _best_reading(
        readings, layers_of, () if inertial else frames, time, controlled=control is not None
    )
    read = reading.record
    told = " ".join(cause.sentence for cause in reading.layer.causes if cause.id in _LAGS) if reading.layer else ""
    lags = " and ".join(name for name in untold_lags(read) if name not in told)
    untold = [f"the digits of the record do not tell whether {lags} may be a row late"] if lags else []
    return RecordJudgement(
        record=str(record),
        robot=str(robot),
        control=str(control or ""),
        base="free" if free else "fixed",
        rows=len(read.time),
        step=_step(read),
        layers=layers,
        remarks=[*_too_fast(read, model.speeds), *untold],
        step_bound=_step_bound(model.mechanism, _step(read)),
    )


def _best_reading(
    readings: Sequence[StateReading],
    layers_of: Callable[..., list[Layer]],
    frames: Sequence[BaseFrame],
    time: SearchTime,
    *,
    controlled: bool,
) -> _Judged:
    """Reading of a record with the fewest open layers, and these layers; all searches share one time.

    Of readings that explain the state alike, layers behind it tell the right one. Mistakes that the state does not show
    are tried where these are open, and count if they leave none of them open.

    Args:
        readings: by the state.
        layers_of: layers of a reading, for a time of the search.
        frames: frames that the record may have for its base.
        time: of all searches.
        controlled: True if a controller's law tells the efforts.
    """
    judged = _searched(readings, layers_of, time)
    plain = min(judged, key=_rank)
    silent: list[_Judged] = []

    def best() -> _Judged:
        """Best of the readings by the state, and of the silent ones that close all layers."""
        return min([*judged, *(item for item in silent if not _open_layers(item[1]))], key=_rank)

    def try_rivals(rivals: Iterable[StateReading]) -> None:
        """Adds readings that look at every layer that is open without them.

        Mistakes are searched for where forces are explained, and no layer is open that the readings leave as it is.
        """
        for rival in itertools.takewhile(lambda _: not time.over, rivals):
            layers = layers_of(rival, SearchTime(0.0))
            others = {name: item for name, item in rival.record.columns.items() if name[:4] not in _BASE}
            alike = all(plain[0].record.columns.get(name) is item for name, item in others.items())
            same = _OF_JOINTS if alike else set[str]()
            if not _open_layers(layers) & ({"acceleration"} | (_open_layers(plain[1]) & same)):
                layers = layers_of(rival, time)
            if _open_layers(plain[1]) <= {item.name for item in layers if item.residual is not None or item.undecided}:
                silent.append((rival, layers))

    if any(_open(plain)):
        in_degrees = [_beside(item, lambda record: filter(None, [reading_in_degrees(record)])) for item, _ in judged]
        try_rivals(itertools.chain.from_iterable(in_degrees))
    if _unexplained_forces(best()[1]):
        try_rivals(_beside(plain[0], lambda record: readings_by_frames(record, frames)))
    if _unexplained_forces(best()[1]) and not controlled:
        late = [_beside(rival, readings_of_late_efforts) for rival, _ in (*judged, *silent)]
        try_rivals(itertools.chain.from_iterable(late))
    if _open(best())[0]:
        try_rivals(_beside(plain[0], readings_of_early_rates))
    if not _told(best()):
        rivals = (rival for rival, _ in (*judged, *silent))
        candidates = sorted(rivals, key=lambda rival: len(rival.layer.causes) if rival.layer else 0)
        by_state = {id(rival) for rival, _ in judged}
        trials = _of_importers(candidates, partial(layers_of, within=time), time)
        silent.extend(item for item in trials if id(item[0]) not in by_state)
        judged = [*(item for item in trials if id(item[0]) in by_state), *judged]
    return best()


def _of_importers(
    readings: Sequence[StateReading], layers_of: Callable[..., list[Layer]], time: SearchTime
) -> list[_Judged]:
    """Readings whose forces are held against robots of importers, up to the first that one explains.

    Robots by one cause are tried with every reading before those by two.
    """
    trials: list[_Judged] = []
    for count in range(1, MOST + 1):
        for reading in readings:
            trials.append((reading, layers_of(reading, imported=count)))
            if _told(trials[-1]):
                return [(reading, layers_of(reading, imported=MOST))]
            if time.over:
                return trials
    return trials


def _searched(
    readings: Sequence[StateReading], layers_of: Callable[..., list[Layer]], time: SearchTime
) -> list[_Judged]:
    """Readings with their layers; the search has time first for those that hold in more layers without a mistake."""
    if len(readings) == 1:
        return [(readings[0], layers_of(readings[0], time))]
    judged = [(reading, layers_of(reading, SearchTime(0.0))) for reading in readings]
    if any(_open(min(judged, key=_open))):
        for k in sorted(range(len(judged)), key=lambda k: _open(judged[k])):
            judged[k] = (readings[k], layers_of(readings[k], time))
    return judged


def _beside(
    reading: StateReading, readings_of: Callable[[ControlRecord], Iterable[StateReading]]
) -> Iterator[StateReading]:
    """Readings of a record by further mistakes, with the frame of its base and the mistakes that it has."""
    for rival in readings_of(reading.reported or reading.record):
        layer, record, frame, reported = rival.layer, rival.record, rival.frame, rival.reported
        if reading.frame is not None:
            record, frame, reported = reading.frame.corrected(record), reading.frame, record
        if reading.layer is not None and layer is not None:
            layer = replace(reading.layer, causes=(*reading.layer.causes, *layer.causes))
        yield StateReading(record, layer, frame, reported)


def _told(judged: _Judged) -> bool:
    """True if forces are explained without a fitted inertia."""
    return not (_unexplained_forces(judged[1]) or _open(judged)[2])


def _open_layers(layers: Sequence[Layer]) -> set[str]:
    """Names of layers that differ without a cause."""
    return {
        layer.name
        for layer in layers
        if (layer.undecided and not layer.noise if layer.residual is None else not (layer.holds or layer.causes))
    }


def _refuse_refs(control: Path, refs: Mapping[str, float]) -> None:
    """Raises InputError: poses and observations of a controller count from elsewhere than the arrays."""
    joint, ref = next(iter(refs.items()))
    advice = (
        f"{joint} has ref = {ref:.5g} in the robot's file: qpos counts from there, and a controller's poses, targets "
        "and observations from the file's pose; give a .csv with q.JOINT and target.JOINT less ref, or omit --control"
    )
    raise InputError("--control", control, advice)


def _unexplained_forces(layers: Sequence[Layer]) -> bool:
    """True if accelerations or a motion differ, and nothing is known that explains it."""
    return bool(_open_layers(layers) & {"acceleration", "motion"})


def _open(judged: _Judged) -> tuple[int, int, int]:
    """Number of layers that are not explained or not decided, that do not hold, and that a fitted inertia explains."""
    _, layers = judged
    failed = [layer for layer in layers if not layer.holds]
    fitted = sum(cause.id == FITTED for layer in failed for cause in layer.causes)
    return len(_open_layers(layers)), len(failed), fitted


def _rank(judged: _Judged) -> tuple[int, ...]:
    """Number by which readings are sorted, the best first; of equal ones that in which most mistakes were tried."""
    return (*_open(judged), -sum(layer.tried for layer in judged[1]))


def _step_bound(mechanism: Mechanism, step: float) -> str:
    """Clause on the longest stable step of explicit servos, if rows are farther apart [s]; else empty."""
    bounds = servo_steps(JointCoordinates(mechanism))
    if bounds is None or step <= bounds.explicit:
        return ""
    rows = f"rows are {step:.4g} s apart, {step / bounds.explicit:.2g} times that"
    return f"{bounds.sentence(())}; {rows}: too much if the program steps so"


def _too_fast(record: ControlRecord, speeds: Mapping[str, float]) -> Iterator[str]:
    """A sentence for each joint that passes the velocity limit of its drive."""
    for joint, limit in speeds.items():
        sizes = np.abs(record.columns.get(f"v.{joint}", np.zeros(1)))
        if sizes.max() > limit:
            instant = record.time[int(np.argmax(sizes > limit))]
            yield (
                f"v.{joint} passes the velocity limit {limit:.4g} of the robot's file at {instant:.4g} s; a program "
                "that clamps velocities moves it otherwise"
            )


def _are_steps(record: ControlRecord, step: float) -> bool:
    """True if the rows of a record are steps of a length [s]."""
    return bool(np.isclose(step, _step(record), rtol=_SAME_STEP))


def _step(record: ControlRecord) -> float:
    return float(record.time[-1] - record.time[0]) / (len(record.time) - 1)
