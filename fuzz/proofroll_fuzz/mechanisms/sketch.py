"""Sketch of a random mechanism: natural units, the tables of its scene file, and where its bodies start."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from proofroll.adapter import WITH_AXIS, Array, JointKind, frame_of_axis, to_quaternion
from proofroll.elements.mechanism.scene.joint_kinds import ONE_COORDINATE, WITH_QUATERNION
from proofroll.elements.mechanism.scene.rotations import from_rpy
from proofroll_fuzz.drawing import Choices, three_digits
from proofroll_fuzz.mechanisms.poses import PosesAtStart, floats

_STEPS = 250  # of the natural time √(L/g)
_EVERY = 20  # steps between samples
_SELDOM = 0.15  # probability of another decade of lengths, masses, speeds or of one body's mass
_AXES = ([0, 0, 1], [0, 1, 0], [1, 0, 0], [0.6, 0, 0.8], [1, 2, -1])
SCREW, GIMBAL = "screw", "gimbal"


class Sketch(PosesAtStart):
    """A mechanism that is being drawn.

    Attributes:
        choices: of its seed.
        length, mass, gravity: natural units [m], [kg], [m/s²].
        time: natural unit of time √(length/gravity) [s].
        moment: mass · gravity · length [N m].
        tables: name of a table of the scene file -> its rows.
        speed: size of speeds at the start, in natural units.
    """

    def __init__(self, choices: Choices) -> None:
        super().__init__()
        self.choices = choices
        self.length = choices.decade(-2, 2) if choices.happens(_SELDOM) else 1.0
        self.mass = choices.decade(-3, 3) if choices.happens(_SELDOM) else 1.0
        self.gravity = choices.decade(-1, 3) if choices.happens(_SELDOM) else choices.pick((9.81, 10.0, 1.62))
        self.time = math.sqrt(self.length / self.gravity)
        self.moment = self.mass * self.gravity * self.length
        self.speed = choices.pick((10.0, 30.0)) if choices.happens(_SELDOM) else 1.0
        self.tables: dict[str, list[dict[str, Any]]] = {}
        self._direction = self.turned()[:, 2]

    def turned(self) -> Array:
        """A random rotation."""
        return from_rpy([self.choices.number(-3, 3) for _ in range(3)])

    def fall_along(self, direction: Array) -> None:
        """Sets the direction of gravity, a unit vector."""
        self._direction = direction

    def add(self, table: str, **row: Any) -> dict[str, Any]:
        """Adds a row, named by the first letters of its table and its number, unless it brings a name."""
        rows = self.tables.setdefault(table, [])
        rows.append({"name": f"{table[:3].rstrip('s')}{len(rows) + 1}", **row})
        return rows[-1]

    def add_body(self, **keys: Any) -> dict[str, Any]:
        """Adds a body about as large as the unit of length, with unequal moments; ``keys``: fixed values."""
        ratio = self.choices.decade(-4, 4) if self.choices.happens(_SELDOM) else self.choices.pick((1.0, 1.0, 0.5, 2.0))
        mass = three_digits(self.mass * ratio)
        moments = [self.choices.number(0.1, 0.19, mass * self.length**2) for _ in range(3)]  # any two exceed the third
        return self.add(
            "bodies", **{"mass": mass, "com": self.choices.vector(0.5 * self.length), "inertia": moments} | keys
        )

    def add_joint(self, kind: str, parent: str, child: str, **keys: Any) -> dict[str, Any]:
        """Adds a joint in a turned frame, with a pose and a velocity.

        Args:
            kind: of the joint; besides those of the vocabulary ``screw`` and ``gimbal``.
            parent: name of a body, or ``world``.
            child: name of a body.
            **keys: fixed values of further keys; None leaves a key out.
        """
        choices = self.choices
        row: dict[str, Any] = {"kind": kind, "parent": parent, "child": child}
        row |= {"position": choices.vector(self.length), "orientation": choices.vector(1.5)}
        if choices.happens(0.4):
            row["child_position"] = choices.vector(0.5 * self.length)
        if kind in {*WITH_AXIS, SCREW, GIMBAL}:
            row["axis"] = list(choices.pick(_AXES))
        if kind in {JointKind.UNIVERSAL, JointKind.PLANAR, GIMBAL}:
            row["second_axis"] = floats(frame_of_axis(row["axis"])[:, 0])
        if kind == SCREW:
            row["lead"] = choices.pick((1, -1)) * choices.number(0.05, 0.3, self.length)
        if start := self._start(kind):
            row["q0"], row["v0"] = start
        row |= keys
        joint = self.add("joints", **{key: value for key, value in row.items() if value is not None})
        self.hang(joint)
        return joint

    def _start(self, kind: str) -> tuple[Any, Any] | None:
        """Coordinates and velocities of a joint of this kind; None: it has none."""
        choices, speed = self.choices, self.speed / self.time
        slides, turns = {
            JointKind.FIXED: (0, 0),
            JointKind.PRISMATIC: (1, 0),
            JointKind.CYLINDRICAL: (1, 1),
            JointKind.PLANAR: (2, 1),
            JointKind.UNIVERSAL: (0, 2),
            GIMBAL: (0, 3),
            JointKind.SPHERICAL: (0, 3),
            JointKind.FREE: (3, 3),
        }.get(kind, (0, 1))
        places = [choices.number(-0.5, 0.5, self.length) for _ in range(slides)]
        angles = [choices.number(-1.2, 1.2) for _ in range(turns)]
        if kind in WITH_QUATERNION:
            angles = floats(to_quaternion(from_rpy(angles)))
        sizes = [self.length * speed] * slides + [speed] * turns
        rates = [choices.number(-1, 1, size) for size in sizes]
        if not rates:
            return None
        return ([*places, *angles], rates) if len(rates) > 1 else ([*places, *angles][0], rates[0])

    @property
    def bodies(self) -> list[str]:
        """Names of the bodies."""
        return [row["name"] for row in self.tables.get("bodies", ())]

    def simple_joint(self, among: Sequence[str] = ONE_COORDINATE) -> dict[str, Any]:
        """A joint of one coordinate that nothing prescribes, couples or drives; one is added where there is none."""
        couplings, actuators = (self.tables.get(table, []) for table in ("couplings", "actuators"))
        tied = {name for row in couplings for name in (row["joint_a"], row["joint_b"])}
        tied |= {row["joint"] for row in actuators}
        rows = [row for row in self.tables["joints"] if row["kind"] in among and row["name"] not in tied]
        rows = [row for row in rows if "motion" not in row]
        if rows:
            return self.choices.pick(rows)
        parent = self.choices.pick(self.bodies)
        return self.add_joint(self.choices.pick(among), parent, self.add_body()["name"])

    def effort(self, joint: dict[str, Any]) -> float:
        """Natural unit of the effort of a joint of one coordinate [N m] or [N]."""
        return self.moment / self.unit(joint)

    def unit(self, joint: dict[str, Any]) -> float:
        """Natural unit of the coordinate of a joint of one coordinate: 1 rad, or the length [m]."""
        return self.length if joint["kind"] == JointKind.PRISMATIC else 1.0

    def content(self) -> dict[str, Any]:
        """Content of the scene file; lasts 100 or 200 steps."""
        step = float(f"{self.time / _STEPS:.1g}")
        every = float(f"{_EVERY * step:.6g}")
        return {
            "title": "A random scene",
            "source": "drawn from a seed",
            "duration": float(f"{every * self.choices.pick((5, 10)):.6g}"),
            "dt": step,
            "every": every,
            "gravity": {"magnitude": self.gravity, "direction": floats(self._direction)},
            **self.tables,
        }
