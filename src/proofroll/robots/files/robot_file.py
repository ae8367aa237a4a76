"""Safe reading of a robot file: XML with limits and without entities; paths confined to a folder."""

import dataclasses
import math
import re
import stat
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, ParseError, TreeBuilder, XMLParser

from proofroll.core.errors import InputError, require_known

# Limits of bytes, depth and elements for untrusted XML; a robot file has a few hundred kB, the largest known 2 MB.
LARGEST, DEEPEST, MOST_ELEMENTS = 32 * 2**20, 400, 200_000


@dataclasses.dataclass(frozen=True)
class LintRemark:
    """Remark on a robot file.

    Attributes:
        level: ``error`` (breaks the format or physics), ``warning`` (engines treat it differently) or ``note``.
        where: ``link NAME``, ``joint NAME`` or the name of an element.
        what: the remark, a sentence.
    """

    level: str
    where: str
    what: str


@dataclasses.dataclass(frozen=True)
class Keyframe:
    """A state that an MJCF has by name; a vector that it leaves out is empty.

    Attributes:
        name: in the file; empty: it has none.
        qpos: coordinates in MuJoCo's order [m, rad and quaternions], counted as in the file.
        qvel: velocities in MuJoCo's order [m/s, rad/s].
        ctrl: controls of the actuators, in their order.
    """

    name: str
    qpos: tuple[float, ...]
    qvel: tuple[float, ...]
    ctrl: tuple[float, ...]


@dataclasses.dataclass(frozen=True)
class RobotFile:
    """A robot file, prepared for engines.

    Attributes:
        path: path as the user gave it.
        kind: ``urdf`` or ``mjcf``.
        root: content that engines get; of an MJCF with all includes inserted.
        base: support of the root of a URDF, ``fixed`` or ``free``; an MJCF has its own.
        remarks: remarks on omissions and changes.
        contained: True if all files that it names, textures included, lie in the folder that files are read from.
        driven: joints to which transmissions of a URDF lead, with their reductions (turns of the motor per turn of the
            joint); empty: it has none, and says nothing of drives.
        rotors: joint -> inertia of the rotors in its transmissions, reflected to the joint [kg m² or kg].
        keyframes: of an MJCF, in its order.
    """

    path: Path
    kind: str
    root: Element
    base: str = "fixed"
    remarks: tuple[LintRemark, ...] = ()
    contained: bool = True
    driven: Mapping[str, float] = dataclasses.field(default_factory=dict, hash=False)
    rotors: Mapping[str, float] = dataclasses.field(default_factory=dict, hash=False)
    keyframes: tuple[Keyframe, ...] = ()

    def keyframe(self, name: str) -> Keyframe:
        """Keyframe of this name, or with this number from 1 on. Raises InputError if there is none."""
        numbered = {str(place): item for place, item in enumerate(self.keyframes, 1)}
        named = numbered | {item.name: item for item in self.keyframes if item.name}
        require_known("start", name, named, f"{self.path.name} has no such keyframe; choose from")
        return named[name]


# Function: name -> content of a file (first) and of the files that it attaches -> content with macros written out.
Expand = Callable[[Mapping[str, Element]], Element]


RUN_XACRO = "run xacro first: xacro FILE > robot.urdf"


class _Builder(TreeBuilder):
    """Builds elements; raises _TooMuch beyond the limits of depth and number, and at a document type."""

    depth = elements = 0

    def start(self, tag: Any, attrs: Any) -> Element:
        self.depth += 1
        self.elements += 1
        if self.depth > DEEPEST:
            raise _TooMuch(f"elements are nested deeper than {DEEPEST}")
        if self.elements > MOST_ELEMENTS:
            raise _TooMuch(f"there are more than {MOST_ELEMENTS} elements")
        return super().start(tag, attrs)

    def end(self, tag: Any) -> Element:
        self.depth -= 1
        return super().end(tag)

    def doctype(self, *_: Any) -> None:
        raise _TooMuch("a document type (and entities that it may declare) is not read; remove <!DOCTYPE …>")


class _TooMuch(Exception):  # noqa: N818 -- turned into an InputError with the name of the file
    pass


