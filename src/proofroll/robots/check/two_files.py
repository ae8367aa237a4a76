"""Comparison of two files of one robot: differences of their models, and values that differ."""

import contextlib
import dataclasses
import math
import tempfile
from collections.abc import Iterator, Mapping
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np

from proofroll.core.errors import InputError, require_known
from proofroll.core.plugins import EngineSpec
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.robots.check.body_recursion import body_recursion, poses
from proofroll.robots.check.check import bar_of, robot_drawing
from proofroll.robots.check.importer_row import importer_row
from proofroll.robots.check.layers import LAYERS, RobotTruth
from proofroll.robots.check.lint import lint
from proofroll.robots.check.records import AgainstCheck, UnlikeValue, UsedTruth
from proofroll.robots.check.two_formulations import passive
from proofroll.robots.files import reading
from proofroll.robots.files.meaning import USUAL, CheckSettings, moving_robot, source_of
from proofroll.robots.files.robot_file import RobotFile
from proofroll.robots.model import Array, Mimic, Robot
from proofroll.robots.protocol import Reading
from proofroll.robots.states import random_states
from proofroll.running.engine_questions import lent_workers
from proofroll.running.idle_workers import Workers

_ANY = "*"  # stands for the common part of two names
# A pair of patterns ``front*back``, for names of the first and of the second robot.
_Patterns = tuple[str, str]


def with_patterns(names: Mapping[str, str], robot: Robot, rival: Robot) -> dict[str, str]:
    """Partners of joints, patterns replaced by the pairs of names that fit them; a pair without ``*`` wins.

    Args:
        names: joint of the first robot -> joint of the second; or ``front*back`` -> ``front*back``.
        robot: the first robot.
        rival: the second robot.

    Raises:
        InputError: a pattern has no or several ``*`` on one side, or fits no pair of joints.
    """
    pairs: dict[str, str] = {}
    for pattern, image in names.items():
        if _ANY not in pattern + image:
            continue
        if pattern.count(_ANY) != 1 or image.count(_ANY) != 1:
            raise InputError("--map", f"{pattern}={image}", "write one * on each side: it is the part both names have")
        fitting = _pairs((pattern, image), robot, rival)
        if not fitting:
            raise InputError("--map", f"{pattern}={image}", "it fits no joint of the first file with one of the second")
        pairs |= fitting
    return pairs | {pattern: image for pattern, image in names.items() if _ANY not in pattern + image}


def proposed_patterns(robot: Robot, rival: Robot, matched: Mapping[str, str]) -> tuple[str, dict[str, str]]:
    """Argument of ``--map`` that gives the most joints partners of the same kind and place in the tree.

    Args:
        robot: the first robot.
        rival: the second robot.
        matched: joint of the first robot -> its partner in the second, for those that have one.

    Returns:
        The argument, ``"panda_*=*"``, and the partners that it adds; empty where no prefix or suffix gives any.
    """
    lonely = [joint.name for joint in robot.moving if joint.name not in matched]
    partners = set(matched.values())
    lonely_there = [joint.name for joint in rival.moving if joint.name not in partners]
    best: tuple[str, dict[str, str]] = ("", {})
    tried: set[_Patterns] = set()
    for patterns in (pair for name in lonely for partner in lonely_there for pair in _differences(name, partner)):
        if patterns in tried:
            continue
        tried.add(patterns)
        fitting = {name: partner for name, partner in _pairs(patterns, robot, rival).items() if name in lonely}
        if set(fitting.values()) <= set(lonely_there) and _same_tree({**matched, **fitting}, fitting, robot, rival):
            best = max(best, ("=".join(patterns), fitting), key=lambda item: len(item[1]))
    return best


def _differences(name: str, partner: str) -> Iterator[_Patterns]:
    """Patterns of two names with a common end, and of two names with a common beginning."""
    if back := _common(name[::-1], partner[::-1]):
        yield name[:-back] + _ANY, partner[:-back] + _ANY
    if front := _common(name, partner):
        yield _ANY + name[front:], _ANY + partner[front:]


def _common(text: str, second: str) -> int:
    """Number of equal characters at the beginning of two texts."""
    return next(
        (count for count, (a, b) in enumerate(zip(text, second, strict=False)) if a != b), min(len(text), len(second))
    )


def _pairs(patterns: _Patterns, robot: Robot, rival: Robot) -> dict[str, str]:
    """Joints of two robots whose names fit two patterns with the same part in place of ``*``."""
    front, _, back = patterns[0].partition(_ANY)
    rival_names = {joint.name for joint in rival.moving}
    pairs: dict[str, str] = {}
    for joint in robot.moving:
        name = joint.name
        if len(name) >= len(front) + len(back) and name.startswith(front) and name.endswith(back):
            image = patterns[1].replace(_ANY, name[len(front) : len(name) - len(back)])
            pairs |= {name: image} if image in rival_names else {}
    return pairs


