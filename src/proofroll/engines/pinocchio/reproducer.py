"""Writer of programs that show Pinocchio's behaviour without proofroll, from the adapter's own code."""

import math
from typing import Any

from proofroll.core.cut_out import CutOut
from proofroll.core.errors import Refused
from proofroll.core.integrators import INTEGRATORS
from proofroll.core.program_text import assignment
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.reproducer_source import cut_program
from proofroll.elements.mechanism import Force
from proofroll.elements.mechanism.dynamics.loop_points import held_points
from proofroll.elements.mechanism.scene.drives import Actuator
from proofroll.engines.pinocchio.ball.contact import ContactSteps
from proofroll.engines.pinocchio.ball.rows_run import RowsRun
from proofroll.engines.pinocchio.settings import PinocchioSettings
from proofroll.engines.pinocchio.smooth.mechanism_run import MechanismMotion, MechanismRun

_SEEN = '''

def seen(model, ball, q, v):
    """Centre, velocity and angular velocity of the ball in the world."""
    data = model.createData()
    pin.forwardKinematics(model, data, q, v)
    velocity = pin.getVelocity(model, data, ball, pin.LOCAL_WORLD_ALIGNED)
    return data.oMi[ball].translation.copy(), velocity.linear.copy(), velocity.angular.copy()


def run(times):
    """Observed quantities at each time."""
'''
_ROWS = """    mechanism = {mechanism}(BODY, bool(SETTINGS.orientation))
    motion = {motion}(mechanism, SETTINGS)
    for t in times:
        motion.advance(t)
        yield seen(mechanism.model, mechanism.ball, motion.q, motion.v)
"""
_CONTACT = """    steps = ContactSteps(BODY, SETTINGS)
    for t in times:
        steps.advance(t)
        # With leapfrog the velocity is half a step ahead: the present one is the mean of two.
        v = (steps.v + steps.kick().v) / 2 if steps.leapfrog and steps.started else steps.v
        yield seen(steps.contact.model, steps.contact.ball, steps.q, v)
"""


def source(body: RollingBall, settings: PinocchioSettings) -> str:
    """See :class:`proofroll.core.engine_abilities.Reproduces`; with the orientation if the settings integrate it.

    Raises:
        Refused: the scene or the settings have something that programs cannot express.
    """
    if settings.formulation == "contact":
        return cut_program(body, settings, [ContactSteps], ["advance", "kick"], _SEEN + _CONTACT)
    if math.isfinite(body.contact.mu_static):
        raise Refused("the loop that switches between stick and slip around Pinocchio's terms is proofroll's")
    run = RowsRun(body, settings)
    kinds = type(run.mechanism), type(run.motion)
    mechanism, motion = (kind.__name__ for kind in kinds)
    text = _SEEN + _ROWS.format(mechanism=mechanism, motion=motion)
    return cut_program(body, settings, kinds, ["advance", "orientation"], text)


_OF_A_MECHANISM = '''
MECHANISM.start = lambda: (np.array(START[0]), np.array(START[1]))
MECHANISM.place_of = PLACES_OF.get
MECHANISM.prescribed = ()


def seen(motion):
    """Places of bodies [m], energy [J] and how far loops and couplings are open [m]."""
    tree, model = motion.tree, motion.tree.model
    data, q, v = model.createData(), motion.motion.x[: model.nq], motion.motion.x[model.nq : model.nq + model.nv]
    energy = pin.computeKineticEnergy(model, data, q, v) + pin.computePotentialEnergy(model, data, q)
    energy += sum(float(np.sum((q[at] - rest) ** 2)) * stiffness / 2 for stiffness, rest, at, _ in tree.sprung)
    pin.forwardKinematics(model, data, q, v)
    pin.updateFramePlacements(model, data)
    for spring, a, b in tree.springs:
        stretch = np.linalg.norm(data.oMf[b].translation - data.oMf[a].translation) - spring.length
        energy += spring.stiffness * stretch**2 / 2
    poses = [(data.oMf[tree.body[body]], np.array(at)) for body, at in PLACES]
    opened = float(np.abs(motion.rows.at(data, q, v).residual).max(initial=0.0)) if tree.closed else 0.0
    return [pose.translation + pose.rotation @ at for pose, at in poses], float(energy), opened


def run(times):
    """Observed quantities at each time."""
    motion = MechanismMotion(MECHANISM, SETTINGS)
    for t in times:
        motion.advance(t)
        yield seen(motion)
'''


def mechanism_source(run: MechanismRun, settings: PinocchioSettings) -> str:
    """Program that runs a mechanism, with the dynamics of the settings.

    Raises:
        Refused: drives change in time, motions are prescribed, springs have a formula, or there are bushings.
    """
    if any(spring.force for spring, _, _ in run.tree.springs):
        raise Refused("a program cannot have springs with a force of their own yet")
    if run.tree.mechanism.bushings:
        raise Refused("a program cannot have bushings yet")
    if run.tree.varies or run.tree.mechanism.prescribed:
        raise Refused("a program cannot have drives that change in time, or prescribed motions, yet")
    mechanism: Any = run.tree.mechanism
    integrator = INTEGRATORS[settings.integrator]
    parts = (*([Actuator] if mechanism.actuators else []), *([Force] if mechanism.forces else []))
    kinds = [integrator, MechanismMotion, *parts]
    never = "ConstraintDynamics" if settings.proximal is None else "NullSpace"
    instead = {
        "checks": "class checks:\n    RATIO = {}",
        "lacks_inertia": f"def lacks_inertia(_):\n    return {run.tree.light}",
        "moved": "def moved(signal, _):\n    return signal, 0.0, 0.0",
        "varies": "def varies(signal):\n    return False",
        "value_at": "def value_at(signal, *_):\n    return signal",
    }
    instead["INTEGRATORS"] = f"INTEGRATORS = {{{settings.integrator!r}: {integrator.__name__}}}"
    instead |= {never: f"{never} = None", "held_points": "def held_points(_, loop):\n    return HELD[loop.name]"}
    uses = ("advance", "motion", "tree", "rows", "at", "residual", "body", "sprung", "springs", "closed", "length")
    cut = CutOut(kinds, uses, instead)
    numbers = assignment(
        START=[part.tolist() for part in mechanism.start()],
        PLACES_OF={joint.name: mechanism.place_of(joint.name) for joint in mechanism.joints if joint.nq == 1},
        HELD={loop.name: held_points(mechanism, loop) for loop in mechanism.loops},
        PLACES=[(mechanism.body_index[body], [float(x) for x in place]) for body, place in mechanism.followed],
    )
    constants = f"MECHANISM = {cut.literal(mechanism)}\nSETTINGS = {cut.literal(settings)}\n"
    return f"{cut.head}\n{cut.text}\n\n{numbers}{constants}{_OF_A_MECHANISM}"
