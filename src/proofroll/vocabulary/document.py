"""Every key of scenes and files of studies, from the dataclasses that read them, and the page about them."""

from __future__ import annotations

import dataclasses
import inspect
import math
import re
from collections.abc import Iterator
from typing import Any, NamedTuple, get_args

from proofroll.core import comparison
from proofroll.core.entry_points import loaded
from proofroll.core.gravity import Gravity
from proofroll.elements.balls.surfaces import surface_kinds
from proofroll.elements.mechanism import Body, Force, Joint, Loop, Point, Spring
from proofroll.elements.mechanism.scene import balls
from proofroll.elements.mechanism.scene.bushing import Bushing
from proofroll.elements.mechanism.scene.composed import Cable, Gimbal, Screw, SprungJoint
from proofroll.elements.mechanism.scene.drives import Actuator, ActuatorKind, Coupling
from proofroll.elements.mechanism.scene.joint_kinds import LOOP_FACTS, JointKind
from proofroll.elements.mechanism.scene.parts import Axes, ForceKind
from proofroll.elements.mechanism.scene.shapes import geometry as contacts
from proofroll.files.data_folders import data_folder
from proofroll.files.scene_file import SceneFile
from proofroll.files.scene_parameters import Parameter
from proofroll.studies.stability import axes
from proofroll.studies.stability import claims as stability_claims


class KeyTable(NamedTuple):
    """A table of a file: its header as TOML writes it, what reads it, fields that are no keys."""

    header: str
    read_by: type[Any]
    no_keys: tuple[str, ...] = ()


