"""The check of one robot file: what each engine holds, where it differs, and why."""

from __future__ import annotations

import dataclasses
import os
import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from proofroll.core.errors import InputError, Missing
from proofroll.core.plugins import EngineSpec, parse_engine, place_of, plain_name
from proofroll.robots import reading
from proofroll.robots.body_recursion import body_recursion
from proofroll.robots.judging import TIME_LIMIT, judged, meaning, unread
from proofroll.robots.layers import LAYERS, RobotTruth
from proofroll.robots.lint import lint
from proofroll.robots.protocol import Request
from proofroll.robots.robot_file import RobotFile, open_robot
from proofroll.robots.states import RobotStates, random_states
from proofroll.robots.two_formulations import poses
from proofroll.robots.urdf import BASE_JOINT
from proofroll.running.interpreters import start
from proofroll.running.process import WorkerDied


def check(
    path: Path,
    engines: Sequence[str] = (),
    *,
    base: str = "fixed",
    states: int = 20,
    seed: int = 0,
    time_limit: float = TIME_LIMIT,
    progress: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """Reads a file with every engine and compares what each holds with what the file says.

    Args:
        path: of a URDF or MJCF.
        engines: ``name`` or ``name[option=true,…]``; by default all whose readers are installed.
        base: what carries the root of a URDF, ``fixed`` or ``free``.
        states: how many random states are compared.
        seed: of the states.
        time_limit: for each engine [s].
        progress: called with the name of an engine that has been asked.

    Returns:
        plain data: file, kind, base, lint, truth, robot, engines.

    Raises:
        InputError: the file, an engine or an option is wrong.
    """
    specs = [parse_engine(text) for text in engines or reading.reader_names()]
    for spec in specs:
        if not place_of(spec.name) and spec.name not in reading.reader_names():
            raise InputError(
                "engine", spec.name, f"it reads no robot files; choose one of {', '.join(reading.reader_names())}"
            )
        reading.options_of(spec.options, spec.name)
    file = open_robot(path, base)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        written = reading.write(file, folder)
        robot, compiler = meaning(file, written, time_limit)
        by = f"the model that {compiler} compiles" if compiler else "our own reading of the file"
        if not robot.moving:
            raise InputError("file", str(path), "nothing in it moves" + _fixed_hint(file))
        sampled = random_states(robot, states, seed)
        truth = RobotTruth.of(robot, sampled)
        bar = _bar(truth)
        torques = truth.torques()
        children = {joint.name: joint.child for joint in robot.moving}
        request = Request(written, file.kind, base, BASE_JOINT, {}, children, sampled, torques, robot.gravity, robot)

        def one(item: tuple[int, EngineSpec]) -> dict[str, Any]:
            place = folder / str(item[0])
            place.mkdir()
            options = reading.options_of(item[1].options, item[1].name)
            row = _row(
                file,
                truth,
                bar,
                dataclasses.replace(request, options=options),
                item[1],
                place,
                time_limit,
                bool(engines),
            )
            if progress is not None:
                progress(str(item[1]))
            return row

        with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
            rows = list(pool.map(one, enumerate(specs)))
        for row in rows:
            _say_whose_truth(row, compiler, by)
    return {
        "file": str(path),
        "kind": file.kind,
        "base": base if file.kind == "urdf" else "as in the file",
        "lint": [dataclasses.asdict(finding) for finding in (*file.findings, *lint(file, robot))],
        "truth": {"by": by, "difference": bar, "states": states, "seed": seed, "velocities": robot.dofs},
        "layers": LAYERS,
        "engines": rows,
        "robot": _skeleton(truth),
    }


def _say_whose_truth(row: dict[str, Any], compiler: str, by: str) -> None:
    """An engine that defines the format is held against itself, unless it is of another version."""
    engine, _, version = compiler.partition(" ")
    if plain_name(parse_engine(row["engine"]).name) == engine and row["version"] not in {None, version}:
        row["says"] = f"{row['says']}; held against {by}".removeprefix("; ")


def differs(row: dict[str, Any]) -> bool:
    """Whether an engine does not hold the model that the file describes: another one, or none."""
    return row["status"] not in {"holds", "missing"}


def _fixed_hint(file: RobotFile) -> str:
    return "; try --base free" if file.kind == "urdf" and file.base == "fixed" else ""


def _bar(truth: RobotTruth) -> float:
    """The largest relative difference of the two formulations."""
    one, other = truth.dynamics, body_recursion(truth.robot, truth.states)
    pairs = ((one.M, other.M), (one.g, other.g), (one.h, other.h))
    return max(float(np.abs(a - b).max() / (np.abs(b).max() or 1.0)) for a, b in pairs)


def _row(
    file: RobotFile,
    truth: RobotTruth,
    bar: float,
    request: Request,
    spec: EngineSpec,
    folder: Path,
    limit: float,
    asked: bool,
) -> dict[str, Any]:
    """One engine."""
    try:
        with start(spec.name) as worker:
            answer = reading.ask(worker, spec.name, request, folder, limit)
    except Missing as error:
        if asked:
            raise
        return unread(spec, "missing", str(error))
    except WorkerDied as error:
        return unread(spec, str(error.status), str(error))
    return judged(file, truth, bar, spec, answer, dict(request.torques))


def _skeleton(truth: RobotTruth) -> dict[str, Any]:
    """Where every body is at rest coordinates, for a drawing."""
    robot = truth.robot
    zero = {joint.name: np.zeros(1) for joint in robot.moving}
    upright = {joint.name: np.eye(3)[None] for joint in robot.moving}
    origin = {joint.name: np.zeros((1, 3)) for joint in robot.moving}
    still = {joint.name: np.zeros((1, joint.dofs)) for joint in robot.moving}
    placed = poses(robot, RobotStates(zero, upright, origin, still, still))
    return {
        "name": robot.name,
        "joints": [
            {"name": joint.name, "kind": joint.kind, "parent": joint.parent, "child": joint.child}
            for joint in robot.joints
        ],
        "bodies": {
            name: {"position": placed[name][0][0].tolist(), "mass": body.mass} for name, body in robot.bodies.items()
        },
    }  # fmt: skip