def read_xml(path: Path) -> Element:
    """Root element of an XML file, read without document types, entities and other files.

    Raises:
        InputError: the file cannot be read, is too large or too deep, declares a document type or is no XML.
    """
    try:
        if not path.is_file():
            raise InputError("file", path, "there is no such file")
        if path.stat().st_size > LARGEST:
            raise InputError("file", path, f"the file is larger than {LARGEST // 2**20} MB")
        text = path.read_bytes()
    except OSError as error:
        raise InputError("file", path, f"the file cannot be read: {error.strerror}") from None
    try:
        try:
            return _parsed(text)
        except ParseError:
            return _parsed(_COMMENTS.sub(b"", text.rstrip(b"\0 \t\r\n")).lstrip())  # parsers of engines are no stricter
    except _TooMuch as error:
        raise InputError("file", path, str(error)) from None
    except (ParseError, ValueError, LookupError) as error:  # LookupError: an encoding that does not exist
        if b"<xacro:" in text:  # whose prefix is declared nowhere
            raise InputError("file", path, f"it has <xacro:…>: {RUN_XACRO}") from None
        raise InputError("file", path, f"this is no XML: {error}") from None


# XML allows no "--" in a comment, nothing before <?xml and no null characters at the end. Some files break these rules,
# and MuJoCo reads them.
_COMMENTS = re.compile(rb"<!--.*?-->", re.DOTALL)


def _parsed(text: bytes) -> Element:
    parser = XMLParser(target=_Builder())
    parser.feed(text)
    root: Element = parser.close()
    return root


def file_inside(folder: Path, name: str, inside: Path) -> Path | None:
    """Path of a file named relative to a folder, links followed; None: it lies outside the folder ``inside``."""
    try:
        target = (folder / name).resolve()
    except (OSError, RuntimeError, ValueError):  # a loop of links; a name with a null character
        return None
    looped = target.is_symlink()  # from Python 3.13 on, resolve() returns a loop of links as it is
    return target if target.is_relative_to(inside) and target != inside and not looped else None


# Attributes that name a file; attributes that name folders of an MJCF's files; part of a name that is no path.
_FILES = ("file", "filename", *(f"file{side}" for side in ("right", "left", "up", "down", "front", "back")))
_FOLDERS = ("assetdir", "meshdir", "texturedir")
_ADDRESS = "://"


def names_files_inside(root: Element, folder: Path, inside: Path) -> bool:
    """True if all files that are named lie in the folder ``inside`` or below, in every folder they may refer to.

    Raises:
        InputError: one of them is a pipe or a device, which would block or never end.
    """
    folders = {folder, *(folder / element.get(key, "") for element in root.iter("compiler") for key in _FOLDERS)}
    named = ((name, element.tag, key) for element in root.iter() for key in _FILES if (name := element.get(key)))
    names = {name: f"<{tag} {key}>" for name, tag, key in named if _ADDRESS not in name}
    files = {name: [file_inside(place, name, inside) for place in folders] for name in names}
    for name, places in files.items():
        if any(file is not None and _is_endless(file) for file in places):
            raise InputError(names[name], name, "it is a pipe or a device; name an ordinary file")
    return all(file is not None for places in files.values() for file in places)


def _is_endless(file: Path) -> bool:
    """True if a path is that of a pipe, a socket or a device."""
    try:
        mode = file.stat().st_mode
    except OSError:  # there is none, or its name is too long
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def required_file(folder: Path, element: Element, inside: Path) -> Path:
    """Path of the file that an element names. Raises InputError if it lies outside the folder ``inside``."""
    target = file_inside(folder, element.get("file", ""), inside)
    if target is None:
        message = "it is outside its folder, the only one that files are read from; name one that holds all by --root"
        raise InputError(f"<{element.tag} file>", element.get("file", ""), message)
    return target


def numbers(element: Element, attribute: str, default: str | None, count: int) -> list[float]:
    """Numbers in an attribute, exactly ``count``.

    Raises:
        InputError: the attribute is missing without a default, has more or fewer numbers, or one is not finite.
    """
    text = element.get(attribute, default)
    field = f"<{element.tag} {attribute}>"
    if text is None:
        raise InputError(field, None, "the attribute is missing")
    try:
        values = [float(part) for part in text.split()]
    except ValueError:
        raise InputError(field, text, "write numbers, with spaces between them") from None
    if len(values) != count:
        raise InputError(field, text, f"write {count} number{'s' if count > 1 else ''}, not {len(values)}")
    if not all(map(math.isfinite, values)):
        raise InputError(field, text, "numbers must be finite")
    return values


def floats(text: str) -> list[float]:
    """All numbers in a text, separated by spaces."""
    return [float(part) for part in text.split()]