_OF_FILE = ("name",)
CHAPTERS: dict[str, tuple[KeyTable, ...]] = {
    "A scene: `models/<scene>/scene.toml`": (
        KeyTable("", SceneFile, ("parameters", "gravity", "tables")),
        KeyTable("[parameters.NAME]", Parameter),
        KeyTable("[gravity]", Gravity),
    ),
    "A scene with balls on surfaces": (
        KeyTable("[[balls]]", balls.Ball),
        *(KeyTable("[[surfaces]]", kind) for kind in surface_kinds()),
        KeyTable("[[contacts]]", balls.Contact),
        KeyTable("[[initial]]", balls.InitialMotion),
    ),
    "A scene with a mechanism": (
        KeyTable("[[bodies]]", Body),
        KeyTable("[[joints]]", Joint),
        KeyTable("[[joints]]", Screw),
        KeyTable("[[joints]]", Gimbal),
        KeyTable("[[joints]]", SprungJoint),
        KeyTable("[[loops]]", Loop),
        KeyTable("[[loops]]", Cable),
        KeyTable("[[springs]]", Spring),
        KeyTable("[[bushings]]", Bushing),
        KeyTable("[[forces]]", Force),
        KeyTable("[[points]]", Point),
        KeyTable("[[geometries]]", contacts.Geometry),
        KeyTable("[[pairs]]", contacts.Pair),
        KeyTable("[[actuators]]", Actuator),
        KeyTable("[[couplings]]", Coupling),
    ),
    "A comparison: `comparisons/*.toml` without `study`": (
        KeyTable("", comparison.Comparison, ("name", "vary", "brief", "bands", "rows", "left_out", "budget", "spent")),
        KeyTable("[[rows]]", comparison.Row, ("except_at",)),
        KeyTable("[[rows.except_at]]", comparison.ExceptAt),
    ),
    'A stability map: `study = "stability"`': (
        KeyTable("", stability_claims.StabilityFile, (*_OF_FILE, "axes", "claims")),
        KeyTable("[[axes]]", axes.Axis, ("parameters",)),
        KeyTable("[axes.parameters.NAME]", axes.AxisTerm),
        KeyTable("[[claims]]", stability_claims.Claim),
    ),
    **{
        chapter: tuple(KeyTable(*table) for table in tables)
        for _, chapters in loaded("proofroll.vocabulary_chapters", of=dict)
        for chapter, tables in chapters.items()
    },
}
# What is read by no dataclass of its own.
REST = {
    "A scene with a mechanism": """### `[[repeat]]`

Tables that differ by a number, written once: `index` (a name, by default `i`), `from` (by default 0), `count`, and the
tables themselves, `[[repeat.bodies]]`, `[[repeat.joints]]` …; their texts may hold `{i}` or `{i-1}`, their
formulas `i`.

### `[[published]]`

What somebody else found of the same mechanism; it moves nothing. `source` (required); `time`, an instant, or `times`,
a list [s]; a number, or a list of as many, for each observable, as `"q.slide"`; `parameters` with which they hold, the
others at their defaults; `within`, the largest error that the numbers are known to have: without it a unit of the last
digit of each. `python -m proofroll_drill published` holds them against the truth.

### `unmodelled`

At the top of the file: a list of texts, what the mechanism has besides and nothing here models. The truth and every
engine refuse the scene and say so.

### `impacts`

At the top of the file: what an impact at several contacts at once does. `"any order"` (the default): one contact after
another, in any order, with the corners of a flat face as one; the truth goes on where all orders end alike, and ends
where they do not. `"together"`: Moreau's law for all contacts at once: what gets an impulse parts at its restitution
times its approach, and nothing parts more slowly than that.

### `control`

A table of a controller: `rate` (instants per second, required), `actuators` (list of names, required), `call` (a policy
`module:make`; without it the actuators' own targets are read at the instants and held), `scale` of an action, `pose` (a
coordinate for each actuator), `delay` (whole instants), `held` (`"target"` or `"effort"`).
[Control a robot](control_a_robot.md) says what a policy is.
""",
    "A comparison: `comparisons/*.toml` without `study`": """### `[vary]`, `[brief]`

Parameter = list of values. `[vary]`: every combination is run. `[brief]`: a report without names has only these values.

### `[tolerances.NAME]`

`because` (required), and observable = a number with its unit, `"1e-3 m"`, or `"1 %"` of its size in the truth.
""",
}
INTRODUCTION = """# The vocabulary of scenes and comparisons

Written from what reads the files; `proofroll check --keys WORD` prints a part of it. `proofroll check NAME` says
whether a file is sound, and an unknown key is an error. SI units, angles in rad. In a scene
`"$name"` is the value of a parameter, and `"= mass*length^2/12"` is a formula of parameters with `+ - * / ^ ( )`,
`pi`, `sin`, `cos`, `tan`, `asin`, `acos`, `atan`, `atan2`, `sqrt`, `hypot` and `abs`; `"30 deg"` and `"2 mm"` are
converted. They must have the unit of their place; a bare number takes the unit of what it is added to, and has none
in a product.
"""


def meanings(read_by: type[Any]) -> dict[str, str]:
    """Meaning of each field: its line under ``Attributes:`` in the docstring of the class."""
    texts: dict[str, str] = {}
    section = (inspect.getdoc(read_by) or "").partition("Attributes:\n")[2].split("\n\n")[0]
    for names, text in re.findall(r"^    ([\w, ]+): (.*(?:\n        .*)*)", section, flags=re.MULTILINE):
        texts |= dict.fromkeys(re.split(r", ", names), " ".join(text.split()))
    return texts


def keys(table: KeyTable) -> Iterator[tuple[str, str, str, str]]:
    """Key, type, default and meaning of each line of a table."""
    said = meanings(table.read_by)
    for item in dataclasses.fields(table.read_by):
        if item.name not in table.no_keys:
            unit = _unit(item.metadata.get("unit"))
            text = (
                re.sub(r":\w+:`~?(?:[\w.]+\.)?(\w+)`", r"`\1`", said[item.name]).replace("``", "`").replace("|", r"\|")
            )
            text += f" [{unit}]" if unit and f"[{unit}" not in text and "[" not in text else ""
            yield item.name, _type(item.type), _default(item), text


