"""Default classes of MJCF: attributes that an element inherits from its class."""

from collections.abc import Iterator
from typing import NamedTuple
from xml.etree.ElementTree import Element

_MAIN = "main"


class Classed(NamedTuple):
    """Element below <worldbody> with the attributes of its default class.

    Attributes:
        element: the element.
        parent: the element around it.
        body: the body, or the world, to which it belongs.
        given: its attributes, own and inherited from its class.
    """

    element: Element
    parent: Element
    body: Element
    given: dict[str, str]


def classed(root: Element, tag: str) -> Iterator[Classed]:
    """All elements of a tag below <worldbody>, in the order of the file."""
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
    """All elements of a tag below <worldbody>, with their attributes, own and inherited from the class."""
    return ((item.element, item.given) for item in classed(root, tag))


def _main(root: Element) -> str:
    """Name of the class of elements that name none."""
    return next((default.get("class", _MAIN) for default in root.findall("default")), _MAIN)


def _classes(root: Element, tag: str) -> dict[str, dict[str, str]]:
    """Class -> attributes that it gives to elements of a tag, own and inherited from the classes around it."""
    classes: dict[str, dict[str, str]] = {}

    def collect(default: Element, outer: dict[str, str]) -> None:
        name = default.get("class", _MAIN)
        classes[name] = classes.get(name, {}) | outer
        for element in default.findall(tag):
            classes[name] |= element.attrib
        for inner in default.findall("default"):
            collect(inner, classes[name])

    for default in root.findall("default"):
        collect(default, {})
    return classes
