"""Balance of a mechanism: an equilibrium, the efforts that hold it, and eigenvalues, of the truth and of engines."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from proofroll.core.errors import InputError, ProofrollError, Refused, require_known
from proofroll.core.scene import Scene
from proofroll.elements.mechanism import Joint, Mechanism, Tree
from proofroll.elements.mechanism.dynamics.analysis import analyse
from proofroll.elements.mechanism.dynamics.held_signals import at_start
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.dynamics.named_forces import lengths, named_forces, pick_named
from proofroll.elements.mechanism.reading.assembly import started
from proofroll.elements.mechanism.run.dataset import along, reactions
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.prescribed import moved
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import build
from proofroll.studies.comparison.default_comparison import able
from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates
from proofroll_balance.linearised import Apart, InTree, Spectrum, apart, at_rest, spectrum

# Displacement for an engine's accelerations: of doubles with softened rows and own differences of 1e-10.
_STEP = 1e-2


@dataclass(frozen=True)
class Value:
    """A number of the truth, with the difference of its two routes.

    Attributes:
        name, unit: as results have them.
        value: of route 1.
        error_bar: difference from route 2.
    """

    name: str
    unit: str
    value: float
    error_bar: float


@dataclass(frozen=True)
class EngineBalance:
    """Answer of an engine at the equilibrium.

    Attributes:
        engine: name and formulation.
        refused: reason why it says nothing; else empty.
        left: largest acceleration that it has there [m/s², rad/s²]; None: it does not say.
        efforts: largest difference of efforts, relative to the largest effort; None: it gives none.
        reactions: of determinate forces and moments of joints, relative to the largest; None: it gives none.
        eigenvalues: of eigenvalues, relative to the largest; None: it gives no accelerations.
        agrees: True if all that it gives is within the tolerance.
    """

    engine: str
    refused: str = ""
    left: float | None = None
    efforts: float | None = None
    reactions: float | None = None
    eigenvalues: float | None = None
    agrees: bool = False


@dataclass(frozen=True)
class Balance:
    """Result of :func:`balance`.

    Attributes:
        scene: name.
        held: joints that are held where they start.
        freedom: degrees of freedom that are left.
        values: coordinates, efforts, and determinate forces and moments on children of joints, at the joint.
        eigenvalues: pairs of real and imaginary part [1/s].
        eigenvalue_error: difference of the eigenvalues of both routes [1/s].
        stable: True if no eigenvalue has a positive real part.
        engines: each engine that was asked.
    """

    scene: str
    held: tuple[str, ...]
    freedom: int
    values: tuple[Value, ...]
    eigenvalues: tuple[tuple[float, float], ...]
    eigenvalue_error: float
    stable: bool
    engines: tuple[EngineBalance, ...] = field(default=())


def balance(
    name: str,
    parameters: dict[str, Any],
    engines: Sequence[str] = (),
    hold: Sequence[str] = (),
    tolerance: float = 1e-3,
    progress: Callable[[str], None] = lambda _: None,
) -> Balance:
    """Equilibrium of a scene near its start, with all velocities zero and all signals as at time 0.

    Args:
        name: of the scene.
        parameters: of the scene, if not its defaults.
        engines: as for a comparison; empty: all that can represent it.
        hold: joints that are held where they start; their efforts are ``drive.<joint>``.
        tolerance: relative, up to which an engine agrees.
        progress: called with the name of each engine.

    Raises:
        InputError: there is no such scene or joint.
        Refused: no equilibrium is found, or laws of the scene leave a range of them.
    """
    scene = load_scene(name, **parameters)
    (element,) = scene.elements if len(scene.elements) == 1 else (None,)
    if not isinstance(element, MechanismElement):
        raise InputError("scene", name, "a balance is of one mechanism; name a scene of bodies and joints")
    resting = stilled(element.mechanism, hold)
    equations = JointCoordinates(resting)
    q = at_rest(equations)
    posed = started(resting, q, np.zeros(resting.nv))
    if analyse(posed).singular_start:
        raise Refused(
            "the equilibrium is a singular pose of the loops, where no forces are determinate; start elsewhere"
        )
    truth = spectrum(InTree(equations, q))
    second = MaximalCoordinates(posed)
    second_spectrum = spectrum(Apart(second))
    values = _values(posed, equations, q, second)
    eigenvalues = truth.eigenvalues
    bar = apart(eigenvalues, second_spectrum.eigenvalues)
    least = max(bar, 1e-6 * float(np.abs(eigenvalues).max(initial=0.0)))
    asked = list(engines) or able(_with(scene, element, posed))
    return Balance(
        scene=scene.name,
        held=tuple(hold),
        freedom=analyse(posed).mobility,
        values=values,
        eigenvalues=tuple((float(eigenvalue.real), float(eigenvalue.imag)) for eigenvalue in eigenvalues),
        eigenvalue_error=bar,
        stable=bool((eigenvalues.real <= least).all()),
        engines=tuple(
            _asked(text, scene, element, (resting, q), truth, (equations, posed), tolerance, progress) for text in asked
        ),
    )


def stilled(mechanism: Mechanism, hold: Sequence[str] = ()) -> Mechanism:
    """Mechanism with all velocities zero, signals as at time 0, and joints held where they start.

    Raises:
        InputError: a joint that is to be held does not exist or has several coordinates.
        Refused: contacts, dry friction or stops leave a range of equilibria.
    """
    if mechanism.contacts:
        raise Refused("contacts may hold a body in a range of poses, and no balance follows them yet")
    mechanism = at_start(mechanism)
    single = {joint.name: joint for joint in mechanism.joints if joint.nq == 1}
    for name in hold:
        require_known("--hold", name, sorted(single), "there is no such joint with one coordinate; choose from")

    def rested(joint: Joint) -> Joint:
        if joint.friction:
            raise Refused(f"dry friction in joint {joint.name} holds it in a range of poses; set it to zero")
        if joint.motion is not None or joint.name in hold:
            place = joint.q0[0] if joint.motion is None else float(moved(joint.motion, 0.0).place)
            return replace(joint, motion=place, q0=(), v0=(), limits=None, restitution=0.0)
        return replace(joint, v0=(0.0,) * joint.nv, limits=None, restitution=0.0)

    return replace(mechanism, joints=tuple(rested(joint) for joint in mechanism.joints))


def _with(scene: Scene, element: MechanismElement, mechanism: Mechanism) -> Scene:
    return replace(scene, elements=(replace(element, mechanism=mechanism),))


def _values(posed: Mechanism, equations: JointCoordinates, q: Array, second: MaximalCoordinates) -> tuple[Value, ...]:
    solution, second_solution = equations.sample(q, np.zeros(posed.nv)), second.at_start()
    values = []
    for joint, part in zip(posed.joints, posed.q_slices, strict=True):
        if joint.nq == 1:
            unit = joint.unit
            values.append(Value(f"q.{joint.name}", unit, float(q[part.start]), 0.0))
    for item, value, again in zip(named_forces(posed), solution["named"], second_solution.named[0], strict=True):
        values.append(Value(item.name, str(item.unit), float(value), float(abs(value - again))))
    determinate = analyse(posed).determinate
    for connection, sure, row, again in zip(
        posed.connections, determinate, solution["wrench"], second_solution.wrench[0], strict=True
    ):
        for k, axis in enumerate("xyzxyz"):
            if sure[k] and connection.kind != JointKind.FREE:
                kind, unit = ("force", "N") if k < 3 else ("torque", "N m")
                bar = float(abs(row[k] - again[k]))
                values.append(Value(f"{kind}.{connection.name}.{axis}", unit, float(row[k]), bar))
    return tuple(values)


class _InEngine:
    """An engine's accelerations beside the pose, from the models that it builds there."""

    def __init__(self, made: Callable[[Mechanism], Any], mechanism: Mechanism, place: InTree) -> None:
        self._made, self._mechanism, self._place, self._tree = made, mechanism, place, Tree(mechanism)

    def directions(self) -> Array:
        """See :class:`~proofroll_balance.linearised.Displaced`."""
        return self._place.directions()

    def accelerations(self, displaced: Array, velocities: Array) -> Array:
        """See :class:`~proofroll_balance.linearised.Displaced`."""
        q = self._place.pose(displaced)
        built = self._made(started(self._mechanism, q, velocities)).built()
        if built.acceleration is None or built.angular_acceleration is None:
            raise Refused("it does not report its accelerations")
        reported = np.hstack([np.reshape(part, (-1, 3)) for part in (built.acceleration, built.angular_acceleration)])
        motion = self._tree.at(q, velocities)
        off = (reported - motion.bias[:-1]).ravel()
        return np.asarray(np.linalg.lstsq(motion.J[:-1].reshape(len(off), -1), off, rcond=None)[0])


