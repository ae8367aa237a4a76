"""Mechanisms: bodies, joints, loops, springs and tracked points; their kinematics, analysis and truths."""

from proofroll.elements.mechanism.dynamics.kinematics import BodyMotion, Tree
from proofroll.elements.mechanism.scene.checks import WORLD
from proofroll.elements.mechanism.scene.joint import Joint
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.parts import Body, Force, Loop, Point, Spring

__all__ = ["WORLD", "Body", "BodyMotion", "Force", "Joint", "Loop", "Mechanism", "Point", "Spring", "Tree"]
