"""Comparison of two files of one robot: differences of their models, and values that differ."""

import contextlib
import dataclasses
import math
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from proofroll.core.errors import InputError, require_known
from proofroll.core.plugins import EngineSpec
from proofroll.robots import reading
from proofroll.robots.body_recursion import body_recursion
from proofroll.robots.check import bar_of, robot_drawing
from proofroll.robots.importer_row import importer_row
from proofroll.robots.layers import LAYERS, RobotTruth
from proofroll.robots.lint import lint
from proofroll.robots.meaning import USUAL, CheckSettings, moving_robot, source_of
from proofroll.robots.model import Array, Mimic, Robot
from proofroll.robots.protocol import Reading
from proofroll.robots.records import AgainstCheck, ImporterRow, UnlikeValue, UsedTruth
from proofroll.robots.robot_file import LintRemark, RobotFile
from proofroll.robots.states import random_states
from proofroll.robots.two_formulations import passive, poses
from proofroll.running.engine_questions import lent_workers
from proofroll.running.idle_workers import Workers

# Relative difference of two values above which it is reported: files are written with different rounding.
_ROUNDING = 1e-9


def against(
    path: Path, other: Path, names: Mapping[str, str] | None = None, settings: CheckSettings = USUAL
) -> AgainstCheck:
    """Compares the model of a second file with that of the first, at random states of the first.

    Args:
        path: path of a URDF or MJCF, which counts as true.
        other: path of the other file.
        names: joint of the first -> joint of the second, where they have different names.
        settings: base of the robots, states and limit of time.

    Raises:
        InputError: a file is wrong, or has no joint of a given name.
    """
    with lent_workers(None) as workers:
        (file, robot, by), (second, other_robot, by_other) = (_meant(each, settings, workers) for each in (path, other))
        matched = _matched(robot, other_robot, names or {})
        renamed = _renamed(other_robot, matched)
        truth = RobotTruth.of(robot, random_states(robot, settings.states, settings.seed))
        bar = bar_of(truth)
        other_label, label = (each.name if path.name != other.name else str(each) for each in (other, path))
        rows = [importer_row(file, truth, bar, EngineSpec(other_label, {}), _answer(renamed, truth), workers)]
        if rows[0].unexplained:  # with the second file as truth, causes in that file can be found
            turned = RobotTruth.of(renamed, random_states(renamed, settings.states, settings.seed))
            row = importer_row(second, turned, bar_of(turned), EngineSpec(label, {}), _answer(robot, turned), workers)
            rows = [row] if row.status == "explained" else rows
    ours, theirs = ({joint.name for joint in each.moving} for each in (robot, other_robot))
    return AgainstCheck(
        file=str(path),
        kind=file.kind,
        base=settings.base if "urdf" in {file.kind, second.kind} else "as in the file",
        lint=[*_lint(file, robot), *(_of_file(other, remark) for remark in _lint(second, other_robot))],
        truth=UsedTruth(by, bar, settings.states, settings.seed, robot.dofs),
        layers=LAYERS,
        engines=[_as_file(row) for row in rows],
        robot=robot_drawing(truth),
        against=str(other),
        against_by=by_other,
        matched=matched,
        absent=sorted(ours - matched.keys()),
        added=sorted(theirs - set(matched.values())),
        values=list(_unlike(robot, renamed)),
    )


def _meant(path: Path, settings: CheckSettings, workers: Workers) -> tuple[RobotFile, Robot, str]:
    """A file, its robot, and a clause that says whose reading gave the robot."""
    with tempfile.TemporaryDirectory() as folder:
        file, _, robot, compiler = moving_robot(path, settings, workers, Path(folder))
    return file, robot, source_of(compiler)


def _lint(file: RobotFile, robot: Robot) -> list[LintRemark]:
    return [*file.remarks, *lint(file, robot)]


def _of_file(path: Path, remark: LintRemark) -> LintRemark:
    return dataclasses.replace(remark, where=f"{path.name}: {remark.where}")


def _answer(robot: Robot, truth: RobotTruth) -> reading.ReaderAnswer:
    return reading.ReaderAnswer("", "", {}, reading_of(robot, truth), "")


def _as_file(row: ImporterRow) -> ImporterRow:
    """The row without remedies and known engines, which are about engines and not about files."""
    return dataclasses.replace(row, causes=[dataclasses.replace(cause, remedy="", known="") for cause in row.causes])