def _asked(
    text: str,
    scene: Scene,
    element: MechanismElement,
    resting: tuple[Mechanism, Array],
    truth: Spectrum,
    solved: tuple[JointCoordinates, Mechanism],
    tolerance: float,
    progress: Callable[[str], None],
) -> EngineBalance:
    """Balance of one engine at the truth's equilibrium."""
    (mechanism, q), (equations, posed) = resting, solved
    progress(text)

    def made(pose: Mechanism) -> Any:
        return build(_with(scene, element, pose), text)

    try:
        sample = made(posed).sample()
        true = equations.sample(q, np.zeros(posed.nv))
        posed_element = replace(element, mechanism=posed)
        fields = {name: along(sample, name, count) for name, count in lengths(posed).items()}
        efforts = _off(pick_named(posed, fields), true["named"], np.ones(len(true["named"]), dtype=bool))
        wrench = np.hstack([reactions(posed_element, sample, name) for name in ("joint_force", "joint_torque")])
        force = _off(wrench, true["wrench"], analyse(posed).determinate)
        place = _InEngine(made, mechanism, InTree(equations, q))
        try:
            engine_spectrum = spectrum(place, _STEP)
        except Refused:
            return _judged(EngineBalance(engine=text, efforts=efforts, reactions=force), tolerance, 0.0)
    except InputError:
        raise
    except ProofrollError as error:
        return EngineBalance(engine=text, refused=str(error))
    size = float(np.abs(truth.eigenvalues).max(initial=0.0))
    difference = apart(truth.eigenvalues, engine_spectrum.eigenvalues) / size if size else None
    answer = EngineBalance(
        engine=text, left=engine_spectrum.left, efforts=efforts, reactions=force, eigenvalues=difference
    )
    natural = max(float(np.linalg.norm(posed.gravity)), 1e-3)
    return _judged(answer, tolerance, engine_spectrum.left / natural)


def _off(reported: Array, true: Array, counts: NDArray[np.bool_]) -> float | None:
    """Largest difference of the values that count, relative to the largest; None: the engine gives none of them."""
    counts = counts & np.isfinite(reported) & np.isfinite(true)
    if not counts.any():
        return None
    return float(np.abs(reported - true)[counts].max() / (np.abs(true[counts]).max() or 1.0))


def _judged(answer: EngineBalance, tolerance: float, left: float) -> EngineBalance:
    differences = [item for item in (answer.efforts, answer.reactions, answer.eigenvalues, left) if item is not None]
    return replace(answer, agrees=all(item <= tolerance for item in differences))
