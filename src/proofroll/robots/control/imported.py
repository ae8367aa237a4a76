"""Robots that importers make of a file, by the causes of :mod:`proofroll.robots.hypotheses`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from proofroll.core.errors import InputError, Refused
from proofroll.robots.control.bookkeeping.air import HeldRobot
from proofroll.robots.files.robot_file import RobotFile
from proofroll.robots.hypotheses import RobotEvidence, RobotHypothesis, hypotheses
from proofroll.robots.model import Robot
from proofroll.robots.protocol import Reading

_NOTHING = Reading(
    joints=(),
    dofs=(),
    mass={},
    com={},
    inertia={},
    position={},
    rotation={},
    M=np.empty(0),
    g=np.empty(0),
    h=np.empty(0),
)
MOST = 2  # causes that act together


def imported_robots(
    file: RobotFile, robot: Robot, holder: Callable[[Robot], HeldRobot], most: int = MOST
) -> Iterator[HeldRobot]:
    """Robots by one cause, then by two, up to ``most``.

    Args:
        file: of the robot.
        robot: robot of the file.
        holder: robot as a program holds it.
        most: number of causes that act together.
    """
    begun: list[tuple[tuple[RobotHypothesis, ...], Robot]] = [((), robot)]
    for _ in range(most):
        changes, begun = _further(file, begun), []
        for causes, other_robot in changes:
            begun.append((causes, other_robot))
            with suppress(InputError, Refused):
                ids, words = tuple(item.id for item in causes), "; ".join(_told(item) for item in causes)
                yield replace(holder(other_robot), causes=ids, words=words)


def _further(
    file: RobotFile, begun: Sequence[tuple[tuple[RobotHypothesis, ...], Robot]]
) -> Iterator[tuple[tuple[RobotHypothesis, ...], Robot]]:
    """Robots with causes and one more, each pair of causes once; one after another, as a search may end before."""
    for causes, earlier in begun:
        for cause in hypotheses():
            if causes and cause.id <= causes[-1].id:
                continue
            if (other_robot := _changed(file, earlier, cause)) is not None:
                yield (*causes, cause), other_robot


def _told(cause: RobotHypothesis) -> str:
    engines = ", ".join(" ".join(part for part in item if part) for item in cause.known.items())
    return f"{cause.grounds}, as by {engines}: {cause.remedy}"


def _changed(file: RobotFile, robot: Robot, cause: RobotHypothesis) -> Robot | None:
    """Robot with a cause that needs the file alone; None: it needs more, changes nothing, or changes the joints."""
    evidence = RobotEvidence(file=file, robot=robot, reading=_NOTHING)
    other_robot = next(iter(cause.test(evidence)), None)
    if not isinstance(other_robot, Robot) or other_robot is robot:
        return None
    return other_robot if _freedoms(other_robot) == _freedoms(robot) else None


def _freedoms(robot: Robot) -> list[tuple[str, str]]:
    """Joints that a record of a robot has columns of, with their kinds."""
    return [(joint.name, joint.kind) for joint in robot.moving]
