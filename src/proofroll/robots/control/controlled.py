"""Scene of a robot under a controller, in the air, and the robots that importers make of its file."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from proofroll.core.errors import InputError, Refused, error_location
from proofroll.core.parameters import Parameters
from proofroll.elements.mechanism import WORLD, Mechanism, Tree
from proofroll.elements.mechanism.contact.start import touches
from proofroll.elements.mechanism.reading.reader import made_mechanism
from proofroll.elements.mechanism.scene.checks import Z
from proofroll.elements.mechanism.scene.control import TARGET, Control
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.model import TOGETHER
from proofroll.elements.mechanism.scene.policy import PolicySource
from proofroll.elements.mechanism.scene.rotations import from_quaternion
from proofroll.elements.mechanism.scene.signal import value_at
from proofroll.robots.control.controller import Controller, Gains, GroundContact, read_controller
from proofroll.robots.files.feet import GROUNDS, NO_FLOOR, NO_GROUND, OF_FILE, StandingRobot, ground_tables
from proofroll.robots.files.robot_file import RobotFile
from proofroll.robots.files.scene_tables import (
    CONTACTS,
    ENDINGS,
    ParameterRow,
    described,
    keyframe_states,
    laws,
    names_of_bodies,
    read_robot,
    scene_actuators,
    tables_of,
)
from proofroll.robots.hypotheses import RobotEvidence, RobotHypothesis, hypotheses
from proofroll.robots.model import Array, Robot
from proofroll.robots.protocol import WATCHED, Reading, lift
from proofroll.robots.states import RobotStates

if TYPE_CHECKING:
    from proofroll.robots.control.base_frames import BaseFrame
    from proofroll.robots.control.bookkeeping.air import HeldRobot

_NOTHING = Reading(
    joints=(),
    dofs=(),
    mass={},
    com={},
    inertia={},
    position={},
    rotation={},
    M=np.empty(0),
    g=np.empty(0),
    h=np.empty(0),
)
MOST = 2  # causes that act together
_DURATION = 0.1  # s: what is wrong with the bookkeeping of a controller shows in the air within it
_GRID, _STEP = 4e-3, 5e-4  # s: sampling of a first look, and its longest step
_LADDER, _FINER = 4, 2  # a ladder's coarsest step has so many of the finest; steps are at most so many times finer
_STANDING = 0.3  # s: duration of a robot on a ground, which lands and stands by then
_SEEN = 1e-6  # m: way of a robot at its start that is told
_GROUND_WORDS = "what the robot stands on: nothing (0), the floor of its file (1), or a plane z = 0 (2)"
_STEEP = 0.1  # cosine between the normal of a plane and the vertical from which on it is a wall
# Times at which servos get their targets while is looked who touches whom [s].
_WATCHED = (np.arange(50) / 50 * WATCHED).tolist()
_ABOVE = 10.0  # m: by which a robot is lifted while the heights of its shapes are measured


@dataclasses.dataclass(frozen=True)
class RecordedRobot:
    """Robot of a record.

    Attributes:
        mechanism: with its servos and its controller.
        grounded: True if the controller has it stand on the ground.
        reductions: joint -> turns of its motor per turn of the joint, of the transmissions in its file.
        speeds: joint -> largest velocity of its drive, of its file [rad/s or m/s].
        ranges: joint -> its limits, of its file [rad or m].
        refs: joint -> number that an MJCF gives it in its pose, where it is not 0 [rad or m].
        base_frames: frames that programs report in place of the frame of a base that floats.
        held: frame of these, or None -> the robot in the air, with that frame as that of its base.
        imported: the same -> robots that importers make of the file.
    """

    mechanism: Mechanism
    grounded: bool
    reductions: Mapping[str, float]
    speeds: Mapping[str, float]
    ranges: Mapping[str, tuple[float, float]]
    refs: Mapping[str, float]
    base_frames: tuple[BaseFrame, ...]
    held: Callable[[BaseFrame | None], HeldRobot]
    imported: Callable[[BaseFrame | None, int], Iterator[HeldRobot]]


class ControlledScenes:
    """Scenes of robot files under the controller of a file; see :class:`proofroll.files.scene_sources.SceneSource`."""

    endings: ClassVar[tuple[str, ...]] = ENDINGS

    def __init__(self, control: Path | None) -> None:
        """``control``: file of the controller; None: there is none, for :meth:`of_record` alone."""
        self._path = control or Path()
        self._controlled = control is not None

    def content(self, path: Path) -> dict[str, Any]:
        """Title, source and parameters of the scene."""
        controller = read_controller(self._path)
        ground = GROUNDS.index(NO_GROUND if controller.ground is None else OF_FILE)
        file, robot = self._robot(path, controller, _base(controller, ground))
        gravity = float(np.linalg.norm(robot.gravity))
        parameters: dict[str, ParameterRow] = {
            "gravity": (gravity, "m/s^2", "acceleration of gravity", {"at_least": 0}),
            "ground": (ground, "1", _GROUND_WORDS, {"at_least": 0, "at_most": len(GROUNDS) - 1, "integer": True}),
        }
        reason = f"How engines move this robot {'on its ground' if ground else 'in the air'} under {self._path.name}"
        times = _times(controller, _STANDING if ground else _DURATION)
        return {"title": f"{robot.name} under {self._path.stem}", "reason": reason, **times} | described(
            file, parameters | laws(robot)
        )

    def tables(self, path: Path, values: Mapping[str, float]) -> dict[str, Any]:
        """Tables of the scene for these values of its parameters.

        Raises:
            InputError: the controller does not fit the robot, or the robot cannot be moved.
        """
        controller = read_controller(self._path)
        file, robot = self._robot(path, controller, _base(controller, int(values["ground"])))
        tables = self._tables(file, robot, controller, values, always=bool(values["ground"]))
        return self._grounded(file, robot, controller, tables, GROUNDS[int(values["ground"])])

    def of_record(self, path: Path, *, free: bool) -> RecordedRobot:
        """Robot that a record is of, wherever it stands.

        Args:
            path: of the robot file.
            free: True if nothing holds the root of a URDF.

        Raises:
            InputError: the controller has no rate, does not fit the robot, or the robot cannot be moved.
        """
        from proofroll.robots.control.base_frames import base_frames

        controller = read_controller(self._path) if self._controlled else Controller(rate=1.0)
        if controller.rate is None:
            advice = "mistakes of bookkeeping are found at a controller's instants; give the rate in Hz"
            raise InputError(f"{self._path}: rate", None, advice)
        if controller.start.base is not None:
            start = dataclasses.replace(controller.start, base=None, base_velocity=(0.0,) * 6)
            controller = dataclasses.replace(controller, start=start)
        file, robot = self._robot(path, controller, "free" if free else "fixed")

        def mechanism_of(robot: Robot) -> Mechanism:
            values = {name: row["value"] for name, row in described(file, laws(robot))["parameters"].items()}
            values["gravity"] = float(np.linalg.norm(robot.gravity))
            tables = dict(self._tables(file, robot, controller, values, always=True))
            if left_out := tables.pop("unmodelled"):
                raise InputError("robot", path, f"it has {left_out[0]}, which no equations here have")
            x, y, z = robot.gravity.tolist()
            del tables["gravity"]
            return made_mechanism(tables, (x, y, z), Parameters({}, {}))

        def held(robot: Robot, frame: BaseFrame | None) -> HeldRobot:
            from proofroll.robots.control.bookkeeping.air import HeldRobot, links_of

            based = robot if frame is None else frame.based(robot)
            return HeldRobot(mechanism_of(based), links_of(based))

        return RecordedRobot(
            mechanism=mechanism_of(robot),
            grounded=controller.ground is not None,
            reductions=file.driven,
            speeds={joint.name: joint.speed for joint in robot.moving if joint.speed},
            ranges={
                joint.name: (joint.lower, joint.upper)
                for joint in robot.moving
                if joint.lower is not None and joint.upper is not None and joint.lower < joint.upper
            },
            refs={joint.name: joint.ref for joint in robot.moving if joint.ref},
            base_frames=base_frames(robot),
            held=partial(held, robot),
            imported=lambda frame, most: imported_robots(file, robot, partial(held, frame=frame), most),
        )

    def _tables(
        self,
        file: RobotFile,
        robot: Robot,
        controller: Controller,
        values: Mapping[str, float],
        *,
        always: bool = False,
    ) -> dict[str, Any]:
        """Tables of the scene; ``always``: with a controller, even if its targets never change."""
        with error_location(str(self._path)):
            followers = {mimic.joint for mimic in robot.mimics} if values.get("couplings") else set()
            single = [joint.name for joint in robot.moving if joint.dofs == 1 and joint.name not in followers]
            driven = (row for row in scene_actuators(robot)[0] if row["kind"] == "position" or "limit" in row)
            of_file = {row["joint"]: row for row in driven}
            positions = {name for name, row in of_file.items() if row["kind"] == "position"}
            controller.require_joints(single, {joint.name: joint.kind for joint in robot.moving}, positions)
            actuators = _actuators(robot, controller, single, of_file, file.driven)
            names = [row["name"] for row in actuators]
            if controller.policy is not None and not actuators:
                advice = "it has nothing to drive: no joint has gains; give [[gains]] with kp and kd"
                raise InputError("policy.call", controller.policy.call, advice)
            control = self._control(controller, names, actuators, always)
        start = start_of(file, robot, controller, placed=bool(values.get("ground")))
        tables = tables_of(file, robot, start, values)
        return tables | {"actuators": actuators, **({} if control is None else {"control": control})}

    def _grounded(
        self, file: RobotFile, robot: Robot, controller: Controller, tables: dict[str, Any], ground: str
    ) -> dict[str, Any]:
        """Tables with those of a ground, above which the robot starts."""
        if ground == NO_GROUND:
            return tables
        asked = controller.ground or GroundContact()
        start = start_of(file, robot, controller, placed=True)
        servos = {
            row["joint"]: (row["kp"], row["kd"], [float(value_at(row["target"], time)) for time in _WATCHED])
            for row in tables["actuators"]
        }
        standing = StandingRobot(
            file=file,
            robot=robot,
            bodies=names_of_bodies(robot),
            start=start,
            servos=servos,
            drop=controller.start.drop,
        )
        with error_location(str(self._path)):
            touching = ground_tables(standing, ground, asked.feet, asked.friction)
        tables = tables | {"geometries": touching.geometries, "pairs": touching.pairs, "impacts": TOGETHER}
        way = _way_up(tables, robot, controller.start.drop)
        up = -robot.gravity / np.linalg.norm(robot.gravity)
        tables["joints"] = _lifted(tables["joints"], way * up)
        about = touching.about
        if abs(way) > _SEEN and controller.start.drop is None:
            below = "what it stands on" if about.startswith(NO_FLOOR) else "the floor"
            about += f"; moved up by {1e3 * way:.3g} mm, as its start overlaps {below}"
        others = [clause for clause in tables["omitted"] if clause != CONTACTS]
        return tables | {"about": about, "omitted": [*touching.left_out, *others]}

    def _robot(self, path: Path, controller: Controller, base: str) -> tuple[RobotFile, Robot]:
        """Robot whose joints have the controller's armatures; ``base``: ``fixed`` or ``free``, of a URDF's root."""
        file, robot = read_robot(path, base)
        if controller.start.base is not None and not any(joint.kind == JointKind.FREE for joint in robot.moving):
            advice = "this robot's root is fixed in its file; leave it out, or give the root a free joint"
            raise InputError(f"{self._path}: start.base", list(controller.start.base), advice)
        servos = {joint.name: controller.servo(joint.name) for joint in robot.moving if joint.dofs == 1}
        armature = {name: gains.armature for name, gains in servos.items() if gains and gains.armature is not None}
        joints = (
            dataclasses.replace(joint, armature=armature.get(joint.name, joint.armature)) for joint in robot.joints
        )
        return file, robot.change(joints=tuple(joints))

    def _control(
        self, controller: Controller, names: list[str], actuators: list[dict[str, Any]], always: bool
    ) -> Control | None:
        """Controller of the scene; None: its targets change continuously, or never (unless ``always``)."""
        if controller.rate is None or not names:
            return None
        moves = controller.policy is not None or any(not isinstance(row["target"], float) for row in actuators)
        if not (moves or always) and controller.held == TARGET and not controller.delay:
            return None
        call = controller.policy
        return Control(
            rate=controller.rate,
            actuators=tuple(names),
            policy=None if call is None else PolicySource(call.call, self._path.parent),
            scale=1.0 if call is None else call.scale,
            pose=tuple(controller.poses(names).tolist()),
            delay=controller.delay,
            held=controller.held,
        )


def _base(controller: Controller, ground: int) -> str:
    """Support of the root of a URDF: nothing where the controller puts it somewhere, or it stands on a ground."""
    return "free" if controller.start.base is not None or ground else "fixed"


def _way_up(tables: Mapping[str, Any], robot: Robot, drop: float | None) -> float:
    """Way against gravity to the start of the first body that floats [m], for the height of its lowest shape."""
    free = next((joint for joint in robot.moving if joint.kind == JointKind.FREE), None)
    size = float(np.linalg.norm(robot.gravity))
    if free is None or not size:
        return 0.0
    up = -robot.gravity / size
    planes = [row for row in tables["geometries"] if row["kind"] == "plane" and row["body"] == WORLD]
    slopes = {row["name"]: float(np.array(row.get("normal", Z)) @ up) for row in planes}
    floors = {name: slope for name, slope in slopes.items() if slope > _STEEP}
    if not floors:
        return 0.0
    raised = {key: value for key, value in tables.items() if key not in {"gravity", "omitted", "control"}}
    raised["joints"] = _lifted(tables["joints"], _ABOVE * up)
    x, y, z = robot.gravity.tolist()
    mechanism = made_mechanism(raised, (x, y, z), Parameters({}, {}))
    touching = touches(mechanism, Tree(mechanism).at(*mechanism.start()))
    ends = {pair.name: pair.geometries[1] for pair in mechanism.pairs}
    heights = []
    lifted = {next(row["child"] for row in tables["joints"] if row["kind"] == JointKind.FREE)}
    for joint in mechanism.joints:  # sorted: the parent comes first
        lifted |= {joint.child} if joint.parent in lifted else set()
    for contact, touch in zip(mechanism.contacts, touching, strict=True):
        slope = floors.get(ends[contact.pair])
        if slope is not None and contact.body_a in lifted:
            heights.append(touch.gap / slope - _ABOVE)
    return lift(min(heights), drop) if heights else 0.0


def _lifted(joints: list[dict[str, Any]], way: Array) -> list[dict[str, Any]]:
    """Tables of joints, the first one that floats moved along a way [m]."""
    number = next((number for number, joint in enumerate(joints) if joint["kind"] == JointKind.FREE), None)
    if number is None:
        return joints
    q = joints[number]["q0"]
    moved = joints[number] | {"q0": [*(np.array(q[:3]) + way).tolist(), *q[3:]]}
    return [*joints[:number], moved, *joints[number + 1 :]]


def start_of(file: RobotFile, robot: Robot, controller: Controller, *, placed: bool = False) -> RobotStates:
    """State of a robot at time 0: the controller's start, else a keyframe's, else its pose, else 0.

    ``placed``: what floats is where an MJCF puts it, unless start or keyframe say; else at its origin.
    """
    start = controller.start
    home = keyframe_states(robot, file.keyframe(start.keyframe)) if start.keyframe else None
    single = [joint for joint in robot.moving if joint.dofs == 1]
    if home is None:
        q, v = {**controller.pose, **start.q}, start.v
    else:
        q = {**{name: float(rows[0]) for name, rows in home.angle.items()}, **start.q}
        v = {**{joint.name: float(home.velocity[joint.name][0, 0]) for joint in single}, **start.v}
    angle = {joint.name: np.array([q.get(joint.name, 0.0)]) for joint in single}
    velocity = {joint.name: np.array([[v.get(joint.name, 0.0)]]) for joint in single}
    for mimic in robot.mimics:
        angle[mimic.joint] = mimic.multiplier * angle[mimic.other] + mimic.offset
        velocity[mimic.joint] = mimic.multiplier * velocity[mimic.other]
    rotation, position = dict[str, Any](), dict[str, Any]()
    for joint in robot.moving:
        if joint.dofs == 1:
            continue
        R, p = (joint.rotation if joint.kind == JointKind.FREE else np.eye(3)), joint.position
        rates = np.zeros(joint.dofs)
        if placed and joint.kind == JointKind.FREE and file.kind == "mjcf":
            pose = robot.sources[joint.child]
            R, p = np.array(pose["rotation"]), np.array(pose["position"])
        if home is not None:
            R, p = home.rotation[joint.name][0], home.position.get(joint.name, p[None])[0]
            rates = home.velocity[joint.name][0]
        if joint.kind == JointKind.FREE and not position and (home is None or start.base is not None):
            if start.base is not None:
                R = from_quaternion(start.base[3:])
                p = np.array(start.base[:3])
            spin = R @ np.array(start.base_velocity[3:])
            rates = np.concatenate([start.base_velocity[:3], spin])
        rotation[joint.name], velocity[joint.name] = R[None], rates[None]
        if joint.kind == JointKind.FREE:
            position[joint.name] = p[None]
    rest = {name: np.zeros_like(rates) for name, rates in velocity.items()}
    return RobotStates(angle=angle, rotation=rotation, position=position, velocity=velocity, acceleration=rest)


def _actuators(
    robot: Robot,
    controller: Controller,
    single: list[str],
    of_file: Mapping[str, Mapping[str, Any]],
    driven: Collection[str],
) -> list[dict[str, Any]]:
    """Tables of the servos, in the order of a policy's arrays: of the controller's gains, else of the file.

    Where transmissions of the file name its drives, ``driven``, a pattern with ``*`` or ``?`` means these joints.
    """
    drives = [joint for joint in single if not driven or joint in driven or controller.names(joint)]
    servos = {joint: gains for joint in drives if (gains := _servo(controller, of_file, joint)) is not None}
    joints = {joint.name: joint for joint in robot.moving}
    rows = []
    for name in controller.order or servos:
        gains, row = servos[name], of_file.get(name, {})
        limit = gains.limit or row.get("limit") or joints[name].effort
        target = controller.targets.get(name, controller.pose.get(name, 0.0))
        rows.append(
            {"name": name, "joint": name, "kind": "position", "target": target, "kp": gains.kp, "kd": gains.kd}
            | ({} if limit is None else {"limit": limit})
        )
    return rows


def _servo(controller: Controller, of_file: Mapping[str, Mapping[str, Any]], joint: str) -> Gains | None:
    """Gains at a joint: the controller's, else those of a position actuator in the file, through its gear."""
    gains, row = controller.servo(joint), of_file.get(joint, {})
    if gains is not None and gains.kp:
        return gains
    if row.get("kind") != "position":
        return None
    square = row["gear"] ** 2
    return Gains((joint,), kp=square * row["kp"], kd=square * row.get("kd", 0.0))