def _same_tree(partners: Mapping[str, str], added: Mapping[str, str], robot: Robot, rival: Robot) -> bool:
    """True if added partners are of one kind, and the nearest joints before them that have partners are partners."""
    kinds = [{joint.name: joint.kind for joint in tree.moving} for tree in (robot, rival)]
    back = {theirs: ours for ours, theirs in partners.items()}
    for ours, theirs in added.items():
        carrier = next((name for name in _ancestors(robot, ours) if name in partners), None)
        before_there = next((name for name in _ancestors(rival, theirs) if name in back), None)
        if kinds[0][ours] != kinds[1][theirs] or (carrier and partners[carrier]) != before_there:
            return False
    return True


def _ancestors(robot: Robot, name: str) -> Iterator[str]:
    """Moving joints between a joint and the world, the nearest first."""
    parents = {joint.name: robot.welded[joint.parent][0] for joint in robot.moving}
    while name := parents[name]:
        yield name


# Relative difference of two values that is round-off of arithmetic, and the largest that is rounding of written digits.
_ROUNDING, _WRITTEN = 1e-9, 1e-5


def against(
    path: Path, rival: Path, names: Mapping[str, str] | None = None, settings: CheckSettings = USUAL
) -> AgainstCheck:
    """Compares the model of a second file with that of the first, at random states of the first.

    Args:
        path: path of a URDF or MJCF, which counts as true.
        rival: path of the other file.
        names: joint of the first -> joint of the second, where they have different names; a ``*`` on each side stands
            for the part of the names that is common.
        settings: base of the robots, states and limit of time.

    Raises:
        InputError: a file is wrong, or has no joint of a given name.
    """
    with lent_workers(None) as workers:
        (file, robot, by), (second, other_robot, by_other) = (
            _meant(file_path, settings, workers) for file_path in (path, rival)
        )
        matched = _matched(robot, other_robot, with_patterns(names or {}, robot, other_robot))
        renamed = _renamed(other_robot, matched)
        truth = RobotTruth.of(robot, random_states(robot, settings.states, settings.seed))
        bar = bar_of(truth)
        other_label, label = (
            file_path.name if path.name != rival.name else str(file_path) for file_path in (rival, path)
        )
        rows = [importer_row(file, truth, bar, EngineSpec(other_label, {}), _answer(renamed, truth), workers)]
        if rows[0].unexplained:  # with the second file as truth, causes in that file can be found
            turned = RobotTruth.of(renamed, random_states(renamed, settings.states, settings.seed))
            row = importer_row(second, turned, bar_of(turned), EngineSpec(label, {}), _answer(robot, turned), workers)
            rows = [row] if row.status == "explained" else rows
    ours, theirs = ({joint.name for joint in file_path.moving} for file_path in (robot, other_robot))
    unlike = list(_unlike(robot, renamed))
    rounded = [value for value in unlike if _same_digits(value.here, value.there)]
    proposed, partners = proposed_patterns(robot, other_robot, matched)
    # Remedies and known engines are about engines and not about files.
    causes = ([dataclasses.replace(cause, remedy="", known="") for cause in row.causes] for row in rows)
    of_files = [dataclasses.replace(row, causes=item) for row, item in zip(rows, causes, strict=True)]
    remarks = (*second.remarks, *lint(second, other_robot))
    further = (dataclasses.replace(item, where=f"{rival.name}: {item.where}") for item in remarks)
    return AgainstCheck(
        file=str(path),
        kind=file.kind,
        base=settings.base if "urdf" in {file.kind, second.kind} else "as in the file",
        lint=[*file.remarks, *lint(file, robot), *further],
        truth=UsedTruth(by=by, difference=bar, states=settings.states, seed=settings.seed, velocities=robot.dofs),
        layers=LAYERS,
        engines=of_files,
        robot=robot_drawing(truth),
        against=str(rival),
        against_by=by_other,
        matched=matched,
        absent=sorted(ours - matched.keys()),
        added=sorted(theirs - set(matched.values())),
        values=[value for value in unlike if value not in rounded],
        rounded=rounded,
        proposed=proposed,
        proposed_partners=partners,
    )


def _meant(path: Path, settings: CheckSettings, workers: Workers) -> tuple[RobotFile, Robot, str]:
    """A file, its robot, and a clause that says whose reading gave the robot."""
    with tempfile.TemporaryDirectory() as folder:
        file, _, robot, compiler = moving_robot(path, settings, workers, Path(folder))
    return file, robot, source_of(compiler)


def _answer(robot: Robot, truth: RobotTruth) -> reading.ReaderAnswer:
    return reading.ReaderAnswer(version="", says="", tolerances={}, reading=reading_of(robot, truth), refused="")


