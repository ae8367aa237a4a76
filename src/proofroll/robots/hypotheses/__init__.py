"""Known causes why an engine holds another robot than the file describes, a function each.

A cause is proven by computation: the truth is evaluated for the robot that the engine would hold because of it, and
the engine's difference from that has to vanish. Where what it holds is no robot, the engine reads a file without the
occasion instead, and its difference from the truth has to vanish.
"""

from __future__ import annotations

import copy
import dataclasses
import functools
import importlib
import inspect
import pkgutil
from collections.abc import Callable, Mapping
from typing import TypeVar
from xml.etree.ElementTree import Element

import numpy as np

from proofroll.robots.model import Robot, RobotBody, RobotJoint
from proofroll.robots.protocol import Reading
from proofroll.robots.robot_file import RobotFile

_Part = TypeVar("_Part", RobotBody, RobotJoint)
# The least mass and moment with which MuJoCo compiles a body that moves: it stands for none [kg], [kg m²].
LEAST = 1e-14
# The remedy where an engine computes inertia from shapes in its own way.
WRITE_INERTIALS = (
    "give every body an <inertial>; compile once with MuJoCo and save (mj_saveLastXML, six digits) to get one"
)


@dataclasses.dataclass(frozen=True, kw_only=True)
class EditedRobot(Robot):
    """A robot with the content of a file that causes have edited."""

    root: Element

    @classmethod
    def of(cls, robot: Robot, root: Element) -> EditedRobot:
        """The robot with this content."""
        return cls(**{field.name: getattr(robot, field.name) for field in dataclasses.fields(Robot)}, root=root)


@dataclasses.dataclass(frozen=True)
class RobotEvidence:
    """Evidence for a hypothesis.

    Attributes:
        file: the file.
        robot: model that the file describes, with the causes found so far.
        reading: model that the engine holds.
        recompiled: meaning of a changed file, for a format that an engine defines; None where it has none.
        reread: reads a changed file with the engine; None where it cannot be asked, or refuses.
    """

    file: RobotFile
    robot: Robot
    reading: Reading
    recompiled: Callable[[Element], Robot | None] = lambda _: None
    reread: Callable[[Element], Reading | None] = lambda _: None

    @property
    def root(self) -> Element:
        """Content of the file, with the edits of the causes found so far."""
        return self.robot.root if isinstance(self.robot, EditedRobot) else self.file.root

    def edited(self, edit: Callable[[Element], bool]) -> Robot | None:
        """The robot with all that an edit of the file changes in bodies and joints; None: nothing, or no meaning.

        What the edit leaves as it is keeps the causes found so far; edits of one body add up. It says whether it
        changed the file.
        """
        root = copy.deepcopy(self.root)
        if not edit(root):
            return None
        before, after = self.recompiled(self.root), self.recompiled(root)
        robot = None if before is None or after is None else self.carried_over(before, with_weightless(after))
        return None if robot is None else EditedRobot.of(robot, root)

    def carried_over(self, before: Robot, after: Robot) -> Robot | None:
        """The robot with all that differs between two others; None: nothing does."""
        robot = self.robot
        bodies = [_moved(body, before.bodies.get(name), after.bodies.get(name)) for name, body in robot.bodies.items()]
        old, new = ({joint.name: joint for joint in each.joints} for each in (before, after))
        joints = tuple(_moved(joint, old.get(joint.name), new.get(joint.name)) for joint in robot.joints)
        parts = zip((*bodies, *joints), (*robot.bodies.values(), *robot.joints), strict=True)
        if all(one is other for one, other in parts):
            return None
        return robot.with_bodies(bodies).change(joints=joints)


def with_weightless(robot: Robot) -> Robot:
    """The robot without the mass that only lets a body be compiled."""
    none = np.zeros((3, 3))
    light = (name for name, body in robot.bodies.items() if 0 < body.mass <= LEAST)
    return robot.with_bodies(RobotBody(name, 0.0, np.zeros(3), none) for name in light)


def _moved(part: _Part, before: _Part | None, after: _Part | None) -> _Part:
    """A part with the values that another has now and had otherwise before."""
    if before is None or after is None:
        return part
    changed = {name: value for name, value in vars(after).items() if not np.array_equal(value, getattr(before, name))}
    return dataclasses.replace(part, **changed) if changed else part


Change = Callable[[RobotEvidence], Robot | Reading | None]


@dataclasses.dataclass(frozen=True)
class RobotHypothesis:
    """A cause.

    Attributes:
        id: name of the function that makes the robot.
        name: behaviour of the engine, in a few words.
        known: engine -> versions in which it was seen; those are tried first.
        remedy: action of a user.
        change: the robot that the engine would hold, or what it holds of a file that means the same and gives no
            occasion; None, or the same robot: the file gives no occasion for it.
    """

    id: str
    name: str
    known: Mapping[str, str]
    remedy: str
    change: Change


def hypothesis(known: Mapping[str, str], remedy: str) -> Callable[[Change], RobotHypothesis]:
    """Makes a hypothesis of a function, whose first line says what the engine does; see :class:`RobotHypothesis`."""

    def made(change: Change) -> RobotHypothesis:
        said = inspect.getdoc(change) or change.__name__
        name = said[0].lower() + said[1:].partition("\n")[0].removesuffix(".")
        return RobotHypothesis(change.__name__, name, known, remedy, change)

    return made


@functools.cache
def hypotheses() -> tuple[RobotHypothesis, ...]:
    """All causes in the modules of this package, by their names."""
    modules = [importlib.import_module(f"{__name__}.{module.name}") for module in pkgutil.iter_modules(__path__)]
    causes = [item for module in modules for item in vars(module).values() if isinstance(item, RobotHypothesis)]
    return tuple(sorted(causes, key=lambda item: item.id))
