"""A program that runs a mechanism with Pinocchio's terms alone: the adapter's steps, cut out of it."""

from __future__ import annotations

from typing import Any

from proofroll.core.cut_out import CutOut
from proofroll.core.errors import Refused
from proofroll.core.integrators import INTEGRATORS
from proofroll.core.program_text import assigned
from proofroll.elements.mechanism.drives import Actuator
from proofroll.elements.mechanism.loop_points import held_points
from proofroll.engines.pinocchio.mechanism_run import MechanismMotion, MechanismRun
from proofroll.engines.pinocchio.settings import PinocchioSettings

_RUN = '''
MECHANISM.start = lambda: (np.array(START[0]), np.array(START[1]))
MECHANISM.place_of = PLACES_OF.get


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


def source(run: MechanismRun, settings: PinocchioSettings) -> str:
    """The program's part that runs a mechanism; of the dynamics it has that of the settings.

    Raises:
        Refused: drives change in time.
    """
    if run.tree.varies:
        raise Refused("programs hold no drives in time yet")
    mechanism: Any = run.tree.mechanism
    followed = [(point.body, point.position) for point in mechanism.points]
    followed = followed or [(body.name, (0.0, 0.0, 0.0)) for body in mechanism.bodies]
    integrator = INTEGRATORS[settings.integrator]
    wanted = [integrator, MechanismMotion, *([Actuator] if mechanism.actuators else [])]
    never = "ConstraintDynamics" if settings.proximal is None else "NullSpace"
    instead = {
        "checks": "class checks:\n    RATIO = {}",
        "varies": "def varies(signal):\n    return False",
        "value_at": "def value_at(signal, *_):\n    return signal",
    }
    instead["INTEGRATORS"] = f"INTEGRATORS = {{{settings.integrator!r}: {integrator.__name__}}}"
    instead |= {never: f"{never} = None", "held_points": "def held_points(_, loop):\n    return HELD[loop.name]"}
    uses = ("advance", "motion", "tree", "rows", "at", "residual", "body", "sprung", "springs", "closed", "length")
    cut = CutOut(wanted, uses, instead)
    numbers = assigned(
        START=[part.tolist() for part in mechanism.start()],
        PLACES_OF={joint.name: mechanism.place_of(joint.name) for joint in mechanism.joints if joint.nq == 1},
        HELD={loop.name: held_points(mechanism, loop) for loop in mechanism.loops},
        PLACES=[(mechanism.body_index[body], [float(x) for x in at]) for body, at in followed],
    )
    given = f"MECHANISM = {cut.literal(mechanism)}\nSETTINGS = {cut.literal(settings)}\n"
    return f"{cut.head}\n{cut.text}\n\n{numbers}{given}{_RUN}"
