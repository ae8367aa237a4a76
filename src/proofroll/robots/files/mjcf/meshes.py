"""Removal of meshes and height fields of an MJCF that give no mass, or do not collide where contacts are kept."""

from collections import Counter
from collections.abc import Container, Iterator, Sequence
from pathlib import Path
from xml.etree.ElementTree import Element

from proofroll.core.number_format import counted
from proofroll.robots.files.mjcf.defaults import Classed
from proofroll.robots.files.robot_file import LintRemark, file_inside, required_file


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
