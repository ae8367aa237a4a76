"""Default classes of MJCF: what an element has from the class that it belongs to."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

# The default class of what names none.
MAIN = "main"


def with_classes(root: Element, tag: str) -> Iterator[tuple[Element, dict[str, str]]]:
    """Every element of a tag below the worlds, with its attributes and those that its class gives it."""
    classes = _classes(root, tag)
    main = next((default.get("class", MAIN) for default in root.findall("default")), MAIN)
    for world in root.findall("worldbody"):
        yield from _below(world, tag, main, classes)


def class_of(root: Element, element: Element) -> dict[str, str]:
    """Attributes of an element that lies in no body, with those that its class gives it."""
    main = next((default.get("class", MAIN) for default in root.findall("default")), MAIN)
    return _classes(root, element.tag).get(element.get("class", main), {}) | element.attrib


def _below(
    parent: Element, tag: str, inherited: str, classes: dict[str, dict[str, str]]
) -> Iterator[tuple[Element, dict[str, str]]]:
    for child in parent:
        if child.tag == tag:
            yield child, classes.get(child.get("class", inherited), {}) | child.attrib
        elif child.tag in {"body", "frame"}:
            yield from _below(child, tag, child.get("childclass", inherited), classes)


def _classes(root: Element, tag: str) -> dict[str, dict[str, str]]:
    """Class -> the attributes that it gives to elements of a tag, those of the classes around it included."""
    classes: dict[str, dict[str, str]] = {}

    def collect(default: Element, outer: dict[str, str]) -> None:
        name = default.get("class", MAIN)
        classes[name] = classes.get(name, {}) | outer
        for given in default.findall(tag):
            classes[name] |= given.attrib
        for inner in default.findall("default"):
            collect(inner, classes[name])

    for default in root.findall("default"):
        collect(default, {})
    return classes
