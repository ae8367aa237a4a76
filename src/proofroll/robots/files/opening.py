"""Safe reading of a robot file, without parts that engines must not load."""

import os
from pathlib import Path
from xml.etree.ElementTree import Element

from proofroll.core.errors import InputError, error_location, require_known
from proofroll.files.scene_sources import ROOT
from proofroll.robots.files import urdf
from proofroll.robots.files.mjcf.parse import neutral_mjcf
from proofroll.robots.files.robot_file import RUN_XACRO, Expand, Keyframe, RobotFile, names_files_inside, read_xml

# More bodies than any robot has; each costs a row and a column of dense matrices.
MOST_BODIES = 2000
BASES = ("fixed", "free")
_XACRO = "xacro"


def open_robot(
    path: Path, base: str = "fixed", root: Path | None = None, expand: Expand | None = None, *, contacts: bool = False
) -> RobotFile:
    """Reads a file, without parts that engines must not or need not load.

    Args:
        path: path of a URDF or MJCF.
        base: support of the root of a URDF, ``fixed`` or ``free``.
        root: folder that holds the file and all files named in it; by default :data:`ROOT`, or the file's own.
        expand: writes out macros of an MJCF (repetition, attached models); None: a file with macros is refused.
        contacts: True to keep the pairs of shapes that an MJCF names.

    Raises:
        InputError: the file is broken, of another kind, too large, or asks for files outside the folder.
    """
    require_known("base", base, BASES)
    with error_location(str(path)):
        # Path.resolve() fails at a loop of links
        whole = root or os.environ.get(ROOT) or path.parent
        inside, file = (Path(os.path.realpath(item)) for item in (whole, path))
        if not file.is_relative_to(inside):
            advice = f"{path.name} is in {file.parent}, not in this folder; name one that holds it with --root"
            raise InputError("--root", inside, advice)
        return _opened(path, base, inside, expand, contacts=contacts)


def _opened(path: Path, base: str, inside: Path, expand: Expand | None, *, contacts: bool) -> RobotFile:
    root, driven, rotors = read_xml(path), dict[str, float](), dict[str, float]()
    keyframes: tuple[Keyframe, ...] = ()
    if root.tag == "robot":
        _require_plain(root, path)
        if base == "free":
            urdf.rename_world(root)
        contained = names_files_inside(root, path.resolve().parent, inside)
        driven, rotors = urdf.transmissions(root)
        kind, (root, remarks), body = "urdf", urdf.neutral_urdf(root), "link"
    elif root.tag in {"mujoco", "mujocoinclude"}:
        root, remarks, contained, keyframes = neutral_mjcf(root, path, inside, expand, contacts=contacts)
        kind, body = "mjcf", "body"
    elif root.tag == "sdf":
        raise InputError("file", path, "it is an SDF, which is not read; give the robot as a URDF or an MJCF")
    else:
        raise InputError("file", path, f"<{root.tag[:40]}> is neither a URDF (<robot>) nor an MJCF (<mujoco>)")
    count = sum(1 for _ in root.iter(body))
    if count > MOST_BODIES:
        raise InputError("file", path, f"it has {count} {body}s; at most {MOST_BODIES} are checked")
    return RobotFile(
        path=path, kind=kind, root=root, base=base, remarks=tuple(remarks), contained=contained, driven=driven,
        rotors=rotors, keyframes=keyframes,
    )  # fmt: skip


def _require_plain(root: Element, path: Path) -> None:
    """Raises InputError if a URDF is a xacro template that was not expanded."""
    tag = next((str(element.tag) for element in root.iter() if _XACRO in str(element.tag)), None)
    if tag is not None:
        raise InputError("file", path, f"it has <xacro:{tag.rpartition('}')[2]}>: {RUN_XACRO}")
    for element in root.iter():
        for key, value in element.attrib.items():
            if "${" in value or "$(" in value:
                raise InputError("file", path, f"<{element.tag} {key}> is {value!r}: {RUN_XACRO}")
