"""A robot file as every engine gets it: read once and safely, without what loads other files."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from xml.etree.ElementTree import Element

from proofroll.core.errors import InputError
from proofroll.robots.safe_xml import read_xml

# More bodies than any robot has; each costs a row and a column of dense matrices.
MOST_BODIES = 2000
BASES = ("fixed", "free")


@dataclasses.dataclass(frozen=True)
class LintFinding:
    """What is noticed in a file.

    Attributes:
        level: ``error`` (breaks the format or physics), ``warning`` (engines treat it differently) or ``note``.
        where: ``link NAME``, ``joint NAME`` or the name of an element.
        what: a sentence.
    """

    level: str
    where: str
    what: str


@dataclasses.dataclass(frozen=True)
class RobotFile:
    """A file and what was made of it.

    Attributes:
        path: as the user gave it.
        kind: ``urdf`` or ``mjcf``.
        root: the content that engines get; of MJCF with all includes.
        base: ``fixed`` or ``free``: what carries the root of a URDF; of MJCF the file says so itself.
        findings: what was left out or changed on the way.
    """

    path: Path
    kind: str
    root: Element
    base: str = "fixed"
    findings: tuple[LintFinding, ...] = ()


def open_robot(path: Path, base: str = "fixed") -> RobotFile:
    """Reads a file, and leaves out what engines must not or need not load.

    Raises:
        InputError: the file is broken, of another kind, too large, or asks for files outside its folder.
    """
    from proofroll.robots import mjcf, urdf

    if base not in BASES:
        raise InputError("base", base, f"choose one of {', '.join(BASES)}")
    root = read_xml(path)
    if root.tag == "robot":
        kind, (root, findings), body = "urdf", urdf.stripped(root), "link"
    elif root.tag in {"mujoco", "mujocoinclude"}:
        kind, (root, findings), body = "mjcf", mjcf.stripped(root, path), "body"
    else:
        raise InputError("file", str(path), f"<{root.tag[:40]}> is neither a URDF (<robot>) nor an MJCF (<mujoco>)")
    count = sum(1 for _ in root.iter(body))
    if count > MOST_BODIES:
        raise InputError("file", str(path), f"it has {count} {body}s; at most {MOST_BODIES} are checked")
    return RobotFile(path, kind, root, base, tuple(findings))
