"""Reads a mechanism from the tables of a scene file.

``[[repeat]]`` stands for several tables that differ by a number: ``index = "i"``, ``from = 0``, ``count = "$n"``, and
the tables themselves, ``[[repeat.bodies]]``, ``[[repeat.joints]]`` …; their texts may hold ``{i}`` or ``{i-1}`` and
their expressions ``i``. A joint with ``dependent = true`` has its q0 and v0 found from the loops; its own q0 is a
guess.
"""

from collections.abc import Iterator, Mapping
from dataclasses import fields
from typing import Any

from proofroll.core.errors import InputError, no_such_key, require_known
from proofroll.core.parameters import Parameters
from proofroll.core.validation import strict, units_of_kind, validated
from proofroll.elements.mechanism.contact.start import check_contacts
from proofroll.elements.mechanism.dynamics.held_signals import check_commands
from proofroll.elements.mechanism.reading.assembly import assemble, check_start
from proofroll.elements.mechanism.scene import checks
from proofroll.elements.mechanism.scene.bushing import Bushing
from proofroll.elements.mechanism.scene.composed import COMPOSED, Cable, Gimbal, Screw, SprungJoint, reader_of
from proofroll.elements.mechanism.scene.control import made_control
from proofroll.elements.mechanism.scene.drives import Actuator, Coupling
from proofroll.elements.mechanism.scene.joint import Joint
from proofroll.elements.mechanism.scene.joint_kinds import FACTS, JointKind
from proofroll.elements.mechanism.scene.model import IN_ANY_ORDER, Mechanism
from proofroll.elements.mechanism.scene.parts import Body, Force, Loop, Point, Spring
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.elements.mechanism.scene.signal import Table, read_signal
from proofroll.elements.mechanism.scene.spring_law import read_spring_law

KINDS: dict[str, type[Any]] = {
    "bodies": Body, "joints": Joint, "loops": Loop, "springs": Spring, "bushings": Bushing, "forces": Force,
    "points": Point, "geometries": Geometry, "pairs": Pair, "actuators": Actuator, "couplings": Coupling,
}  # fmt: skip
strict(*KINDS.values(), *COMPOSED.values(), SprungJoint, Cable, Table)
_MOST = 10_000  # largest number of repetitions: more are taken for a typing error


def made_mechanism(content: Mapping[str, Any], gravity: checks.Vector, numbers: Parameters) -> Mechanism:
    """Mechanism of a scene file, its loops closed, able to move.

    Args:
        content: the tables of :data:`KINDS`, ``repeat`` and ``control``, the list of texts ``unmodelled``, ``impacts``.
        gravity: acceleration in the world's axes [m/s²].
        numbers: the parameters.

    Raises:
        InputError: something in it is wrong; one line says where, what and what to do.
    """
    made: dict[str, list[Any]] = {kind: [] for kind in KINDS}
    cables: list[Cable] = []
    for kind, item in _all_made(content, numbers):
        cables += [item] if isinstance(item, Cable) else []
        tables = item.parts() if isinstance(item, Screw | Gimbal | SprungJoint | Cable) else {kind: [item]}
        for table, items in tables.items():
            made[table] += items
    if not made["bodies"]:
        raise InputError("bodies", None, "a mechanism needs a body; add a [[bodies]] table")
    parts: dict[str, Any] = {kind: tuple(items) for kind, items in made.items()}
    law, control = content.get("impacts", IN_ANY_ORDER), made_control(content.get("control"), numbers)
    mechanism = Mechanism(
        gravity=gravity, unmodelled=_texts(content, "unmodelled"), impacts=law, control=control, **parts
    )
    try:
        return started(mechanism)
    except InputError as error:
        short = next((item for item in cables if error.field == f"pairs.{item.name}"), None)
        if short is None:
            raise
        advice = "its ends are farther apart at the start, or are pulled apart there; lengthen it or move one"
        raise InputError(f"loops.{short.name}.at_most", short.at_most, advice) from None


def started(mechanism: Mechanism) -> Mechanism:
    """The mechanism with its loops closed. Raises InputError if it cannot start or move."""
    mechanism = assemble(mechanism)
    check_start(mechanism)
    check_contacts(mechanism)
    check_commands(mechanism)
    return mechanism


