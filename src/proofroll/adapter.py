"""Names that an adapter of an engine needs; they stay here when the modules that define them move.

The table in docs/write_an_engine.md says what each name is. A name stays, or leaves with an entry in ``changes/``.
"""

from proofroll.core.engine import Engine, Regularised, Sample, Scheme, Settings, whole_steps
from proofroll.core.engine_abilities import Level, Term, require_provided
from proofroll.core.errors import Diverged, InputError, Refused
from proofroll.core.events import Event
from proofroll.core.formulations import Formulation
from proofroll.core.scene import Scene
from proofroll.elements.mechanism import WORLD, Body, BodyMotion, Force, Joint, Loop, Mechanism, Point, Spring, Tree
from proofroll.elements.mechanism.contact.tree_contacts import ContactDynamics
from proofroll.elements.mechanism.dynamics.held_signals import drive
from proofroll.elements.mechanism.dynamics.loop_points import held_points
from proofroll.elements.mechanism.dynamics.point_loads import loads_at, targets_at
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.elements.mechanism.run.contacts.family import Family, of_contact
from proofroll.elements.mechanism.run.mujoco_arrays import MujocoArrays
from proofroll.elements.mechanism.run.sampling import MechanismBuilt, MechanismSample, mechanism_of, unsaid
from proofroll.elements.mechanism.scene.joint_kinds import WITH_AXIS, JointKind
from proofroll.elements.mechanism.scene.rotations import Array, frame_of_axis, from_quaternion, skew, to_quaternion
from proofroll.elements.mechanism.scene.shapes.shapes import HalfSpace, SphereShape
from proofroll.elements.mechanism.scene.signal import value_at
from proofroll.papers.blajer_2006.ball.as_body import RunOnBody, on_body, rolling_ball
from proofroll.papers.blajer_2006.ball.mechanics import natural_acceleration, newton_euler, resistance_moment
from proofroll.papers.blajer_2006.ball.model import ALL_OF_A_BALL, ROLLS, RollingBall
from proofroll.papers.blajer_2006.ball.sampling import BallBuilt, BallSample, terms_held

__all__ = [
    "ALL_OF_A_BALL", "ROLLS", "WITH_AXIS", "WORLD", "Array", "BallBuilt", "BallSample", "Body", "BodyMotion",
    "ContactDynamics", "Diverged", "Engine", "Event", "Family", "Force", "Formulation", "HalfSpace", "InputError",
    "Joint", "JointKind", "Level", "Loop", "Mechanism", "MechanismBuilt", "MechanismCapability", "MechanismSample",
    "MujocoArrays", "Point", "Refused", "Regularised", "RollingBall", "RunOnBody", "Sample", "Scene", "Scheme",
    "Settings", "SphereShape", "Spring", "Term", "Tree", "drive", "frame_of_axis", "from_quaternion", "held_points",
    "loads_at", "mechanism_of", "natural_acceleration", "newton_euler", "of_contact", "on_body", "require_provided",
    "resistance_moment", "rolling_ball", "skew", "targets_at", "terms_held", "to_quaternion", "unsaid", "value_at",
    "whole_steps",
]  # fmt: skip
