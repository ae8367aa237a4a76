"""Known causes of a difference between an engine's robot and the file's, a function each.

A cause is proven by computation: the truth is evaluated for the robot that the engine would hold because of it, and
the engine's difference from that has to vanish. If no robot describes the engine's error, the engine reads an
equivalent file that does not trigger it, and its difference from the truth has to vanish.
"""

from __future__ import annotations

import copy
import dataclasses
import functools
import importlib
import inspect
import pkgutil
from collections.abc import Callable, Iterator, Mapping
from typing import TypeVar
from xml.etree.ElementTree import Element

import numpy as np

from proofroll.core.diagnosis import Hypothesis
from proofroll.robots.files.robot_file import RobotFile
from proofroll.robots.model import Robot, RobotBody, RobotJoint
from proofroll.robots.protocol import Reading

_Part = TypeVar("_Part", RobotBody, RobotJoint)
# Mass [kg] and moment of inertia [kg m²] that stand for zero, with which MuJoCo compiles a moving body.
LEAST = 1e-14
# Remedy for engines that compute inertia from shapes differently.
WRITE_INERTIALS = (
    "give every body an <inertial>; compile once with MuJoCo and save (mj_saveLastXML, six digits) to get one"
)


@dataclasses.dataclass(frozen=True, kw_only=True)
class EditedRobot(Robot):
    """A robot with its file's content (``root``) as edited by the causes found so far."""

    root: Element

    @classmethod
    def of(cls, robot: Robot, root: Element) -> EditedRobot:
        """Robot with this file content."""
        return cls(**{field.name: getattr(robot, field.name) for field in dataclasses.fields(Robot)}, root=root)


@dataclasses.dataclass(frozen=True)
class RobotEvidence:
    """Evidence for a hypothesis.

    Attributes:
        file: the file.
        robot: model that the file describes, with the causes found so far.
        reading: model that the engine holds.
        recompiled: edited file -> robot that it describes (MJCF only); None: it describes none.
        reread: edited file -> the engine's reading of it; None: the engine refuses it or cannot be asked.
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
        """Robot with the values of bodies and joints that an edit of the file changes.

        Values that the edit does not change keep the effect of the causes found so far; edits of one body add up.

        Args:
            edit: changes the content in place; returns True if it changed anything.

        Returns:
            None if the edit changes no body or joint, or the edited file describes no robot.
        """
        root = copy.deepcopy(self.root)
        if not edit(root):
            return None
        old, new = self.recompiled(self.root), self.recompiled(root)
        robot = None if old is None or new is None else self.carried_over(old, with_weightless(new))
        return None if robot is None else EditedRobot.of(robot, root)

    def carried_over(self, start: Robot, edited: Robot) -> Robot | None:
        """This robot with all values that differ from ``start`` to ``edited``; None: none do."""
        robot = self.robot
        bodies = [_moved(body, start.bodies.get(name), edited.bodies.get(name)) for name, body in robot.bodies.items()]
        old, new = ({joint.name: joint for joint in version.joints} for version in (start, edited))
        joints = tuple(_moved(joint, old.get(joint.name), new.get(joint.name)) for joint in robot.joints)
        parts = zip((*bodies, *joints), (*robot.bodies.values(), *robot.joints), strict=True)
        if all(part is rival for part, rival in parts):
            return None
        return robot.with_bodies(bodies).change(joints=joints)


def with_weightless(robot: Robot) -> Robot:
    """Robot without the mass ``LEAST`` that bodies were given so that an engine compiles them."""
    none = np.zeros((3, 3))
    light = (name for name, body in robot.bodies.items() if 0 < body.mass <= LEAST)
    return robot.with_bodies(RobotBody(name, 0.0, np.zeros(3), none) for name in light)


def _moved(part: _Part, old: _Part | None, new: _Part | None) -> _Part:
    """A body or joint with the values that differ from ``old`` to ``new``."""
    if old is None or new is None:
        return part
    changed = {name: value for name, value in vars(new).items() if not np.array_equal(value, getattr(old, name))}
    return dataclasses.replace(part, **changed) if changed else part


RobotHypothesis = Hypothesis[RobotEvidence, Robot | Reading]
# Evidence -> robot that the engine would hold, or its reading of an equivalent file that does not trigger the error;
# None, or the same robot: the cause does not apply to the file.
Change = Callable[[RobotEvidence], Robot | Reading | None]


def hypothesis(known: Mapping[str, str], remedy: str) -> Callable[[Change], RobotHypothesis]:
    """Decorator that makes a hypothesis of a function, which gives the id and the first line of its docstring.

    ``known``: engine -> versions in which it was seen; these engines try it first.
    """

    def decorate(change: Change) -> RobotHypothesis:
        text = inspect.getdoc(change) or change.__name__
        behaviour = text[0].lower() + text[1:].partition("\n")[0].removesuffix(".")

        def models(evidence: RobotEvidence) -> Iterator[Robot | Reading]:
            if (model := change(evidence)) is not None:
                yield model

        return Hypothesis(id=change.__name__, grounds=behaviour, test=models, known=known, remedy=remedy)

    return decorate


@functools.cache
def hypotheses() -> tuple[RobotHypothesis, ...]:
    """All hypotheses in the modules of this package, sorted by id."""
    modules = [importlib.import_module(f"{__name__}.{module.name}") for module in pkgutil.iter_modules(__path__)]
    causes = [item for module in modules for item in vars(module).values() if isinstance(item, Hypothesis)]
    return tuple(sorted(causes, key=lambda item: item.id))
