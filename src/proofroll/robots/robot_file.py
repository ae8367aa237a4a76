"""A robot file as every engine gets it: read once and safely, without what loads other files."""

import dataclasses
import math
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, ParseError, TreeBuilder, XMLParser

from proofroll.core.errors import InputError

# Of the XML of strangers; a robot file is a few hundred kB, the largest known is 2 MB.
LARGEST, DEEPEST, MOST_ELEMENTS = 32 * 2**20, 400, 200_000


@dataclasses.dataclass(frozen=True)
class LintRemark:
    """Finding in a file.

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
        remarks: omissions and changes on the way.
        contained: whether all files that it names, looks included, lie in the folder that files are read from.
    """

    path: Path
    kind: str
    root: Element
    base: str = "fixed"
    remarks: tuple[LintRemark, ...] = ()
    contained: bool = True


# Content of a file and of those that it attaches, by their names -> what an engine makes of macros in it.
Expand = Callable[[Mapping[str, Element]], Element]


RUN_XACRO = "run xacro first: xacro FILE > robot.urdf"


class _Builder(TreeBuilder):
    """Builds elements, and stops at what no robot file needs."""

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
    """The root element of a file: no document types, no entities, nothing loaded, limits on size and depth.

    Raises:
        InputError: it cannot be read, is too large or too deep, declares a document type or is no XML.
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


# A comment may hold no "--", nothing may stand before <?xml and no null characters at the end: few files keep to that,
# and MuJoCo asks for none of it.
_COMMENTS = re.compile(rb"<!--.*?-->", re.DOTALL)


def _parsed(text: bytes) -> Element:
    parser = XMLParser(target=_Builder())
    parser.feed(text)
    root: Element = parser.close()
    return root


def file_inside(folder: Path, name: str, inside: Path) -> Path | None:
    """A file by its name in a folder if it lies in ``inside`` or below, links followed."""
    try:
        target = (folder / name).resolve()
    except (OSError, RuntimeError, ValueError):  # a loop of links; a name with a null character
        return None
    return target if target.is_relative_to(inside) and target != inside else None


# Attributes that name a file, the folders of an MJCF's files, and how others than paths are recognised.
_FILES = ("file", "filename", *(f"file{side}" for side in ("right", "left", "up", "down", "front", "back")))
_FOLDERS = ("assetdir", "meshdir", "texturedir")
_ADDRESS = "://"


def names_files_inside(root: Element, folder: Path, inside: Path) -> bool:
    """True if all files that are named lie in the folder ``inside`` or below, wherever they are looked for."""
    folders = {folder, *(folder / element.get(key, "") for element in root.iter("compiler") for key in _FOLDERS)}
    names = {name for element in root.iter() for key in _FILES if (name := element.get(key)) and _ADDRESS not in name}
    return all(file_inside(place, name, inside) is not None for place in folders for name in names)


def required_file(folder: Path, element: Element, inside: Path) -> Path:
    """The file that an element names. Raises InputError if it lies outside the folder ``inside``."""
    target = file_inside(folder, element.get("file", ""), inside)
    if target is None:
        said = (
            "it is outside its folder, the only one that files are read from; `proofroll check` takes another by --root"
        )
        raise InputError(f"<{element.tag} file>", element.get("file", ""), said)
    return target


def numbers(element: Element, attribute: str, default: str | None, count: int) -> list[float]:
    """The numbers in an attribute.

    Raises:
        InputError: it is absent without a default, has another number of them, or one is not finite.
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
    """The numbers in a text, however many."""
    return [float(part) for part in text.split()]
