"""Mechanisms: bodies, joints, loops, springs and tracked points; their kinematics, analysis and truths."""

from proofroll.elements.mechanism.kinematics import BodyMotion, Tree
from proofroll.elements.mechanism.model import WORLD, Body, Joint, Loop, Mechanism, Point, Spring

__all__ = ["WORLD", "Body", "BodyMotion", "Joint", "Loop", "Mechanism", "Point", "Spring", "Tree"]