def _unit(unit: Any) -> str:
    """The unit of a key, with the kinds that have it where it hangs on the kind."""
    if isinstance(unit, dict):
        kinds: dict[str, list[str]] = {}
        for kind, inner in unit.items():
            kinds.setdefault(_unit(inner), []).append(kind)
        return "; ".join(f"{inner}: {', '.join(names)}" for inner, names in kinds.items())
    return unit if isinstance(unit, str) else ", ".join(unit or ())


def _type(annotation: Any) -> str:
    text = annotation if isinstance(annotation, str) else getattr(annotation, "__name__", str(annotation))
    words = {
        "Vector": "[x, y, z]",
        "Vector | None": "[x, y, z]",
        "Inertia": "3×3 or [Ixx, Iyy, Izz]",
        "Numbers": "number or list",
        "JointKind": " or ".join(JointKind),
        "LoopKind": " or ".join(LOOP_FACTS),
        "Tolerance": '"1e-3 m" or "1 %"',
        "float | Formula | Table": "number, formula of t, or table",
        "GeometryKind": " or ".join(get_args(contacts.GeometryKind)),
        "ForceKind": " or ".join(get_args(ForceKind)),
        "Axes": " or ".join(get_args(Axes)),
        "ActuatorKind": " or ".join(get_args(ActuatorKind)),
    }
    text = re.sub(r"JointKind\.(\w+)", lambda match: match[1].lower(), text)
    text = re.sub(r"Literal\[([^]]*)\]", lambda match: match[1].replace(", ", " or "), text)
    text = re.sub(r"\b(?:tuple|list)\[", "[", re.sub(r"\bstr\b", "text", text)).replace("FloatOrInf", "float")
    return words.get(text, text.replace(" | None", "").replace("Tolerance", '"1e-3 m"').replace("|", "or"))


def _default(item: dataclasses.Field[Any]) -> str:
    value = item.default
    if value is dataclasses.MISSING:
        value = dataclasses.MISSING if item.default_factory is dataclasses.MISSING else item.default_factory()
    if value is dataclasses.MISSING:
        return "required"
    if value is None or value in ("", [], {}, ()):
        return "none"
    if isinstance(value, float) and math.isinf(value):
        return "inf"
    if isinstance(value, (list, tuple)):
        return str([str(part) if isinstance(part, str) else part for part in value]).replace("'", '"')
    return {True: "true", False: "false"}[value] if isinstance(value, bool) else f"{value}"


def example(header: str, chapter: str, kind: str) -> str:
    """The first such table of our own files, up to its empty line."""
    folder, pattern = ("models", "*/scene.toml") if chapter.startswith("A scene") else ("comparisons", "*.toml")
    start = re.escape(header.partition(",")[0]).replace("NAME", r"[\w./\"]+")
    for path in sorted(data_folder(folder).glob(pattern)):
        only = rf'kind = "{kind}"\n' if kind else ""
        if match := re.search(rf"^{start}\n{only}(?:.+\n?)+", path.read_text(encoding="utf-8"), flags=re.MULTILINE):
            return f"From `{folder}/{path.relative_to(data_folder(folder))}`:\n\n```toml\n{match[0].rstrip()}\n```\n"
    return ""


def kind_of(table: KeyTable) -> str:
    """Value of the key ``kind`` that a table belongs to; empty: to any."""
    kind = getattr(table.read_by, "kind", None)
    return kind if isinstance(kind, str) else ""


def document() -> str:
    """The whole text."""
    parts = [INTRODUCTION]
    for chapter, tables in CHAPTERS.items():
        parts.append(f"## {chapter}\n")
        for table in tables:
            kind = kind_of(table)
            named = f' with `kind = "{kind}"`' if kind else ""
            parts.append(f"### {f'`{table.header}`{named}' if table.header else 'The file itself'}\n")
            lines = ["| key | type | default | meaning |", "|---|---|---|---|"]
            lines += [f"| `{key}` | {typed} | {default} | {text} |" for key, typed, default, text in keys(table)]
            parts.append("\n".join(lines) + "\n")
            if table.header and (shown := example(table.header, chapter, kind)):
                parts.append(shown)
        if chapter in REST:
            parts.append(REST[chapter])
    return "\n".join(parts)
