"""Known causes why an engine holds another robot than the file describes, a module each.

A cause is proven by computation: the truth is evaluated for the robot that the engine would hold because of it, and
the engine's difference from that has to vanish.
"""

from __future__ import annotations

import dataclasses
import functools
import importlib
import pkgutil
from collections.abc import Callable, Mapping
from xml.etree.ElementTree import Element

from proofroll.robots.model import Robot
from proofroll.robots.protocol import Reading
from proofroll.robots.robot_file import RobotFile


@dataclasses.dataclass(frozen=True)
class RobotEvidence:
    """What a hypothesis may look at.

    Attributes:
        file: the file.
        robot: what the file describes, with the causes found so far.
        reading: what the engine holds.
        recompiled: what a changed file would mean, for a format that an engine defines; None where that has no meaning.
    """

    file: RobotFile
    robot: Robot
    reading: Reading
    recompiled: Callable[[Element], Robot | None] = lambda _: None


@dataclasses.dataclass(frozen=True)
class RobotHypothesis:
    """A cause.

    Attributes:
        name: what the engine does, in a few words.
        known: engine -> versions in which it was seen; those are tried first.
        remedy: what a user does about it.
        change: the robot that the engine would hold; None, or the same robot: the file gives no occasion for it.
        id: name of the module.
    """

    name: str
    known: Mapping[str, str]
    remedy: str
    change: Callable[[RobotEvidence], Robot | None]
    id: str = ""


@functools.cache
def hypotheses() -> tuple[RobotHypothesis, ...]:
    """All causes: what the modules of this package call ``HYPOTHESIS``."""
    names = sorted(module.name for module in pkgutil.iter_modules(__path__))
    return tuple(
        dataclasses.replace(importlib.import_module(f"{__name__}.{name}").HYPOTHESIS, id=name) for name in names
    )
