"""Mechanisms: bodies, joints, loops, springs and tracked points; their kinematics, analysis and truths."""

from proofroll.elements.mechanism.checks import WORLD
from proofroll.elements.mechanism.joint import Joint
from proofroll.elements.mechanism.kinematics import BodyMotion, Tree
from proofroll.elements.mechanism.model import Mechanism
from proofroll.elements.mechanism.parts import Body, Force, Loop, Point, Spring

__all__ = ["WORLD", "Body", "BodyMotion", "Force", "Joint", "Loop", "Mechanism", "Point", "Spring", "Tree"]
