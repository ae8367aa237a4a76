"""Controller of a robot as data: rate, gains by pattern, targets or a policy, pose and start, read from a TOML file."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np

from proofroll.core.errors import InputError, choices, error_location, require_known
from proofroll.core.parameters import Parameters, Unit
from proofroll.core.validation import strict, units_of, validated
from proofroll.elements.mechanism.scene.signal import Signal, Table, checked, read_signal
from proofroll.files.csv_table import read_csv
from proofroll.files.toml import read_toml
from proofroll.robots.model import Array

HELD = ("target", "effort")
FEET = "file"  # the shapes of the robot file
_NO_NUMBERS = Parameters({}, {})
_PLACE, _RATE = "rad or m", "rad/s or m/s"
# Numbers of a base in a start: place and quaternion; velocity and angular velocity.
_BASE, _BASE_VELOCITY = 7, 6
_UNIT_LENGTH = 1e-3  # largest deviation of a quaternion's length from 1 that digits of a file explain


@dataclass(frozen=True)
class Gains:
    """Servo of all joints that a pattern names: effort = kp (target - q) - kd dq/dt, clamped to ±limit.

    Attributes:
        joints: pattern of joint names (``*`` any characters, ``?`` one), or a list of patterns.
        kp: gain of the position.
        kd: gain of the velocity.
        limit: largest size of the whole effort; None: the robot file's, if it has one.
        armature: inertia added to the joint's own coordinate; None: the robot file's.
    """

    joints: tuple[str, ...]
    kp: float = field(default=0.0, metadata={"unit": "N m/rad or N/m"})
    kd: float = field(default=0.0, metadata={"unit": "N m s/rad or N s/m"})
    limit: float | None = field(default=None, metadata={"unit": "N m or N"})
    armature: float | None = field(default=None, metadata={"unit": "kg m^2 or kg"})

    def fits(self, joint: str) -> bool:
        """True if a pattern fits the name of a joint."""
        return any(fnmatchcase(joint, pattern) for pattern in self.joints)


@dataclass(frozen=True)
class PolicyCall:
    """Policy of a controller: target = pose + scale · action.

    Attributes:
        call: ``module:make``, or a name that a package announces as an entry point of ``proofroll.policies``.
        scale: of an action [rad or m].
    """

    call: str
    scale: float = field(default=1.0, metadata={"unit": _PLACE})


@dataclass(frozen=True)
class RobotStart:
    """State of the robot at time 0.

    Attributes:
        base: place of the root link [m] and its attitude as a quaternion, scalar first; shape (7,).
        base_velocity: velocity of the root link's origin in the world's axes [m/s], and its angular velocity in its own
            axes [rad/s]; shape (6,).
        q: joint -> coordinate, in place of its pose.
        v: joint -> velocity; 0 by default.
        drop: height of the lowest foot above the ground [m].
        keyframe: name of a keyframe of the robot file, or its number, in place of pose and rest; empty: none.
    """

    base: tuple[float, ...] | None = None
    base_velocity: tuple[float, ...] = (0.0,) * _BASE_VELOCITY
    q: dict[str, float] = field(default_factory=dict)
    v: dict[str, float] = field(default_factory=dict)
    drop: float | None = field(default=None, metadata={"unit": "m"})
    keyframe: str = ""


@dataclass(frozen=True)
class GroundContact:
    """Plane under a robot.

    Attributes:
        feet: ``file`` (shapes of the robot file), or link -> radius of a ball at its origin [m].
        friction: coefficient of the pair of a foot and the ground; None: that of the file, or 1 where it has none.
    """

    feet: dict[str, float] | str = FEET
    friction: float | None = field(default=None, metadata={"unit": "1"})


@dataclass(frozen=True)
class Controller:
    """Controller of a robot; at its instants k/rate it sets targets, which joints follow by their gains.

    Attributes:
        rate: instants per second [Hz]; None: targets change continuously.
        held: ``target`` (the effort follows the state at all times) or ``effort`` (held between instants).
        delay: whole instants from an observation to the target that results; the pose is the target before.
        order: joints in the order of arrays of a policy; empty: order of the robot file.
        pose: joint -> default coordinate, at the start and for an action of 0.
        gains: servos; the last one whose pattern fits a joint counts.
        targets: joint -> target [rad or m]; the pose is the target of all others.
        policy: None: the targets do not depend on the state.
        start: state at time 0.
        ground: None: there is none.
    """

    rate: float | None = field(default=None, metadata={"unit": "Hz"})
    held: str = "target"
    delay: int = 0
    order: tuple[str, ...] = ()
    pose: dict[str, float] = field(default_factory=dict)
    gains: tuple[Gains, ...] = ()
    targets: dict[str, Any] = field(default_factory=dict)
    policy: PolicyCall | None = None
    start: RobotStart = field(default_factory=RobotStart)
    ground: GroundContact | None = None

    def __post_init__(self) -> None:
        for name, value, wrong, advice in self._rules():
            if wrong:
                raise InputError(name, value, advice)

    def _rules(self) -> Iterable[tuple[str, object, bool, str]]:
        """Field, value, whether it is wrong, and advice."""
        rate = self.rate
        advice = "give a positive number of instants per second, or leave it out"
        yield "rate", rate, rate is not None and rate <= 0, advice
        yield "held", self.held, self.held not in HELD, f"choose one of {', '.join(HELD)}"
        yield "delay", self.delay, self.delay < 0, "a delay is a whole number of instants, at least 0"
        for name, value, active in (
            ("held", self.held, self.held == "effort"),
            ("delay", self.delay, self.delay > 0),
            ("policy.call", self.policy and self.policy.call, self.policy is not None),
        ):
            yield name, value, active and rate is None, "it needs instants; give the rate in Hz"
        repeated = [name for name in self.order if self.order.count(name) > 1]
        yield "order", repeated[:1], bool(repeated), "a joint is in the order twice; name each once"
        for number, gain in enumerate(self.gains):
            for key in ("kp", "kd", "armature"):
                value = getattr(gain, key)
                yield f"gains.{number}.{key}", value, value is not None and value < 0, "must be at least 0"
            limit = gain.limit
            yield f"gains.{number}.limit", limit, limit is not None and limit <= 0, "must be above 0; or leave it out"
            yield f"gains.{number}.joints", list(gain.joints), not gain.joints, "name a joint or a pattern as *_HAA"
        both = bool(self.policy and self.targets)
        advice = "a policy sets all targets; leave out [targets] or [policy]"
        yield "targets", next(iter(self.targets), ""), both, advice
        start, ground = self.start, self.ground
        advice = "give seven numbers: x, y, z in m and a quaternion of length 1, scalar first"
        base = (*(start.base or ()),)
        turned = len(base) == _BASE and abs(float(np.linalg.norm(base[3:])) - 1.0) < _UNIT_LENGTH
        yield "start.base", start.base, start.base is not None and not turned, advice
        advice = "give six numbers: velocity in the world's axes in m/s, angular velocity in the body's axes in rad/s"
        yield "start.base_velocity", start.base_velocity, len(start.base_velocity) != _BASE_VELOCITY, advice
        advice = "it is a height above the ground; give [start] base"
        yield "start.drop", start.drop, start.drop is not None and ground is None, advice
        yield "start.drop", start.drop, start.drop is not None and start.drop < 0, "must be at least 0"
        if ground is not None:
            feet, advice = ground.feet, f'give "{FEET}", or a table of links and radii in m, of one at least'
            wrong = feet != FEET if isinstance(feet, str) else not feet or min(feet.values()) < 0
            yield "ground.feet", feet, wrong, advice
            friction = ground.friction
            yield "ground.friction", friction, friction is not None and friction < 0, "must be at least 0"

    @property
    def period(self) -> float | None:
        """Time between instants [s]; None: targets change continuously."""
        return None if self.rate is None else 1.0 / self.rate

    def servo(self, joint: str) -> Gains | None:
        """Gains of a joint; None: nothing drives it."""
        return next((gains for gains in reversed(self.gains) if gains.fits(joint)), None)

    def names(self, joint: str) -> bool:
        """True if the controller names a joint itself, not by a pattern alone."""
        return joint in self.order or joint in self.targets or any(joint in gains.joints for gains in self.gains)

    def poses(self, joints: Sequence[str]) -> Array:
        """Default coordinates of joints [rad or m]; 0 for a joint without a pose."""
        return np.array([self.pose.get(joint, 0.0) for joint in joints])

    def require_joints(self, joints: Sequence[str], moving: Mapping[str, str], driven: Collection[str] = ()) -> None:
        """Checks every name and pattern against the joints of a robot.

        Args:
            joints: revolute and prismatic joints, which a servo can drive.
            moving: joint -> kind, of all joints that move.
            driven: joints with a servo in the robot's own file.

        Raises:
            InputError: a joint does not exist or has several coordinates, a pattern fits none, or one has no gains.
        """
        for name, names in (
            ("order", self.order),
            ("pose", self.pose),
            ("targets", self.targets),
            ("start.q", self.start.q),
            ("start.v", self.start.v),
        ):
            for joint in names:
                if joint in moving and joint not in joints:
                    advice = f"a {moving[joint]} joint has no single coordinate; name a revolute or prismatic one"
                    raise InputError(name, joint, advice)
                require_known(name, joint, joints, "the robot has no such joint; choose from")
        for number, gains in enumerate(self.gains):
            for pattern in gains.joints:
                if not any(fnmatchcase(joint, pattern) for joint in joints):
                    advice = f"no joint of the robot fits; it has {choices(joints, pattern)}"
                    raise InputError(f"gains.{number}.joints", pattern, advice)
        for name, names in (("order", self.order), ("targets", self.targets)):
            for joint in names:
                if self.servo(joint) is None and joint not in driven:
                    raise InputError(name, joint, "no [[gains]] fit this joint; give its kp and kd")
        missing = [joint for joint in joints if self.servo(joint) and self.order and joint not in self.order]
        if missing:
            raise InputError("order", list(self.order), f"it lacks {choices(missing)}; name every joint with gains")


strict(Controller, Gains, PolicyCall, RobotStart, GroundContact, finite=True)
# Tables of a controller with the dataclass that holds them, or the unit of all their numbers.
_TABLES: Mapping[str, type[Any]] = {"policy": PolicyCall, "start": RobotStart, "ground": GroundContact}
_START_UNITS: Mapping[str, Unit] = {"q": _PLACE, "v": _RATE}


def read_controller(path: Path) -> Controller:
    """Controller of a TOML file; a table of targets lies beside it.

    Raises:
        InputError: the first mistake in the file, in one line.
    """
    return controller_of(read_toml(path), path)


def controller_of(content: Mapping[str, Any], path: Path) -> Controller:
    """Controller of the content of a file at ``path``; see :func:`read_controller`."""
    with error_location(str(path)):
        tables: dict[str, Any] = dict(content)
        if isinstance(tables.get("start"), str):
            tables["start"] = {"keyframe": tables["start"]}
        for name in ("pose", "targets", *_TABLES):
            _require_table(name, tables.get(name, {}))
        gains = tables.get("gains", [])
        if not isinstance(gains, list):
            raise InputError("gains", gains, "give tables [[gains]]")
        if "gains" in tables:
            tables["gains"] = [_gains(f"gains.{number}", row) for number, row in enumerate(gains)]
        if "rate" in tables:
            tables["rate"] = _NO_NUMBERS.filled(tables["rate"], "rate", {}, "Hz")
        if "pose" in tables:
            tables["pose"] = _coordinates("pose", tables["pose"], _PLACE)
        if "targets" in tables:
            tables["targets"] = _targets(tables["targets"], path)
        for name, kind in _TABLES.items():
            if name in tables:
                table = dict(tables[name])
                for key, unit in _START_UNITS.items() if name == "start" else ():
                    if key in table:
                        _require_table(f"start.{key}", table[key])
                        table[key] = _coordinates(f"start.{key}", table[key], str(unit))
                if not isinstance(feet := table.get("feet", FEET), str):
                    _require_table("ground.feet", feet)
                    table["feet"] = _coordinates("ground.feet", feet, "m")
                tables[name] = _NO_NUMBERS.filled(table, name, units_of(kind))
        return validated(Controller, tables, str(path))


def _require_table(name: str, value: object) -> None:
    """Raises InputError unless a value is a table."""
    if not isinstance(value, dict):
        raise InputError(name, value, "give a table of names and values")


def _coordinates(name: str, table: Mapping[str, Any], unit: str) -> dict[str, Any]:
    """Numbers by joint, formulas and degrees evaluated."""
    return {joint: _NO_NUMBERS.filled(value, f"{name}.{joint}", {}, unit) for joint, value in table.items()}


def _gains(name: str, row: Any) -> dict[str, Any]:
    """Table of gains; a single pattern stands for a list of one."""
    _require_table(name, row)
    if "joints" not in row:
        raise InputError(f"{name}.joints", None, "name the joints, or a pattern as *_HAA")
    patterns = [row["joints"]] if isinstance(row["joints"], str) else row["joints"]
    filled: dict[str, Any] = _NO_NUMBERS.filled({**row, "joints": patterns}, name, units_of(Gains))
    return filled


def _targets(table: Mapping[str, Any], path: Path) -> dict[str, Signal]:
    """Targets by joint; a CSV named ``table`` has a column for the time and one for each joint."""
    if not isinstance(table.get("table"), str) or not table["table"].endswith(".csv"):
        return {joint: _target(f"targets.{joint}", signal) for joint, signal in table.items()}
    if len(table) > 1:
        raise InputError("targets", sorted(table), "give a table of all targets, or the joints one by one; not both")
    file = path.parent / table["table"]
    try:
        columns = read_csv(file.read_text(encoding="utf-8"))
        times = tuple(columns["time"].to_numpy().tolist())
        names = [str(name) for name in columns.data_vars]
        return {name: Table(times, tuple(columns[name].to_numpy().tolist())) for name in names}
    except (OSError, UnicodeDecodeError) as error:
        raise InputError("targets.table", table["table"], f"the file cannot be read: {error}") from None
    except (ValueError, InputError) as error:
        raise InputError("targets.table", table["table"], str(error)) from None


def _target(name: str, signal: Any) -> Signal:
    signal = read_signal(name, signal, _NO_NUMBERS, _PLACE)
    if isinstance(signal, str):
        signal = _NO_NUMBERS.filled(signal, name, {}, _PLACE)
    return checked(name, signal)
