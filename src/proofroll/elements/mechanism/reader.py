"""Reads a mechanism from the tables of a scene file.

``[[repeat]]`` writes tables that differ by a number only once: ``index = "i"``, ``from = 0``, ``count = "$n"``, and the
tables themselves, ``[[repeat.bodies]]``, ``[[repeat.joints]]`` …; their texts may hold ``{i}`` or ``{i-1}`` and their
expressions ``i``. A joint with ``dependent = true`` has its q0 and v0 found from the loops; its own q0 is the guess.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields
from typing import Any

from proofroll.core.errors import InputError, no_such_key
from proofroll.elements.mechanism import checks
from proofroll.elements.mechanism.assembly import assembled, check_start
from proofroll.elements.mechanism.expressions import substituted
from proofroll.elements.mechanism.joint import Joint
from proofroll.elements.mechanism.model import Mechanism
from proofroll.elements.mechanism.parts import Body, Loop, Point, Spring

KINDS: dict[str, type[Any]] = {"bodies": Body, "joints": Joint, "loops": Loop, "springs": Spring, "points": Point}
_TEXTS = ("name", "kind", "parent", "child", "body", "body_a", "body_b")
_MOST = 10_000  # repetitions: beyond it, a slip of the pen


def made_mechanism(content: Mapping[str, Any], gravity: checks.Vector, values: Mapping[str, float]) -> Mechanism:
    """The mechanism of a scene file, its loops closed, able to move.

    Args:
        content: the tables bodies, joints, loops, springs, points and repeat, and the list of texts unmodelled.
        gravity: acceleration in the world's axes [m/s²].
        values: the parameters.

    Raises:
        InputError: something in it is wrong; one line says where, what and what to do.
    """
    tables: dict[str, list[tuple[str, Any]]] = {kind: [] for kind in KINDS}
    for kind in KINDS:
        for place, table in enumerate(_tables(content, kind)):
            tables[kind].append((f"{kind}.{place}", substituted(f"{kind}.{place}", table, values)))
    for place, repeat in enumerate(_tables(content, "repeat")):
        for kind, field, table in _repeated(f"repeat.{place}", repeat, values):
            tables[kind].append((field, table))
    dependent = [_flag(field, table, "dependent") for field, table in tables["joints"]]
    made = {kind: tuple(_made(KINDS[kind], field, table) for field, table in tables[kind]) for kind in KINDS}
    if not made["bodies"]:
        raise InputError("bodies", "none", "a mechanism needs a body; add a [[bodies]] table")
    mechanism = Mechanism(gravity=gravity, unmodelled=_texts(content, "unmodelled"), **made)
    names = {joint.name for joint, follows in zip(made["joints"], dependent, strict=True) if follows}
    mechanism = assembled(mechanism, names)
    check_start(mechanism)
    return mechanism


def _repeated(field: str, repeat: Any, values: Mapping[str, float]) -> list[tuple[str, str, Any]]:
    """Kind, place and content of every table that a [[repeat]] stands for."""
    if not isinstance(repeat, Mapping):
        raise InputError(field, repeat, "give a table with count and what repeats")
    index, known = repeat.get("index", "i"), ("index", "from", "count", *KINDS)
    for key in repeat:
        if key not in known:
            raise no_such_key(f"{field}.{key}", repeat[key], known)
    if not isinstance(index, str) or not index.isidentifier() or index in values:
        raise InputError(f"{field}.index", index, "give a name that no parameter has")
    bounds = {}
    for key, default in (("from", 0), ("count", None)):
        bounds[key] = checks.number(f"{field}.{key}", substituted(f"{field}.{key}", repeat.get(key, default), values))
        if bounds[key] != round(bounds[key]) or not (key == "from" or bounds[key] >= 0) or bounds[key] > _MOST:
            raise InputError(f"{field}.{key}", bounds[key], f"must be a whole number, at most {_MOST}; a count from 0")
    first, count = int(bounds["from"]), int(bounds["count"])
    return [
        (kind, f"{field}.{kind}.{place}", substituted(f"{field}.{kind}.{place}", table, {**values, index: i}))
        for i in range(first, first + count)
        for kind in KINDS
        for place, table in enumerate(_tables(repeat, kind))
    ]


def _made(kind: type[Any], field: str, table: Any) -> Any:
    """The dataclass of one table."""
    if not isinstance(table, Mapping):
        raise InputError(field, table, "give a table")
    known = {item.name: item.default for item in fields(kind)}
    for key in table:
        if key not in known:
            raise no_such_key(f"{field}.{key}", table[key], [*known, *["dependent"] * (kind is KINDS["joints"])])
    for key, default in known.items():
        if default is MISSING and key not in table:
            raise InputError(f"{field}.{key}", "nothing", "this key is required; add it")
        if key in _TEXTS and not isinstance(table[key], str):
            raise InputError(f"{field}.{key}", table[key], "give a name")
    return kind(**table)


def _flag(field: str, table: Any, key: str) -> bool:
    """Takes a yes or no out of a table."""
    value = table.pop(key, False) if isinstance(table, dict) else False
    if not isinstance(value, bool):
        raise InputError(f"{field}.{key}", value, "give true or false")
    return value


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
