"""Writes docs/robots.md: robots of packages on their floors, from real runs: ``python docs/robots.py [FOLDER …]``.

A robot of docs/robots.toml whose controllers, engines or pinned libraries have changed is run anew if its package is
installed, or unpacked below one of the folders; else it stays as it is. No file of a robot is part of the project.
"""

from __future__ import annotations

import hashlib
import json
import math
import re
import sys
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from fnmatch import fnmatchcase
from importlib.metadata import PackageNotFoundError, files
from pathlib import Path

from gallery import failures
from made_from import pinned

from proofroll.core.errors import ProofrollError
from proofroll.files.scene_file import load_scene
from proofroll.files.scene_sources import with_control
from proofroll.report.comparison.distances import distance_cells
from proofroll.report.comparison.summary import outcome_content
from proofroll.robots.files.robot_file import RobotFile
from proofroll.robots.files.scene_tables import keyframe_states, read_robot
from proofroll.robots.model import Robot
from proofroll.running.idle_workers import Workers
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll.studies.comparison.compare import compare
from proofroll.studies.comparison.default_comparison import default_comparison, own_engine

DOCS = Path(__file__).resolve().parent
PAGE = DOCS / "robots.md"
UNTIL = 1.0  # s
RATE = 50  # Hz
# Roll and pitch of the start [rad], so that feet land one after the other.
TILT = (0.03, 0.025)
# Swing of hips and of knees about the pose [rad].
SWINGS = (0.15, 0.25)
MOTIONS = ("hold", "trot")
GEOMS = "mujoco[formulation=geoms,preset={}]"
ENGINES = (
    GEOMS.format("default,dt=2e-3"),
    GEOMS.format("matched,dt=1e-3"),
    GEOMS.format("tuned,dt=1e-3"),
    "exudyn[formulation=spheres,preset=matched]",
)
HEAD = """# Robots on their floors

Robots whose files a package index has, on the floors of their files, under two controllers at {rate} Hz: *hold* holds
the start's pose, and *trot* of four-legged ones swings hips and knees about it, open loop. All start 1 cm above the
floor with a tilt of 2 degrees, so that feet land one after the other. No policy is among them yet. Written by
`python docs/robots.py` from real runs; do not edit it.
The same for [a robot of your own](control_a_robot.md#the-table-of-your-own-robot) takes two commands.

A cell is the largest distance up to that time of any body from the
[reference by steps](control_a_robot.md#on-the-ground), in **mm**, and by how much any attitude is off, in **rad**.
The first line of a table is the reference's own error bar: smaller distances are not told apart.
s/s: seconds of computing for each second of motion, of one run on a busy machine, so to a factor of two.

- as installed (`default`): what a MuJoCo model has that says nothing (Euler, 2 ms, soft contacts, pyramidal cone).
- `matched`: hard contacts and elliptic cones at 1 ms.
- `tuned`: the same without the lift that MuJoCo's convex cone gives to feet that slide, with damping as armature.
- Of an MJCF the first setting has the options of its own file; what the adapter sets otherwise, as the softness of its
  geoms, `compare` names.
- Exudyn's contacts are of spheres, with a friction that rises up to a slip of `friction_zone`. With the 1e-3 m/s of
  `matched` its Newton method ends soon after the landing, at shorter steps too (tried with solo12); with 1e-2 m/s
  solo12 is held (tried for 0.5 s).
"""
MADE = "<!-- {} made from {} -->"


@dataclass(frozen=True)
class RobotEntry:
    """A robot of docs/robots.toml; see there."""

    name: str
    package: str
    file: str
    swing: list[str]
    keyframe: str = ""
    gains: dict[str, float] = field(default_factory=dict)
    pose: dict[str, float] = field(default_factory=dict)
    feet: dict[str, float] = field(default_factory=dict)
    set: dict[str, float] = field(default_factory=dict)


def entries() -> list[RobotEntry]:
    """The robots, in the order of the page."""
    return [RobotEntry(**row) for row in tomllib.loads((DOCS / "robots.toml").read_text(encoding="utf-8"))["robots"]]


def stamp(entry: RobotEntry) -> str:
    """Hash of what decides a robot's section: its entry, the controllers' numbers, engines and pinned libraries."""
    content = [asdict(entry), UNTIL, RATE, TILT, SWINGS, MOTIONS, ENGINES, pinned()]
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:16]


def sections(page: str) -> dict[str, str]:
    """Robot -> its section of the page, with the line of its stamp."""
    parts = re.split(r"^(?=## )", page, flags=re.MULTILINE)[1:]
    return {part.partition("\n")[0].removeprefix("## "): part for part in parts}


def stale(page: str) -> list[RobotEntry]:
    """Robots without a section, or whose section was made from something else."""
    kept = sections(page)
    return [entry for entry in entries() if MADE.format(entry.name, stamp(entry)) not in kept.get(entry.name, "")]


def located(entry: RobotEntry, folders: Sequence[Path]) -> Path | None:
    """File of a robot in its installed package or below a folder; None: it is not at hand."""
    try:
        inside = [Path(str(item.locate())) for item in files(entry.package) or []]
    except PackageNotFoundError:
        inside = []
    inside += [path for folder in folders for path in folder.rglob(Path(entry.file).name)]
    return next((path for path in inside if path.as_posix().endswith(f"/{entry.file}")), None)


