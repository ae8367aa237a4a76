"""Copy of an MJCF for every engine: includes inserted, everything named, without looks, contacts and missing meshes."""

import contextlib
import copy
import itertools
import math
from collections import Counter
from collections.abc import Container, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element

from proofroll.core.errors import InputError
from proofroll.core.number_format import counted
from proofroll.robots.files.robot_file import (
    MOST_ELEMENTS,
    Expand,
    Keyframe,
    LintRemark,
    file_inside,
    names_files_inside,
    numbers,
    read_xml,
    required_file,
)

_MAIN = "main"  # default class of elements that name none
# Largest depth of includes.
_DEEPEST = 8
_MOST_MODELS = 32
# Elements that change neither masses nor torques without contacts.
_LOOKS = {"visual", "statistic", "size", "texture", "material", "skin", "hfield", "sensor", "contact", "custom"}
# Elements that change masses or motion in a way that the check does not cover.
_UNCOVERED = {"deformable", "flexcomp", "flex", "plugin"}
# Attributes that say where an actuator acts.
_PLACES = {"name", "joint", "jointinparent", "tendon", "site", "refsite", "slidersite", "cranksite", "body"}
# Of a remark on a shape that collides in the file, and that no copy has.
NO_SHAPE = "it collides in the file, and no copy has it"
# Macros, which the engine that defines the format writes out.
_MACROS = {"replicate", "attach", "composite"}


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

    main = next((default.get("class", _MAIN) for default in root.findall("default")), _MAIN)
    for world in root.findall("worldbody"):
        yield from below(world, world, main)


def with_classes(root: Element, tag: str) -> Iterator[tuple[Element, dict[str, str]]]:
    """All elements of a tag below <worldbody>, with their attributes, own and inherited from the class."""
    return ((item.element, item.given) for item in classed(root, tag))


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


def neutral_mjcf(
    root: Element, path: Path, inside: Path, expand: Expand | None = None, *, contacts: bool = False
) -> tuple[Element, list[LintRemark], bool, tuple[Keyframe, ...]]:
    """Copy of an MJCF, remarks on omissions, True if all its files lie in ``inside``, and its keyframes.

    The only files that the copy names are meshes that exist in that folder. ``contacts``: it keeps the pairs of shapes
    that the file names, and a remark :data:`NO_SHAPE` says which shapes that collide it lacks.

    Raises:
        InputError: the MJCF includes a file outside the folder, or has an element that the check does not cover.
    """
    parts: dict[str, Element] = {}
    remarks, contained = _add(root, path, path.resolve(), inside, parts, contacts=contacts)
    root = next(iter(parts.values()))
    keyframes = tuple(_keyframe(key) for part in root.findall("keyframe") for key in part.findall("key"))
    for part in parts.values():
        part[:] = [child for child in part if child.tag != "keyframe"]
    macros = [name for name in sorted(_MACROS) if any(part.find(f".//{name}") is not None for part in parts.values())]
    if macros:
        names = ", ".join(f"<{name}>" for name in macros)
        if expand is None:
            raise InputError("file", path, f"the check does not cover {names}")
        if sum(map(_written_out, parts.values())) > MOST_ELEMENTS:
            raise InputError("file", path, f"{names}: written out these are more than {MOST_ELEMENTS} elements")
        root = expand(parts)
        remarks.append(LintRemark("note", names, "written out by the engine that defines the format, to six digits"))
    name_all(root)
    return root, remarks, contained, keyframes


def _keyframe(key: Element) -> Keyframe:
    """Keyframe of an element."""
    qpos, qvel, ctrl = (
        tuple(numbers(key, name, "", len(key.get(name, "").split()))) for name in ("qpos", "qvel", "ctrl")
    )
    return Keyframe(key.get("name", ""), qpos, qvel, ctrl)


def _written_out(element: Element) -> float:
    """Approximate number of elements after macros are written out."""
    inside = 1 + sum(map(_written_out, element))
    if element.tag not in _MACROS:
        return inside
    with contextlib.suppress(ValueError):
        return inside * math.prod(max(1.0, float(part)) for part in element.get("count", "1").split())
    return inside  # a wrong count: the engine's own message says so