def _all_made(content: Mapping[str, Any], numbers: Parameters) -> Iterator[tuple[str, Any]]:
    """(kind, part) for every table of a mechanism, then for what repeats."""
    for kind in KINDS:
        for number, table in enumerate(_tables(content, kind)):
            yield kind, _made(kind, f"{kind}.{number}", table, numbers)
    for number, repeat in enumerate(_tables(content, "repeat")):
        yield from _repeated(f"repeat.{number}", repeat, numbers)


def _repeated(field: str, repeat: Any, numbers: Parameters) -> Iterator[tuple[str, Any]]:
    """(kind, part) of the mechanism for every table that a [[repeat]] stands for."""
    if not isinstance(repeat, Mapping):
        raise InputError(field, repeat, "give a table with count and the tables that repeat")
    index, keys = repeat.get("index", "i"), ("index", "from", "count", *KINDS)
    for key in repeat:
        if key not in keys:
            raise no_such_key(f"{field}.{key}", repeat[key], keys)
    if not isinstance(index, str) or not index.isidentifier() or index in numbers.values:
        raise InputError(f"{field}.index", index, "give a name that no parameter has")
    bounds = {}
    for key, default in (("from", 0), ("count", None)):
        value = numbers.filled(repeat.get(key, default), f"{field}.{key}", {}, "1")
        bounds[key] = checks.number(f"{field}.{key}", value)
        if bounds[key] != round(bounds[key]) or not (key == "from" or bounds[key] >= 0) or bounds[key] > _MOST:
            raise InputError(f"{field}.{key}", bounds[key], f"must be a whole number, at most {_MOST}; a count from 0")
    begin, count = int(bounds["from"]), int(bounds["count"])
    for i in range(begin, begin + count):
        here = numbers.beside(index, i)
        for kind in KINDS:
            for number, table in enumerate(_tables(repeat, kind)):
                yield kind, _made(kind, f"{field}.{kind}.{number}", table, here)


def _made(kind: str, field: str, table: Any, numbers: Parameters) -> Any:
    """Part of a mechanism that a table describes. Raises InputError if the table is wrong."""
    if not isinstance(table, Mapping):
        raise InputError(field, table, "give a table")
    made = reader_of(kind, table, KINDS[kind])
    if kind == "joints":
        require_known(f"{field}.kind", table.get("kind", JointKind.REVOLUTE), (*FACTS, *COMPOSED))
    if kind == "pairs" and isinstance(table.get("friction"), Mapping):
        table = _with_both_frictions(field, table)
    units = units_of_kind(made, table.get("kind"))
    for key in _marked(made, "signal") & table.keys():
        table = {**table, key: read_signal(f"{field}.{key}", table[key], numbers, str(units[key]))}
    for key in _marked(made, "law") & table.keys():
        table = {**table, key: read_spring_law(f"{field}.{key}", table[key], numbers)}
    filled = numbers.filled(table, field, units)
    try:
        return validated(made, filled, field)
    except InputError as error:  # keys of a file are joined by dots
        raise InputError(error.field.replace(f"{field}: ", f"{field}.", 1), error.value, error.advice) from None


def _marked(made: type[Any], mark: str) -> set[str]:
    """Fields of a dataclass with this mark in their metadata."""
    return {item.name for item in fields(made) if mark in item.metadata}


def _with_both_frictions(field: str, table: Mapping[str, Any]) -> dict[str, Any]:
    """Table of a pair whose friction is a table of two coefficients."""
    both, names = table["friction"], ("static", "kinetic")
    for key in both:
        if key not in names:
            raise no_such_key(f"{field}.friction.{key}", both[key], names)
    if set(both) != set(names):
        raise InputError(f"{field}.friction", dict(both), "give static and kinetic, or one number for both")
    if "static_friction" in table:
        raise InputError(f"{field}.static_friction", table["static_friction"], "friction gives it already; remove one")
    return {**table, "friction": both["kinetic"], "static_friction": both["static"]}


def _tables(content: Mapping[str, Any], key: str) -> list[Any]:
    tables = content.get(key, [])
    if not isinstance(tables, list):
        raise InputError(key, tables, f"give a list of tables, [[{key}]]")
    return tables


def _texts(content: Mapping[str, Any], key: str) -> tuple[str, ...]:
    texts = content.get(key, [])
    if not isinstance(texts, list) or not all(isinstance(text, str) for text in texts):
        raise InputError(key, texts, "give a list of texts")
    return tuple(texts)