def pose_of(entry: RobotEntry, file: RobotFile, robot: Robot) -> dict[str, float]:
    """Target of each joint with one coordinate [rad]: of the keyframe, or of the last pattern that fits, or 0."""
    single = [joint.name for joint in robot.moving if joint.dofs == 1]
    if entry.keyframe:
        states = keyframe_states(robot, file.keyframe(entry.keyframe))
        return {name: float(states.angle[name][0]) for name in single}
    pose = dict.fromkeys(single, 0.0)
    for pattern, value in entry.pose.items():
        pose |= {name: value for name in single if fnmatchcase(name, pattern)}
    return pose


def controller(entry: RobotEntry, motion: str, pose: dict[str, float]) -> str:
    """TOML of the controller of a motion."""
    lines = [f"rate = {RATE}", "[pose]", *(f'"{name}" = {value!r}' for name, value in pose.items())]
    if entry.gains:
        lines += ["[[gains]]", 'joints = "*"', *(f"{key} = {value}" for key, value in entry.gains.items())]
    if motion == "trot":
        lines.append("[targets]")
        for pattern, size in zip(entry.swing, SWINGS, strict=True):
            for name, phase in phases([name for name in pose if fnmatchcase(name, pattern)]).items():
                lines.append(f'"{name}" = "= {pose[name]!r} + {size}*sin(4*pi*t + {phase!r})*(1 - exp(-8*t))"')
    lines.append("[ground]")
    if entry.feet:
        lines.append(f"feet = {{{', '.join(f'{link} = {radius}' for link, radius in entry.feet.items())}}}")
    roll, pitch = (angle / 2 for angle in TILT)
    turn = [math.cos(roll) * math.cos(pitch), math.sin(roll) * math.cos(pitch)]
    turn += [math.cos(roll) * math.sin(pitch), -math.sin(roll) * math.sin(pitch)]
    return "\n".join([*lines, "[start]", f"base = [0, 0, 0, {', '.join(map(repr, turn))}]", 'drop = "1 cm"', ""])


def phases(joints: Sequence[str]) -> dict[str, float]:
    """Phase of each leg's joint [rad]: of four legs the diagonal ones are alike, two are opposite."""
    alike = (0, 3) if len(joints) > 2 else (0,)
    return {name: 0.0 if number in alike else math.pi for number, name in enumerate(joints)}


def section(entry: RobotEntry, path: Path, runner: Runner) -> str:
    """Section of a robot: a table for each motion, or why there is none."""
    parts = [f"## {entry.name}\n\n`{Path(entry.file).name}` of the package {entry.package}.\n"]
    folder = DOCS.parent / "out" / "robots" / entry.name
    folder.mkdir(parents=True, exist_ok=True)
    for motion in MOTIONS if entry.swing else MOTIONS[:1]:
        try:
            parts += motion_parts(entry, motion, path, folder, runner)
        except ProofrollError as error:
            parts.append(f"**{motion}** is not run: {error}.\n".replace(f"{folder}/", ""))
    return "\n".join(parts).replace(f"{path.parent}/", "") + f"\n{MADE.format(entry.name, stamp(entry))}\n"


def motion_parts(entry: RobotEntry, motion: str, path: Path, folder: Path, runner: Runner) -> Iterator[str]:
    """What stands on what, the horizon, the table of distances, and why rows have no result."""
    control = folder / f"{motion}.toml"
    control.write_text(controller(entry, motion, pose_of(entry, *read_robot(path, "free"))), encoding="utf-8")
    name = with_control(str(path), control)
    scene = load_scene(name, **entry.set)
    engines = [own_engine(path, scene, runner.workers)[1]] if path.suffix == ".xml" else []
    comparison = default_comparison(name, entry.set, runner.workers, None, [*engines, *ENGINES], UNTIL)
    rows = [replace(row, ladder=[1.0]) for row in comparison.rows]
    outcome = compare(replace(comparison, rows=rows, timed=False), runner)
    content = outcome_content(outcome)
    point = next(iter(outcome.points.values()))
    clauses = [scene.title.partition("; ")[2], f"left out: {', '.join(scene.omitted)}" if scene.omitted else ""]
    yield f"**{motion}**: {'; '.join(filter(None, clauses))}.\n"
    if not content.distances:
        yield f"No reference: {point.result.message}.\n"
    if point.result.cut:
        yield f"The limit of processor time ended its reference before the finest step: {point.result.message}.\n"
    for item in content.distances:
        if item.horizon:
            yield f"Horizon: {item.horizon}.\n"
        yield f"| up to | {' | '.join(f'{time:.3g} s' for time in item.times)} | s/s |"
        yield "|---" * (len(item.times) + 2) + "|"
        yield "\n".join(f"| {' | '.join(cells)} |" for cells in distance_cells(item, content.rows, content.runs)) + "\n"
    yield failures(content)


def main(folders: list[str]) -> None:
    """Makes the sections that are lacking or out of date, as far as files are at hand, and writes the page."""
    page = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
    kept, runner = sections(page), Runner(Store(DOCS.parent / "out" / "cases"), jobs=1, workers=Workers())
    for entry in stale(page):
        path = located(entry, list(map(Path, folders)))
        if path is None:
            sys.stderr.write(f"{entry.name}: {entry.package} is not at hand\n")
            continue
        kept[entry.name] = section(entry, path, runner)
        write(kept)
        sys.stderr.write(f"{entry.name}\n")
    write(kept)


def write(kept: dict[str, str]) -> None:
    """Writes the page of these sections, by robot."""
    text = [kept[entry.name].rstrip("\n") + "\n" for entry in entries() if entry.name in kept]
    lacking = ", ".join(entry.name for entry in entries() if entry.name not in kept)
    head = HEAD.format(rate=RATE) + (f"- Not run yet: {lacking}.\n" if lacking else "")
    PAGE.write_text("\n".join([head, *text]), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