def _matched(robot: Robot, rival: Robot, names: Mapping[str, str]) -> dict[str, str]:
    """Moving joint of the first robot -> its partner in the second.

    Partners are given by ``names``, have the same name, or are the only free joint of each robot left over.

    Raises:
        InputError: a given name is unknown, two joints have one partner, or kinds differ.
    """
    ours, theirs = ({joint.name: joint for joint in side.moving} for side in (robot, rival))
    for mine, partner in names.items():
        pair = f"{mine}={partner}"
        for name, joints, number in ((mine, ours, "first"), (partner, theirs, "second")):
            require_known(
                "--map", name, joints, f"no joint of the {number} file moves under this name; those are", pair
            )
        if ours[mine].dofs != theirs[partner].dofs:
            kinds = f"{mine} is {ours[mine].kind}, {partner} is {theirs[partner].kind}; choose joints of one kind"
            raise InputError("--map", pair, kinds)
    taken = set(names.values())
    if len(taken) < len(names):
        raise InputError("--map", ", ".join(names.values()), "each joint has one partner")
    partners = dict(names) | {name: name for name in ours if name not in names and name in theirs and name not in taken}
    free = [
        [name for name, joint in side.items() if joint.kind == JointKind.FREE and name not in taken_names]
        for side, taken_names in ((ours, partners), (theirs, set(partners.values())))
    ]
    if all(len(left) == 1 for left in free):
        partners[free[0][0]] = free[1][0]
    return {
        name: partners[name] for name in ours if name in partners and ours[name].dofs == theirs[partners[name]].dofs
    }


def _renamed(rival: Robot, matched: Mapping[str, str]) -> Robot:
    """The second robot with the first's joint names; a joint without a partner gets a name that the first lacks."""
    back = {theirs: ours for ours, theirs in matched.items()}
    new = {joint.name: back.get(joint.name, f"{joint.name} of the second file") for joint in rival.joints}
    joints = tuple(dataclasses.replace(joint, name=new[joint.name]) for joint in rival.joints)
    mimics = tuple(dataclasses.replace(mimic, joint=new[mimic.joint], other=new[mimic.other]) for mimic in rival.mimics)
    return rival.change(joints=joints, mimics=mimics)


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
        joints=tuple(groups),
        dofs=tuple(joint.dofs for joint in robot.moving),
        mass={name: body.mass for name, body in groups.items()},
        com={name: body.com for name, body in groups.items()},
        inertia={name: body.inertia for name, body in groups.items()},
        position={name: placed[child][0] for name, child in carried.items()},
        rotation={name: placed[child][1] for name, child in carried.items()},
        M=d.M,
        g=d.g,
        h=d.h,
        inverse=np.einsum("sij,sj->si", d.M, asked) + d.h,
        forward=forward,
        coupled=tuple(mimic.joint for mimic in robot.mimics if _same(true.get(mimic.joint), mimic)),
    )


def _same(mimic: Mimic | None, rival: Mimic) -> bool:
    return mimic is not None and mimic.other == rival.other and not _apart(mimic.multiplier, rival.multiplier)


_LAWS = ("kind", "damping", "friction", "armature", "stiffness", "rest", "lower", "upper")


def _unlike(robot: Robot, rival: Robot) -> Iterator[UnlikeValue]:
    """Values of joints that differ between the two files."""
    theirs = {joint.name: joint for joint in rival.moving}
    groups = robot.groups, rival.groups
    follows = [
        {mimic.joint: f"{mimic.multiplier:g} · {mimic.other} + {mimic.offset:g}" for mimic in side.mimics}
        for side in (robot, rival)
    ]
    for joint in robot.moving:
        if joint.name not in theirs:
            continue
        pairs: dict[str, tuple[Any, Any]] = {
            law: (getattr(joint, law), getattr(theirs[joint.name], law)) for law in _LAWS
        }
        pairs["follows"] = (follows[0].get(joint.name), follows[1].get(joint.name))
        pairs["mass that it carries"] = (groups[0][joint.name].mass, groups[1][joint.name].mass)
        for quantity, (value, rival_value) in pairs.items():
            if _apart(value, rival_value):
                yield UnlikeValue(joint.name, quantity, value, rival_value)


def _apart(value: Any, rival_value: Any) -> bool:
    if isinstance(value, float) and isinstance(rival_value, float):
        return not math.isclose(value, rival_value, rel_tol=_ROUNDING, abs_tol=_ROUNDING)
    return bool(value != rival_value)


def _same_digits(value: Any, rival_value: Any) -> bool:
    """True for two numbers that differ by at most one unit of the last digit with which one of them is written."""
    if not (isinstance(value, float) and isinstance(rival_value, float)) or not math.isfinite(value - rival_value):
        return False
    last = max(_last_digit(value), _last_digit(rival_value))
    return abs(value - rival_value) <= min(last * (1 + _ROUNDING), _WRITTEN * max(abs(value), abs(rival_value)))


def _last_digit(value: float) -> float:
    """Size of one unit of the last digit of a number's shortest decimal."""
    return float(Decimal(1).scaleb(int(Decimal(repr(value)).normalize().as_tuple().exponent)))
