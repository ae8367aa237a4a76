"""MJCF as every engine gets it: includes put in place, everything named, without looks, contacts and missing meshes."""

from __future__ import annotations

import copy
import itertools
from collections.abc import Iterator
from pathlib import Path
from xml.etree.ElementTree import Element

from proofroll.core.errors import InputError
from proofroll.robots.robot_file import MOST_ELEMENTS, LintFinding, read_xml

# How deep files may include files.
_DEEPEST = 8
# Neither mass nor torque without contacts depends on these.
_LOOKS = {
    "visual",
    "statistic",
    "size",
    "texture",
    "material",
    "skin",
    "hfield",
    "sensor",
    "keyframe",
    "contact",
    "custom",
}
_UNCOVERED = {"extension", "deformable", "flexcomp", "composite", "replicate", "attach", "plugin"}


def stripped(root: Element, path: Path) -> tuple[Element, list[LintFinding]]:
    """A copy that names no file but meshes that exist beside it, and what was left out.

    Raises:
        InputError: it includes a file outside its folder, or holds what the check does not cover.
    """
    root = copy.deepcopy(root)
    root.tag = "mujoco"
    _include(root, path, path.resolve().parent, (path.resolve(),))
    for element in root.iter():
        if element.tag in _UNCOVERED:
            raise InputError("file", path, f"the check does not cover <{element.tag}>")
    for parent in list(root.iter()):
        for child in list(parent):
            if child.tag in _LOOKS or child.get("hfield"):
                parent.remove(child)
        parent.attrib.pop("material", None)
    findings = [*_meshes(root, path.resolve().parent), *_gravity_compensations(root)]
    _name(root)
    return root, findings


def _include(element: Element, path: Path, folder: Path, open_files: tuple[Path, ...]) -> None:
    """Puts the content of included files in place of what includes them."""
    for index, child in reversed(list(enumerate(element))):
        if child.tag != "include":
            _include(child, path, folder, open_files)
            continue
        target = _inside(folder, child.get("file", ""))
        if target is None:
            said = "the file includes another outside its folder, which is not read"
            raise InputError("<include file>", child.get("file", ""), said)
        if target in open_files or len(open_files) > _DEEPEST:
            raise InputError("<include file>", child.get("file", ""), "files include each other, or too deeply")
        included = read_xml(target)
        _include(included, path, folder, (*open_files, target))
        element.remove(child)
        for offset, part in enumerate(included):
            element.insert(index + offset, part)
        if sum(1 for _ in element.iter()) > MOST_ELEMENTS:
            raise InputError(
                "<include file>", child.get("file", ""), f"more than {MOST_ELEMENTS} elements are included"
            )


def _inside(folder: Path, name: str) -> Path | None:
    """A file by its name if it lies in the folder or below, links followed."""
    try:
        target = (folder / name).resolve()
    except (OSError, ValueError):  # a loop of links; a name with a null character
        return None
    return target if target.is_relative_to(folder) and target != folder else None


def _meshes(root: Element, folder: Path) -> Iterator[LintFinding]:
    """Leaves out meshes that weigh nothing or cannot be read; others are named by their whole path."""
    compilers = list(root.iter("compiler"))
    inferred = any(compiler.get("inertiafromgeom") == "true" for compiler in compilers)
    places = [compiler.attrib.pop(key, None) for key in ("texturedir", "assetdir", "meshdir") for compiler in compilers]
    place = next((place for place in reversed(places) if place), "")
    files = {
        _mesh_name(mesh): _inside(folder, f"{place}/{mesh.get('file')}")
        for mesh in root.iter("mesh")
        if mesh.get("file")
    }
    present = {name for name, target in files.items() if target is not None and target.is_file()}
    used = {name for name in (_mesh_name(mesh) for mesh in root.iter("mesh") if mesh.get("vertex")) if name}
    for body in root.iter("body"):
        weighed = inferred or body.find("inertial") is None
        lost = 0
        for geom in [geom for geom in body.findall("geom") if geom.get("mesh")]:
            name = str(geom.get("mesh"))
            if weighed and name in present | used:
                used.add(name)
            else:
                body.remove(geom)
                lost += weighed
        if lost:
            words = f"{lost} meshes that would give it mass are not in the file's folder; all engines read it without"
            yield LintFinding("warning", f"body {body.get('name', '')}", words)
    for world in root.iter("worldbody"):
        for geom in [geom for geom in world.findall("geom") if geom.get("mesh")]:
            world.remove(geom)
    for asset in root.iter("asset"):
        for mesh in asset.findall("mesh"):
            if _mesh_name(mesh) not in used:
                asset.remove(mesh)
            elif mesh.get("file"):
                mesh.set("file", str(files[_mesh_name(mesh)]))


def _gravity_compensations(root: Element) -> Iterator[LintFinding]:
    """Leaves out what carries bodies against gravity, as actuators are."""
    for body in root.iter("body"):
        if body.attrib.pop("gravcomp", "0") not in {"0", "0.0"}:
            words = "its gravity compensation is left out, as actuators are; all engines read it without"
            yield LintFinding("note", f"body {body.get('name', '')}", words)


def _mesh_name(mesh: Element) -> str:
    return mesh.get("name") or Path(mesh.get("file", "")).stem


def _name(root: Element) -> None:
    """Names for bodies and joints without one, so that engines can be compared by name."""
    root.attrib.setdefault("model", "robot")
    taken = {element.get("name") for element in root.iter()}
    for world in root.iter("worldbody"):
        for tag, word in (("body", "body"), ("joint", "joint"), ("freejoint", "joint")):
            for number, element in enumerate(world.iter(tag)):
                if not element.get("name"):
                    free = (f"{word}{filler}{number}" for filler in itertools.accumulate(itertools.repeat(" ")))
                    element.set("name", next(name for name in free if name not in taken))
                    taken.add(element.get("name"))
