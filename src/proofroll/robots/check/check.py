"""Check of one robot file: each engine's model of it, the differences, and their causes."""

import dataclasses
import os
import tempfile
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from proofroll.core.errors import InputError, Missing, require_known
from proofroll.core.plugins import EngineSpec, engine_names, parse_engine, place_of, plain_name
from proofroll.files.toml import read_toml
from proofroll.robots.check.body_recursion import body_recursion, poses
from proofroll.robots.check.importer_row import importer_row, row_with_copy
from proofroll.robots.check.layers import LAYERS, RobotTruth
from proofroll.robots.check.lint import lint
from proofroll.robots.check.records import DrawnBody, DrawnJoint, DrawnRobot, ImporterRow, RobotCheck, UsedTruth
from proofroll.robots.files import reading
from proofroll.robots.files.meaning import USUAL, CheckSettings, moving_robot, source_of
from proofroll.robots.files.mjcf.compiler import Compiler
from proofroll.robots.files.robot_file import RobotFile
from proofroll.robots.files.urdf import BASE_JOINT
from proofroll.robots.hypotheses import hypotheses
from proofroll.robots.model import RobotJoint
from proofroll.robots.protocol import GROUP, Request
from proofroll.robots.states import RobotStates, random_states
from proofroll.running.engine_questions import lent_workers
from proofroll.running.idle_workers import Workers
from proofroll.running.process import Worker, WorkerDied


def check(
    path: Path,
    engines: Sequence[str] = (),
    settings: CheckSettings = USUAL,
    *,
    accept: Sequence[str] = (),
    progress: Callable[[str], None] | None = None,
    workers: Workers | None = None,
) -> RobotCheck:
    """Comparison of every engine's reading of a file with the file's meaning.

    Args:
        path: path of a URDF or MJCF.
        engines: ``name`` or ``name[option=true,…]``; by default all with an installed reader.
        settings: base of the robot, states and limit of time.
        accept: ids of accepted causes of differences; those in ``ROBOT.accept.toml`` beside the file are added.
        progress: called with the name of each engine that is done.
        workers: processes in which engines read; by default new ones that end with this call.

    Raises:
        InputError: the file, an engine or an option is wrong.
    """
    accepted = _accepted(path, accept)
    asked = []
    for spec in map(parse_engine, engines or engine_names(GROUP)):
        if not place_of(spec.name):
            reading.require_reader(spec.name)
        asked.append((spec, reading.options_of(spec.options, spec.name)))
    with lent_workers(workers) as lent, tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        file, written, robot, compiler = moving_robot(path, settings, lent, folder)
        truth = RobotTruth.of(robot, random_states(robot, settings.states, settings.seed))
        checked = _Checked(
            path=path,
            file=file,
            written=written,
            settings=settings,
            truth=truth,
            bar=bar_of(truth),
            compiler=compiler,
            folder=folder,
            workers=lent,
        )

        def row(item: tuple[EngineSpec, dict[str, bool]]) -> ImporterRow:
            try:
                importer = checked.row(*item)
            except Missing as error:
                if engines:
                    raise
                importer = ImporterRow(engine=str(item[0]), status="missing", message=str(error))
            if progress is not None:
                progress(importer.engine)
            return dataclasses.replace(importer, accepted=all(cause.id in accepted for cause in importer.causes))

        with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
            rows = list(pool.map(row, asked))
    return RobotCheck(
        file=str(path),
        kind=file.kind,
        base=settings.base if file.kind == "urdf" else "as in the file",
        lint=[*file.remarks, *lint(file, robot)],
        truth=UsedTruth(
            by=source_of(compiler),
            difference=checked.bar,
            states=settings.states,
            seed=settings.seed,
            velocities=robot.dofs,
        ),
        layers=LAYERS,
        engines=rows,
        robot=robot_drawing(truth),
    )