def _add(
    root: Element, path: Path, file: Path, inside: Path, parts: dict[str, Element], *, contacts: bool
) -> tuple[list[LintRemark], bool]:
    """Adds the stripped copy of a file, and of the files that it attaches, to ``parts`` under unique names.

    Returns:
        Remarks on omissions, and True if all files that are named lie in the folder ``inside``.
    """
    root = copy.deepcopy(root)
    root.tag = "mujoco"
    if root.find(".//include") is not None:
        count = len(root.findall("worldbody"))
        _include(root, path, file.parent, inside, (file,))
        _merge_defaults(root)
        if len(root.findall("worldbody")) > count:
            worlds = root.findall("worldbody")  # those of included files too; their meaning stays the same
            worlds[-1][:] = [child for world in worlds for child in world]
            for world in worlds[:-1]:  # Pinocchio reads a tree twice, and refuses a class defined after its use
                root.remove(world)
    contained = names_files_inside(root, file.parent, inside)
    for extension in [*root.iter("extension")]:
        extension[:] = []
    for plugin in (plugin for part in root.iter("actuator") for plugin in part.findall("plugin")):
        plugin.tag, plugin[:] = "general", []  # an actuator with a law of a program's own stays one
        plugin.attrib = {key: plugin.attrib[key] for key in plugin.attrib.keys() & _PLACES} | {"dyntype": "user"}
    for element in root.iter():
        if element.tag in _UNCOVERED:
            raise InputError("file", path, f"the check does not cover <{element.tag}>")
    shapes = list(classed(root, "geom"))
    looks = _LOOKS - {"contact"} if contacts else _LOOKS
    for parent in list(root.iter()):
        for child in list(parent):
            if child.tag in looks:
                parent.remove(child)
        parent.attrib.pop("material", None)
    remove_height_fields(root, shapes)
    solid = _solid(root, shapes) if contacts else set[Element]()
    remarks = list(remove_meshes(root, shapes, file.parent, inside, solid))
    remarks += _lost_shapes(root, shapes, solid) if contacts else []
    parts[f"{len(parts)}.xml"] = root
    for model in root.iter("model"):
        target = required_file(file.parent, model, inside)
        if len(parts) >= _MOST_MODELS:
            raise InputError("<model file>", model.get("file"), f"more than {_MOST_MODELS} models are attached")
        model.attrib.setdefault("name", target.stem)
        model.set("file", f"{len(parts)}.xml")
        noticed, within = _add(read_xml(target), path, target, inside, parts, contacts=contacts)
        remarks, contained = [*remarks, *noticed], contained and within
    return remarks, contained


def _include(element: Element, path: Path, folder: Path, inside: Path, open_files: tuple[Path, ...]) -> None:
    """Replaces each <include> below an element by the content of its file. Raises InputError if that is too much."""
    for index, child in reversed(list(enumerate(element))):
        if child.tag != "include":
            _include(child, path, folder, inside, open_files)
            continue
        target = required_file(folder, child, inside)
        if target in open_files or len(open_files) > _DEEPEST:
            raise InputError("<include file>", child.get("file", ""), "files include each other, or too deeply")
        included = read_xml(target)
        _include(included, path, folder, inside, (*open_files, target))
        element.remove(child)
        for offset, part in enumerate(included):
            element.insert(index + offset, part)
        if sum(1 for _ in element.iter()) > MOST_ELEMENTS:
            raise InputError(
                "<include file>", child.get("file", ""), f"more than {MOST_ELEMENTS} elements are included"
            )


def _merge_defaults(root: Element) -> None:
    """Merges the <default> elements of included files with that of the file, where that keeps their meaning.

    Pinocchio refuses several in one file. A class inherits only what the class above it has so far, so plain defaults
    must not follow an inner class.
    """
    whole, *others = root.findall("default") or [Element("default")]
    for included in others:
        inherits, plain = whole.find("default") is not None, [child for child in included if child.tag != "default"]
        if included.get("class", "main") != whole.get("class", "main") or (inherits and plain):
            whole = included
            continue
        for child in plain:
            present = whole.find(child.tag)
            if present is None or len(present) or len(child):
                whole.append(child)
            else:
                present.attrib |= child.attrib
        whole.extend(included.findall("default"))
        root.remove(included)


def _solid(root: Element, shapes: Sequence[Classed]) -> set[Element]:
    """Geoms that collide, with any other or in a pair of their own."""
    paired: set[str | None] = {
        pair.get(end) for contact in root.findall("contact") for pair in contact for end in ("geom1", "geom2")
    }
    return {
        shape.element
        for shape in shapes
        if any(shape.given.get(key, "1") != "0" for key in ("contype", "conaffinity"))
        or shape.element.get("name") in paired - {None}
    }