def _matched(robot: Robot, other: Robot, names: Mapping[str, str]) -> dict[str, str]:
    """Moving joint of the first robot -> its partner in the second.

    Partners are given by ``names``, have the same name, or are the only free joint of each robot left over.

    Raises:
        InputError: a given name is unknown, two joints have one partner, or kinds differ.
    """
    ours, theirs = ({joint.name: joint for joint in each.moving} for each in (robot, other))
    for one, two in names.items():
        require_known("--map", one, ours, "no joint of the first file moves under this name; those are", f"{one}={two}")
        words = "no joint of the second file moves under this name; those are"
        require_known("--map", two, theirs, words, f"{one}={two}")
        if ours[one].dofs != theirs[two].dofs:
            kinds = f"{one} is {ours[one].kind}, {two} is {theirs[two].kind}; choose joints of one kind"
            raise InputError("--map", f"{one}={two}", kinds)
    taken = set(names.values())
    if len(taken) < len(names):
        raise InputError("--map", ", ".join(names.values()), "each joint has one partner")
    partners = dict(names) | {name: name for name in ours if name not in names and name in theirs and name not in taken}
    free = [
        [name for name, joint in each.items() if joint.kind == "free" and name not in known]
        for each, known in ((ours, partners), (theirs, set(partners.values())))
    ]
    if all(len(left) == 1 for left in free):
        partners[free[0][0]] = free[1][0]
    return {
        name: partners[name] for name in ours if name in partners and ours[name].dofs == theirs[partners[name]].dofs
    }


def _renamed(other: Robot, matched: Mapping[str, str]) -> Robot:
    """The second robot with the first's joint names; a joint without a partner gets a name that the first lacks."""
    back = {theirs: ours for ours, theirs in matched.items()}
    new = {joint.name: back.get(joint.name, f"{joint.name} of the second file") for joint in other.joints}
    joints = tuple(dataclasses.replace(joint, name=new[joint.name]) for joint in other.joints)
    mimics = tuple(dataclasses.replace(mimic, joint=new[mimic.joint], other=new[mimic.other]) for mimic in other.mimics)
    return other.change(joints=joints, mimics=mimics)


def reading_of(robot: Robot, truth: RobotTruth) -> Reading:
    """Reading of a fictitious engine that holds exactly this robot, evaluated by the second formulation."""
    states = truth.states.completed(robot)
    d, placed = body_recursion(robot, states), poses(robot, states)
    asked = states.stacked(states.acceleration, robot)
    zero = {joint.name: np.zeros((states.count, joint.dofs)) for joint in robot.moving}
    torque = np.concatenate([(zero | truth.torques)[joint.name] for joint in robot.moving], axis=1)
    forward: Array | None = None
    with contextlib.suppress(np.linalg.LinAlgError):
        forward = np.asarray(np.linalg.solve(d.M, (torque - d.h - passive(robot, states))[..., None])[..., 0], float)
    groups = robot.groups
    carried = {joint.name: joint.child for joint in robot.moving}
    true = {mimic.joint: mimic for mimic in truth.robot.mimics}
    return Reading(
        tuple(groups),
        tuple(joint.dofs for joint in robot.moving),
        {name: body.mass for name, body in groups.items()},
        {name: body.com for name, body in groups.items()},
        {name: body.inertia for name, body in groups.items()},
        {name: placed[child][0] for name, child in carried.items()},
        {name: placed[child][1] for name, child in carried.items()},
        d.M,
        d.g,
        d.h,
        np.einsum("sij,sj->si", d.M, asked) + d.h,
        forward,
        coupled=tuple(mimic.joint for mimic in robot.mimics if _same(true.get(mimic.joint), mimic)),
    )


def _same(one: Mimic | None, other: Mimic) -> bool:
    return one is not None and one.other == other.other and not _apart(one.multiplier, other.multiplier)


_LAWS = ("kind", "damping", "friction", "armature", "stiffness", "rest", "lower", "upper")


def _unlike(robot: Robot, other: Robot) -> Iterator[UnlikeValue]:
    """Values of joints that differ between the two files."""
    theirs = {joint.name: joint for joint in other.moving}
    groups = robot.groups, other.groups
    follows = [{mimic.joint: _written(mimic) for mimic in each.mimics} for each in (robot, other)]
    for joint in robot.moving:
        if joint.name not in theirs:
            continue
        pairs: dict[str, tuple[Any, Any]] = {
            law: (getattr(joint, law), getattr(theirs[joint.name], law)) for law in _LAWS
        }
        pairs["follows"] = (follows[0].get(joint.name), follows[1].get(joint.name))
        pairs["mass that it carries"] = (groups[0][joint.name].mass, groups[1][joint.name].mass)
        for quantity, (here, there) in pairs.items():
            if _apart(here, there):
                yield UnlikeValue(joint.name, quantity, here, there)


def _written(mimic: Mimic) -> str:
    return f"{mimic.multiplier:g} · {mimic.other} + {mimic.offset:g}"


def _apart(here: Any, there: Any) -> bool:
    if isinstance(here, float) and isinstance(there, float):
        return not math.isclose(here, there, rel_tol=_ROUNDING, abs_tol=_ROUNDING)
    return bool(here != there)