def _times(controller: Controller, duration: float) -> dict[str, float]:
    """Duration, step and, where the usual ones do not fit the instants, sampling interval [s]."""
    if controller.period is None:
        return {"duration": duration}
    least = _LADDER * math.ceil(controller.period / _STEP / _LADDER - 1e-9)
    for count in range(least, _FINER * least, _LADDER):
        coarsest = _LADDER * controller.period / count
        if abs(_GRID / coarsest - round(_GRID / coarsest)) < 1e-9:
            return {"duration": duration, "dt": coarsest / _LADDER}
    coarsest = _LADDER * controller.period / least
    every = coarsest * max(1, round(_GRID / coarsest))
    return {"duration": every * math.ceil(duration / every - 1e-9), "dt": coarsest / _LADDER, "every": every}


def imported_robots(
    file: RobotFile, robot: Robot, holder: Callable[[Robot], HeldRobot], most: int = MOST
) -> Iterator[HeldRobot]:
    """Robots by one cause, then by two, up to ``most``.

    Args:
        file: of the robot.
        robot: robot of the file.
        holder: robot as a program holds it.
        most: number of causes that act together.
    """
    begun: list[tuple[tuple[RobotHypothesis, ...], Robot]] = [((), robot)]
    for _ in range(most):
        changes, begun = _further(file, begun), []
        for causes, other_robot in changes:
            begun.append((causes, other_robot))
            with suppress(InputError, Refused):
                ids = tuple(item.id for item in causes)
                engines = (", ".join(" ".join(filter(None, names)) for names in item.known.items()) for item in causes)
                told = zip(causes, engines, strict=True)
                words = "; ".join(f"{item.grounds}, as by {names}: {item.remedy}" for item, names in told)
                yield replace(holder(other_robot), causes=ids, words=words)


def _further(
    file: RobotFile, begun: Sequence[tuple[tuple[RobotHypothesis, ...], Robot]]
) -> Iterator[tuple[tuple[RobotHypothesis, ...], Robot]]:
    """Robots with causes and one more, each pair of causes once; one after another, as a search may end before."""
    for causes, earlier in begun:
        for cause in hypotheses():
            if causes and cause.id <= causes[-1].id:
                continue
            if (other_robot := _changed(file, earlier, cause)) is not None:
                yield (*causes, cause), other_robot


def _changed(file: RobotFile, robot: Robot, cause: RobotHypothesis) -> Robot | None:
    """Robot with a cause that needs the file alone; None: it needs more, changes nothing, or changes the joints."""
    evidence = RobotEvidence(file=file, robot=robot, reading=_NOTHING)
    other_robot = next(iter(cause.test(evidence)), None)
    if not isinstance(other_robot, Robot) or other_robot is robot:
        return None
    return other_robot if _freedoms(other_robot) == _freedoms(robot) else None


def _freedoms(robot: Robot) -> list[tuple[str, str]]:
    """Joints that a record of a robot has columns of, with their kinds."""
    return [(joint.name, joint.kind) for joint in robot.moving]