def _lost_shapes(root: Element, shapes: Sequence[Classed], solid: set[Element]) -> Iterator[LintRemark]:
    """Yields a remark for each solid shape that is no longer in the copy; removes the pairs that name it."""
    kept = set(root.iter("geom"))
    lost = [shape for shape in shapes if shape.element not in kept]
    names = {shape.element.get("name") for shape in lost} - {None}
    for contact in root.findall("contact"):
        for pair in [pair for pair in contact.findall("pair") if names & {pair.get("geom1"), pair.get("geom2")}]:
            contact.remove(pair)
    for shape in lost:
        if shape.element in solid:
            kind = "mesh" if shape.given.get("mesh") else "height field"
            yield LintRemark("note", f"{kind} of {shape.body.get('name', 'the world')}", NO_SHAPE)


def name_all(root: Element) -> None:
    """Gives names to bodies and joints without one, so that engines can be compared by name."""
    root.attrib.setdefault("model", "robot")
    taken = {element.get("name") for element in root.iter()}
    for world in root.iter("worldbody"):
        for tag, word in (("body", "body"), ("joint", "joint"), ("freejoint", "joint")):
            for number, element in enumerate(world.iter(tag)):
                if not element.get("name"):
                    free = (f"{word}{filler}{number}" for filler in itertools.accumulate(itertools.repeat(" ")))
                    element.set("name", next(name for name in free if name not in taken))
                    taken.add(element.get("name"))


def remove_height_fields(root: Element, shapes: Sequence[Classed]) -> None:
    """Removes height fields, which have no mass."""
    for shape in shapes:
        if shape.given.get("hfield"):
            shape.parent.remove(shape.element)
    _forget(root, "hfield", set())


def remove_meshes(
    root: Element, shapes: Sequence[Classed], folder: Path, inside: Path, solid: Container[Element] = ()
) -> Iterator[LintRemark]:
    """Removes meshes that neither give mass nor are solid, or do not exist; names the others by their absolute paths.

    Args:
        root: content of the file.
        shapes: its geoms.
        solid: geoms that collide and stay, if their mesh exists.
        folder: folder of the file, to which paths are relative.
        inside: folder in which all files must lie.

    Yields:
        A remark for each body that loses a mesh with mass.

    Raises:
        InputError: a mesh that gives mass lies outside the folder ``inside``.
    """
    inferred = any(compiler.get("inertiafromgeom") == "true" for compiler in root.iter("compiler"))
    meshes, strip = _mesh_folder(root, folder)
    inline = {name for mesh in root.iter("mesh") if mesh.get("vertex") and (name := _mesh_name(mesh))}
    named = {_mesh_name(mesh): mesh for mesh in root.iter("mesh") if mesh.get("file")}
    if strip:
        for mesh in named.values():
            mesh.set("file", Path(mesh.get("file", "")).name)
    files = {name: file_inside(meshes, mesh.get("file", ""), inside) for name, mesh in named.items()}
    used: set[str] = set()
    lost: Counter[Element] = Counter()
    for shape in shapes:
        mesh_name, body = shape.given.get("mesh"), shape.body
        if mesh_name is None:
            continue
        weighed = body.tag == "body" and (inferred or body.find("inertial") is None)
        if weighed and mesh_name in named:
            required_file(meshes, named[mesh_name], inside)
        target = files.get(mesh_name)
        there = mesh_name in inline or (target is not None and target.is_file())
        if there and (weighed or shape.element in solid):
            used.add(mesh_name)
        else:
            shape.parent.remove(shape.element)
            lost[body] += weighed
    for body, number in (+lost).items():
        words = f"{counted(number, 'mesh shapes')} that would give it mass: no such file; all engines read it without"
        yield LintRemark("warning", f"body {body.get('name', '')}", words)
    _forget(root, "mesh", used)
    for asset in root.iter("asset"):
        for mesh in asset.findall("mesh"):
            if _mesh_name(mesh) not in used:
                asset.remove(mesh)
            elif mesh.get("file"):
                mesh.set("file", str(files[_mesh_name(mesh)]))


def _mesh_folder(root: Element, folder: Path) -> tuple[Path, bool]:
    """Folder of meshes, and True if only the last part of their paths counts (strippath); removes these attributes."""
    attributes: dict[str, str] = {}
    for compiler in root.iter("compiler"):
        for key in ("texturedir", "assetdir", "meshdir", "strippath"):
            attributes[key] = compiler.attrib.pop(key, attributes.get(key, ""))
    return folder / (attributes.get("meshdir") or attributes.get("assetdir", "")), attributes.get("strippath") == "true"


def _forget(root: Element, attribute: str, kept: set[str]) -> None:
    """Removes an attribute of geoms from default classes, except if its value is one of ``kept``."""
    for default in root.iter("default"):
        for geom in default.findall("geom"):
            if geom.get(attribute) not in kept:
                geom.attrib.pop(attribute, None)


def _mesh_name(mesh: Element) -> str:
    return mesh.get("name") or Path(mesh.get("file", "")).stem
