"""Protocol of readers: classes by which an engine's own importer of robot files is checked.

A package announces a reader in the entry-point group ``proofroll.robot_readers`` under the name of its engine. It runs
in a process of its own. An exception while it reads counts as the engine's refusal, with its text as the reason.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, ClassVar, Protocol

import numpy as np

from proofroll.robots.model import Array, Robot
from proofroll.robots.states import RobotStates

GROUP = "proofroll.robot_readers"


@dataclasses.dataclass(frozen=True)
class Request:
    """Request to a reader.

    Attributes:
        path: path of the file; the only files that it names are meshes.
        kind: ``urdf`` or ``mjcf``.
        base: for URDF, ``fixed`` (the root is part of the world) or ``free``.
        base_joint: name under which the reading has the free joint of a URDF's root.
        options: the user's options for this engine, by keys of the reader's ``options``.
        children: moving joint -> the body that it carries, as the file names them.
        states: states at which everything is evaluated.
        torques: moving joint -> torques for the forward dynamics, shape (states, velocities of the joint).
        gravity: gravity for a URDF, which has none [m/s²], shape (3,).
        robot: the file's meaning, for an engine without an importer.
    """

    path: Path
    kind: str
    base: str
    base_joint: str
    options: Mapping[str, bool]
    children: Mapping[str, str]
    states: RobotStates
    torques: Mapping[str, Array]
    gravity: Array
    robot: Robot


@dataclasses.dataclass
class Reading:
    """Reading of a file by an engine; velocities as in :mod:`proofroll.robots.states`.

    Attributes:
        joints: moving joints in the order of velocities.
        dofs: number of velocities of each.
        mass, com, inertia: joint -> mass [kg], centre of mass [m] and inertia about it [kg m²] of the composite of all
            bodies that it carries rigidly, in the frame of its child.
        position, rotation: joint -> frame of its child in the world, shapes (states, 3) and (states, 3, 3).
        coupled: joints that the engine couples to another as the file's mimic says.
        M, g, h: mass matrix, torque of gravity, torque of gravity and velocities (see
            :class:`proofroll.robots.check.two_formulations.Dynamics`).
        inverse: torque for the accelerations asked, without damping, friction and springs, shape (states, n); None: not
            offered.
        forward: acceleration for the torques asked, with all of them, shape (states, n); None: not offered.
        remarks: actions of the reader and messages of the engine, as sentences.
    """

    joints: tuple[str, ...]
    dofs: tuple[int, ...]
    mass: dict[str, float]
    com: dict[str, Array]
    inertia: dict[str, Array]
    position: dict[str, Array]
    rotation: dict[str, Array]
    M: Array
    g: Array
    h: Array
    inverse: Array | None = None
    forward: Array | None = None
    coupled: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()

    def first(self, count: int) -> Reading:
        """Reading restricted to the first ``count`` states."""
        return dataclasses.replace(
            self,
            position={joint: rows[:count] for joint, rows in self.position.items()},
            rotation={joint: rows[:count] for joint, rows in self.rotation.items()},
            M=self.M[:count],
            g=self.g[:count],
            h=self.h[:count],
            inverse=None if self.inverse is None else self.inverse[:count],
            forward=None if self.forward is None else self.forward[:count],
        )


@dataclasses.dataclass(frozen=True)
class Whole:
    """Totals of a file as an engine reads it: the number of velocities, and the mass that joints carry [kg]."""

    velocities: int
    mass: float


class RobotReader(Protocol):
    """An engine's importer.

    A reader whose engine defines a format has that format as ``defines``, and two methods: ``compiled(path)`` returns
    the compiled model as a :class:`Robot`, which is the file's meaning; ``expanded(path)`` returns the file's text with
    macros written out.

    A reader may have ``as_written(request)``, which loads the user's own file as a user of the engine would, and
    returns a :class:`Whole`; :meth:`read` gets a copy without looks, contacts and meshes that give no mass.

    A reader whose engine has no importer, and that feeds it from ``request.robot``, sets ``fed = True``. One with the
    engine's name for people as ``title`` spares the command from loading the engine for it.

    Attributes:
        kinds: formats that it reads.
        options: option of the importer -> its effect.
        tolerances: layer -> largest difference that counts as agreement, where the engine computes with less than
            double precision; the code gives the reason.
        says: a sentence that is shown with every reading; empty: nothing special.
    """

    kinds: ClassVar[tuple[str, ...]]
    options: ClassVar[Mapping[str, str]]
    says: ClassVar[str]

    @property
    def tolerances(self) -> Mapping[str, float]:
        """Tolerances by layer; a class attribute is enough."""

    def version(self) -> str:
        """Version of the engine."""

    def read(self, request: Request) -> Reading:
        """Reads a file, and evaluates the engine's model of it at all states.

        Raises:
            Refused: the file cannot be read or evaluated; any other exception counts as the same.
        """


@dataclasses.dataclass(frozen=True)
class AtState:
    """Terms of an engine in one state, in its own velocities ν_e = T ν; ν: those of :mod:`proofroll.robots.states`.

    Attributes:
        T: matrix of the change of velocities, shape (n, n).
        drift: dT/dt ν, shape (n,).
        M, g, h: as in :class:`Reading`, in the engine's velocities.
        inverse: acceleration ν̇_e -> torque; None: not offered.
        forward: torque -> acceleration ν̇_e; None: not offered.
    """

    T: Array
    drift: Array
    M: Array
    g: Array
    h: Array
    inverse: Callable[[Array], Array] | None
    forward: Callable[[Array], Array] | None


def evaluate(
    request: Request, joints: tuple[str, ...], dofs: tuple[int, ...], state_at: Callable[[int], AtState]
) -> dict[str, Any]:
    """Arrays ``M``, ``g``, ``h``, ``inverse`` and ``forward`` of a :class:`Reading`, evaluated state by state.

    Args:
        request: the request.
        joints: the engine's moving joints in the order of its velocities.
        dofs: number of velocities of each.
        state_at: puts the engine into the state of this index; ``inverse`` and ``forward`` are called before the next.
    """
    rows: dict[str, list[Array]] = {"M": [], "g": [], "h": [], "inverse": [], "forward": []}
    asked = [_stack(rates, joints, dofs) for rates in (request.states.acceleration, request.torques)]
    for index in range(request.states.count):
        state = state_at(index)
        acceleration, torque = (rates[index] for rates in asked)
        T = state.T
        rows["M"].append(T.T @ state.M @ T)
        rows["g"].append(T.T @ state.g)
        rows["h"].append(T.T @ (state.h + state.M @ state.drift))
        if state.inverse is not None:
            rows["inverse"].append(T.T @ np.asarray(state.inverse(T @ acceleration + state.drift)))
        if state.forward is not None:
            reached = np.asarray(state.forward(np.linalg.solve(T.T, torque)))
            rows["forward"].append(np.asarray(np.linalg.solve(T, reached - state.drift), dtype=np.float64))
    return {name: np.array(values) if values else None for name, values in rows.items()}


def _stack(rates: Mapping[str, Array], joints: tuple[str, ...], dofs: tuple[int, ...]) -> Array:
    """Rates in the engine's order, shape (states, n); zero for joints that the file lacks or has of another kind."""
    count = len(next(iter(rates.values())))
    pairs = ((rates.get(name), np.zeros((count, dof))) for name, dof in zip(joints, dofs, strict=True))
    parts = [np.zeros((count, 0))]
    parts += [zero if rate is None or rate.shape[1] != zero.shape[1] else rate for rate, zero in pairs]
    return np.concatenate(parts, axis=1)


WATCHED = 1.0  # s: duration of the run in which shapes that come near each other are looked for
OVERLAPPING_DROP = 0.01  # m: height over the floor of a robot that its file lets overlap the floor
OVERLAP = 1e-6  # m: at the start, that digits of a file make of shapes that touch


def lift(lowest: float, drop: float | None) -> float:
    """Way by which a robot is moved up [m].

    Args:
        lowest: height of its lowest shape over the floor [m].
        drop: the height that is asked for [m]; None: as it is, or 1 cm where it overlaps the floor by more than digits.
    """
    if drop is not None:
        return drop - lowest
    return OVERLAPPING_DROP - lowest if lowest < -OVERLAP else max(-lowest, 0.0)
