"""Mechanisms: bodies, joints, loops, springs and tracked points; their kinematics, analysis and truths."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from proofroll.elements.mechanism.dynamics.kinematics import BodyMotion, Tree
    from proofroll.elements.mechanism.scene.checks import WORLD
    from proofroll.elements.mechanism.scene.joint import Joint
    from proofroll.elements.mechanism.scene.model import Mechanism
    from proofroll.elements.mechanism.scene.parts import Body, Force, Loop, Point, Spring

__all__ = ["WORLD", "Body", "BodyMotion", "Force", "Joint", "Loop", "Mechanism", "Point", "Spring", "Tree"]
# Name -> its module, loaded at the first use: readers of robots need none of them.
_HOMES = dict.fromkeys(__all__, "scene.parts") | dict.fromkeys(("BodyMotion", "Tree"), "dynamics.kinematics")
_HOMES |= {"WORLD": "scene.checks", "Joint": "scene.joint", "Mechanism": "scene.model"}


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
