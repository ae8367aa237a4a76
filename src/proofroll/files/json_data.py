"""Conversion of records to plain data for JSON, and back."""

import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any, TypeVar

_Record = TypeVar("_Record")

# Metadata of a record's field. MERGED: its own fields become fields of the record around it. OPTIONAL: it is left out
# if it is None.
MERGED, OPTIONAL = {"json": "merged"}, {"json": "optional"}


def plain(value: Any) -> Any:
    """Plain data for JSON.

    Records become dictionaries, by their own ``as_dict`` if they have one; numbers that are not finite become None.
    """
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if is_dataclass(value):
        return _plain_record(value)
    return plain(value.tolist()) if hasattr(value, "tolist") else value  # numpy arrays and numbers


def _plain_record(record: Any) -> Any:
    if hasattr(record, "as_dict"):
        return plain(record.as_dict())
    content: dict[str, Any] = {}
    for field in fields(record):
        value, how = getattr(record, field.name), field.metadata.get("json")
        if how == "merged":
            content |= plain(value) or {}
        elif value is not None or how != "optional":
            content[field.name] = plain(value)
    return content


def record(kind: type[_Record], content: object) -> _Record:
    """Record from content made by :func:`plain`; keys without a field are ignored.

    Raises:
        ValueError: the content does not fit the record.
    """
    from pydantic import TypeAdapter  # takes a while to import, and few commands read records

    return TypeAdapter(kind).validate_python(content)
