"""Default classes of MJCF: what an element has from the class that it belongs to."""

from collections.abc import Iterator
from typing import NamedTuple
from xml.etree.ElementTree import Element

_MAIN = "main"


class Classed(NamedTuple):
    """Element below the worlds.

    Attributes:
        element: the element itself, which stands in ``parent``.
        body: the body, or the world, to which it belongs.
        given: its attributes, and those that its class gives it.
    """

    element: Element
    parent: Element
    body: Element
    given: dict[str, str]


def classed(root: Element, tag: str) -> Iterator[Classed]:
    """Every element of a tag below the worlds, in the order of the file."""
    classes = _classes(root, tag)

    def below(parent: Element, body: Element, inherited: str) -> Iterator[Classed]:
        inherited = parent.get("childclass", inherited)
        for child in parent:
            if child.tag == tag:
                yield Classed(child, parent, body, classes.get(child.get("class", inherited), {}) | child.attrib)
            else:
                yield from below(child, child if child.tag == "body" else body, inherited)

    for world in root.findall("worldbody"):
        yield from below(world, world, _main(root))


def with_classes(root: Element, tag: str) -> Iterator[tuple[Element, dict[str, str]]]:
    """Every element of a tag below the worlds, with its attributes and those that its class gives it."""
    return ((item.element, item.given) for item in classed(root, tag))


def class_of(root: Element, element: Element) -> dict[str, str]:
    """Attributes of an element that lies in no body, with those that its class gives it."""
    return _classes(root, element.tag).get(element.get("class", _main(root)), {}) | element.attrib


def _main(root: Element) -> str:
    """Name of the class of what names none."""
    return next((default.get("class", _MAIN) for default in root.findall("default")), _MAIN)


def _classes(root: Element, tag: str) -> dict[str, dict[str, str]]:
    """Class -> the attributes that it gives to elements of a tag, those of the classes around it included."""
    classes: dict[str, dict[str, str]] = {}

    def collect(default: Element, outer: dict[str, str]) -> None:
        name = default.get("class", _MAIN)
        classes[name] = classes.get(name, {}) | outer
        for given in default.findall(tag):
            classes[name] |= given.attrib
        for inner in default.findall("default"):
            collect(inner, classes[name])

    for default in root.findall("default"):
        collect(default, {})
    return classes
