"""Records of a check of a robot file."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from proofroll.report.labels import engine_title
from proofroll.robots.check.explain import RobotCause
from proofroll.robots.files.robot_file import LintRemark
from proofroll.robots.protocol import Whole


@dataclass(frozen=True)
class HeldLayer:
    """Relative difference of an engine at a layer, its tolerance, and True if the difference is within it."""

    difference: float
    tolerance: float
    holds: bool


@dataclass(frozen=True, kw_only=True)
class ImporterRow:
    """Reading of a file by one engine's importer.

    Attributes:
        engine: engine with options, as the user wrote it.
        status: ``holds``, ``explained``, ``differs``, ``refused``, ``missing``, or how its process ended.
        message: reason that the engine has no model of the file; None if it has one.
        says: remark on every file that this engine reads.
        remarks: remarks of its reader on this file.
        layers: layer -> difference, for the layers that it offers.
        causes: causes of its differences.
        unexplained: first layer whose difference they do not explain.
        held: result for the compared copy, which has no looks, no contacts and only meshes with mass.
        as_written: result of its importer on the file as it is, where that is asked.
        fed: the engine has no importer and was fed from our reading, so its omissions say nothing about a file.
        accepted: all causes of its differences are among those that the user accepts.
        where: body or joint with the largest difference, at the first layer that fails.
        offending: joints whose carried body it holds differently, or lacks.
    """

    engine: str
    status: str
    version: str | None = None
    message: str | None = None
    says: str = ""
    remarks: Sequence[str] = ()
    layers: Mapping[str, HeldLayer] = field(default_factory=dict)
    causes: Sequence[RobotCause] = ()
    unexplained: str | None = None
    held: Whole | None = None
    as_written: str | None = None
    fed: bool = False
    accepted: bool = False
    where: str | None = None
    offending: Sequence[str] = ()

    @property
    def differs(self) -> bool:
        """True if the engine holds a different model, or none, for a reason that is not accepted."""
        excused = self.status == "explained" and (self.fed or self.accepted)
        return self.status not in {"holds", "missing"} and not excused

    @property
    def named(self) -> str:
        """The engine with its version."""
        return f"{engine_title(self.engine)} {self.version or ''}".strip()


@dataclass(frozen=True)
class UsedTruth:
    """Truth of a check: source of the file's meaning, and the largest relative ``difference`` of two formulations."""

    by: str
    difference: float
    states: int
    seed: int
    velocities: int


@dataclass(frozen=True)
class DrawnBody:
    """Position of a body and of its centre of mass with all coordinates at 0 [m], and its mass [kg]."""

    position: list[float]
    centre: list[float]
    mass: float


@dataclass(frozen=True)
class DrawnJoint:
    """Name, kind and bodies of a joint, its position with all coordinates at 0 [m], and the direction of its axis.

    ``axis`` is None where the joint has none: it is fixed, spherical or free.
    """

    name: str
    kind: str
    parent: str
    child: str
    position: list[float]
    axis: list[float] | None


@dataclass(frozen=True)
class DrawnRobot:
    """Data for a drawing of a robot."""

    name: str
    joints: list[DrawnJoint]
    bodies: dict[str, DrawnBody]


@dataclass(frozen=True)
class RobotCheck:
    """Result of a check: remarks on the file, its truth, and a row for each engine; ``layers``: name -> meaning."""

    file: str
    kind: str
    base: str
    lint: list[LintRemark]
    truth: UsedTruth
    layers: Mapping[str, str]
    engines: list[ImporterRow]
    robot: DrawnRobot


@dataclass(frozen=True)
class UnlikeValue:
    """Value of a joint in one file ``here`` and in another ``there``; null where a file gives none."""

    joint: str
    quantity: str
    here: float | str | None
    there: float | str | None


@dataclass(frozen=True)
class AgainstCheck(RobotCheck):
    """Comparison of two files; ``engines`` has the row of the second file.

    Attributes:
        against: the second file.
        against_by: clause on whose reading gives the second file its meaning.
        matched: joint of the first file -> its partner in the second.
        absent, added: moving joints that only the first file has, or only the second.
        values: values of joints that differ by more than the rounding of written digits.
        rounded: values of joints that differ by at most one unit of the last digit with which one is written.
        proposed: argument of ``--map`` that gives lonely joints partners of the same kind and place; empty: none does.
        proposed_partners: joint of the first file -> the partner that it would have.
    """

    against: str
    against_by: str
    matched: Mapping[str, str]
    absent: list[str]
    added: list[str]
    values: list[UnlikeValue]
    rounded: list[UnlikeValue]
    proposed: str
    proposed_partners: Mapping[str, str]