@dataclass(frozen=True)
class _Checked:
    """Data for the row of each engine.

    Attributes:
        path, file: path of the user's file, and its content.
        written: path of the copy that engines read.
        settings: base of the robot and limit of time.
        truth: the file's meaning at random states.
        bar: relative error bar of the truth.
        compiler: the engine that defines the format, if its compiler gave the meaning.
        folder: folder for the files of engines.
        workers: processes in which engines read.
    """

    path: Path
    file: RobotFile
    written: Path
    settings: CheckSettings
    truth: RobotTruth
    bar: float
    compiler: Compiler | None
    folder: Path
    workers: Workers

    def row(self, spec: EngineSpec, options: dict[str, bool]) -> ImporterRow:
        """Row of an engine, also of one that refuses, crashes or runs out of time.

        Raises:
            Missing: the engine is not installed.
        """

        def ask(path: Path) -> reading.ReaderAnswer:
            with self._lent(spec) as (worker, folder):
                request = self._request(options, path)
                return reading.ask(worker, spec.name, request, folder, self.settings.time_limit)

        try:
            answer = ask(self.written)
        except WorkerDied as error:
            return ImporterRow(engine=str(spec), status=str(error.status), message=str(error))
        try:
            importer = importer_row(self.file, self.truth, self.bar, spec, answer, self.workers, ask)
        except Exception as error:  # one engine's odd answer must not end the rows of the others
            message = f"its answer could not be judged; please report this: {type(error).__name__}: {error}"
            return ImporterRow(engine=str(spec), status="crashed", version=answer.version, message=message)
        # The engine that defines the format, in another version than the one that gave the meaning.
        compiler = self.compiler
        if compiler and plain_name(spec.name) == compiler.engine and answer.version != compiler.version:
            says = f"{importer.says}; held against {source_of(compiler)}".removeprefix("; ")
            importer = dataclasses.replace(importer, says=says)
        return dataclasses.replace(importer, as_written=self._as_written(spec, options, importer))

    def _as_written(self, spec: EngineSpec, options: dict[str, bool], importer: ImporterRow) -> str | None:
        """Clause on the engine's reading of the user's own file instead of the copy; None: not tried or not offered."""
        if not self.file.contained or importer.version is None:
            return None
        try:
            with self._lent(spec) as (worker, folder):
                request = self._request(options, self.written)
                answer = reading.ask_as_written(worker, spec.name, request, self.path, folder, self.settings.time_limit)
        except WorkerDied as error:
            return f"its process ended ({error})"
        return None if answer is None else row_with_copy(answer, importer)

    @contextmanager
    def _lent(self, spec: EngineSpec) -> Iterator[tuple[Worker, Path]]:
        with self.workers.lend(spec.name) as worker, tempfile.TemporaryDirectory(dir=self.folder) as folder:
            yield worker, Path(folder)

    def _request(self, options: dict[str, bool], path: Path) -> Request:
        robot, truth = self.truth.robot, self.truth
        children = {joint.name: joint.child for joint in robot.moving}
        return Request(
            path=path, kind=self.file.kind, base=self.settings.base, base_joint=BASE_JOINT, options=options,
            children=children, states=truth.states, torques=truth.torques, gravity=robot.gravity, robot=robot,
        )  # fmt: skip


def _accepted(path: Path, causes: Sequence[str]) -> set[str]:
    """Ids of accepted causes: those given, and ``causes = ["..."]`` in the ``.accept.toml`` beside the robot's file."""
    beside = path.with_suffix(".accept.toml")
    written = read_toml(beside).get("causes", []) if beside.is_file() else []
    if not isinstance(written, list):
        raise InputError(f"{beside}: causes", written, 'write a list of causes, ["damping_left_out"]')
    ids = [item.id for item in hypotheses()]
    for origin, names in (("--accept", causes), (f"{beside}: causes", written)):
        for name in names:
            require_known(origin, str(name), ids, "there is no such cause; choose from")
    return {*causes, *written}


def bar_of(truth: RobotTruth) -> float:
    """Error bar of a truth: the largest difference of its two formulations, relative to the scale of its layer."""
    first, second = truth.dynamics, body_recursion(truth.robot, truth.states)
    off = {"mass matrix": first.M - second.M, "gravity": first.g - second.g, "bias": first.h - second.h}
    return max(float(np.abs(values).max()) / truth.scales[layer] for layer, values in off.items())


def robot_drawing(truth: RobotTruth) -> DrawnRobot:
    """Drawing of a robot: every body at rest coordinates."""
    robot = truth.robot
    zero = {joint.name: np.zeros(1) for joint in robot.moving}
    upright = {joint.name: np.eye(3)[None] for joint in robot.moving}
    origin = {joint.name: np.zeros((1, 3)) for joint in robot.moving}
    rest = {joint.name: np.zeros((1, joint.dofs)) for joint in robot.moving}
    frames = poses(robot, RobotStates(angle=zero, rotation=upright, position=origin, velocity=rest, acceleration=rest))
    placed = {name: (p[0], R[0]) for name, (p, R) in frames.items()}

    def drawn_joint(joint: RobotJoint) -> DrawnJoint:
        p, R = placed[joint.child]
        return DrawnJoint(
            name=joint.name,
            kind=joint.kind,
            parent=joint.parent,
            child=joint.child,
            position=(p + R @ joint.child_position).tolist(),
            axis=(R @ joint.axis).tolist() if joint.dofs == 1 else None,
        )

    bodies = {}
    for name, body in robot.bodies.items():
        p, R = placed[name]
        bodies[name] = DrawnBody(position=p.tolist(), centre=(p + R @ body.com).tolist(), mass=body.mass)
    return DrawnRobot(robot.name, [drawn_joint(joint) for joint in robot.joints], bodies)
