"""A robot file as every engine gets it: read once and safely, without what loads other files."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, ParseError, TreeBuilder, XMLParser

from proofroll.core.errors import InputError, require_known, told_of

# Of the XML of strangers; a robot file is a few hundred kB, the largest known is 2 MB.
LARGEST, DEEPEST, MOST_ELEMENTS = 32 * 2**20, 400, 200_000
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
    require_known("base", base, BASES)
    with told_of(str(path)):
        return _opened(path, base)


def _opened(path: Path, base: str) -> RobotFile:
    from proofroll.robots import mjcf, urdf

    root = read_xml(path)
    if root.tag == "robot":
        kind, (root, findings), body = "urdf", urdf.stripped(root), "link"
    elif root.tag in {"mujoco", "mujocoinclude"}:
        kind, (root, findings), body = "mjcf", mjcf.stripped(root, path), "body"
    else:
        raise InputError("file", path, f"<{root.tag[:40]}> is neither a URDF (<robot>) nor an MJCF (<mujoco>)")
    count = sum(1 for _ in root.iter(body))
    if count > MOST_BODIES:
        raise InputError("file", path, f"it has {count} {body}s; at most {MOST_BODIES} are checked")
    return RobotFile(path, kind, root, base, tuple(findings))


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
    parser = XMLParser(target=_Builder())
    try:
        parser.feed(text)
        root: Element = parser.close()
    except _TooMuch as error:
        raise InputError("file", path, str(error)) from None
    except (ParseError, ValueError, LookupError) as error:  # LookupError: an encoding that does not exist
        raise InputError("file", path, f"this is no XML: {error}") from None
    return root


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
        found = [float(part) for part in text.split()]
    except ValueError:
        raise InputError(field, text, "write numbers") from None
    if len(found) != count:
        raise InputError(field, text, f"write {count} number{'s' if count > 1 else ''}")
    if not all(map(math.isfinite, found)):
        raise InputError(field, text, "numbers must be finite")
    return found
