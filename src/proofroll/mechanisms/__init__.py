"""Mechanisms: bodies, joints, loops, springs and tracked points; their kinematics, analysis and truths."""

from proofroll.mechanisms.kinematics import Motion, Tree
from proofroll.mechanisms.model import WORLD, Body, Joint, Loop, Mechanism, Point, Spring

__all__ = ["WORLD", "Body", "Joint", "Loop", "Mechanism", "Motion", "Point", "Spring", "Tree"]
