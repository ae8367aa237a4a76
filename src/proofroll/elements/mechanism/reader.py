"""Reads a mechanism from the tables of a scene file.

``[[repeat]]`` stands for several tables that differ by a number: ``index = "i"``, ``from = 0``, ``count = "$n"``, and
the tables themselves, ``[[repeat.bodies]]``, ``[[repeat.joints]]`` …; their texts may hold ``{i}`` or ``{i-1}`` and
their expressions ``i``. A joint with ``dependent = true`` has its q0 and v0 found from the loops; its own q0 is a
guess.
"""

from collections.abc import Iterator, Mapping
from dataclasses import fields
from typing import Any

from proofroll.core.errors import InputError, no_such_key
from proofroll.core.parameters import Parameters
from proofroll.core.validation import strict, units_of_kind, validated
from proofroll.elements.mechanism import checks
from proofroll.elements.mechanism.assembly import assemble, check_start
from proofroll.elements.mechanism.contacts.geometry import Geometry, Pair
from proofroll.elements.mechanism.contacts.start import check_contacts
from proofroll.elements.mechanism.drives import Actuator, Coupling
from proofroll.elements.mechanism.joint import Joint
from proofroll.elements.mechanism.model import IN_ANY_ORDER, Mechanism
from proofroll.elements.mechanism.parts import Body, Loop, Point, Spring
from proofroll.elements.mechanism.signal import Table, read_signal

KINDS: dict[str, type[Any]] = {
    "bodies": Body,
    "joints": Joint,
    "loops": Loop,
    "springs": Spring,
    "points": Point,
    "geometries": Geometry,
    "pairs": Pair,
    "actuators": Actuator,
    "couplings": Coupling,
}
strict(*KINDS.values(), Table)
_SIGNALS = {kind: {item.name for item in fields(made) if "signal" in item.metadata} for kind, made in KINDS.items()}
_MOST = 10_000  # largest number of repetitions: more are taken for a typing error


def made_mechanism(content: Mapping[str, Any], gravity: checks.Vector, numbers: Parameters) -> Mechanism:
    """Mechanism of a scene file, its loops closed, able to move.

    Args:
        content: the tables of :data:`KINDS`, ``repeat``, the list of texts ``unmodelled``, and ``impacts``.
        gravity: acceleration in the world's axes [m/s²].
        numbers: the parameters.

    Raises:
        InputError: something in it is wrong; one line says where, what and what to do.
    """
    made: dict[str, list[Any]] = {
        kind: [_made(kind, f"{kind}.{number}", table, numbers) for number, table in enumerate(_tables(content, kind))]
        for kind in KINDS
    }
    for number, repeat in enumerate(_tables(content, "repeat")):
        for kind, item in _repeated(f"repeat.{number}", repeat, numbers):
            made[kind].append(item)
    if not made["bodies"]:
        raise InputError("bodies", "none", "a mechanism needs a body; add a [[bodies]] table")
    parts = {kind: tuple(items) for kind, items in made.items()}
    law = content.get("impacts", IN_ANY_ORDER)
    mechanism = assemble(Mechanism(gravity=gravity, unmodelled=_texts(content, "unmodelled"), impacts=law, **parts))
    check_start(mechanism)
    check_contacts(mechanism)
    return mechanism


def _repeated(field: str, repeat: Any, numbers: Parameters) -> Iterator[tuple[str, Any]]:
    """(kind, part) of the mechanism for every table that a [[repeat]] stands for."""
    if not isinstance(repeat, Mapping):
        raise InputError(field, repeat, "give a table with count and what repeats")
    index, known = repeat.get("index", "i"), ("index", "from", "count", *KINDS)
    for key in repeat:
        if key not in known:
            raise no_such_key(f"{field}.{key}", repeat[key], known)
    if not isinstance(index, str) or not index.isidentifier() or index in numbers.values:
        raise InputError(f"{field}.index", index, "give a name that no parameter has")
    bounds = {}
    for key, default in (("from", 0), ("count", None)):
        given = numbers.filled(repeat.get(key, default), f"{field}.{key}", {}, "1")
        bounds[key] = checks.number(f"{field}.{key}", given)
        if bounds[key] != round(bounds[key]) or not (key == "from" or bounds[key] >= 0) or bounds[key] > _MOST:
            raise InputError(f"{field}.{key}", bounds[key], f"must be a whole number, at most {_MOST}; a count from 0")
    first, count = int(bounds["from"]), int(bounds["count"])
    for i in range(first, first + count):
        here = numbers.beside(index, i)
        for kind in KINDS:
            for number, table in enumerate(_tables(repeat, kind)):
                yield kind, _made(kind, f"{field}.{kind}.{number}", table, here)


def _made(kind: str, field: str, table: Any, numbers: Parameters) -> Any:
    """Part of a mechanism that a table describes. Raises InputError if the table is wrong."""
    if not isinstance(table, Mapping):
        raise InputError(field, table, "give a table")
    made = KINDS[kind]
    units = units_of_kind(made, table.get("kind"))
    for key in _SIGNALS[kind] & table.keys():
        table = {**table, key: read_signal(f"{field}.{key}", table[key], numbers, str(units[key]))}
    filled = numbers.filled(table, field, units)
    try:
        return validated(made, filled, field)
    except InputError as error:  # keys of a file are joined by dots
        raise InputError(error.field.replace(f"{field}: ", f"{field}.", 1), error.value, error.advice) from None


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
