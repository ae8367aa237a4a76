"""Plain data, as JSON can hold it: the one place where records become dictionaries."""

import math
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any, TypeVar

_Record = TypeVar("_Record")

# How a field of a record stands in JSON, where not under its own name: with its own fields among those around it; or
# not at all where it is None.
MERGED, OPTIONAL = {"json": "merged"}, {"json": "optional"}


def plain(value: Any) -> Any:
    """The value with everything that JSON cannot hold replaced.

    Records become dictionaries, by their own ``as_dict`` where they have one; numbers that are not finite become None.
    """
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if is_dataclass(value):
        return _plain_record(value)
    return plain(value.tolist()) if hasattr(value, "tolist") else value  # of numpy


def _plain_record(record: Any) -> Any:
    if hasattr(record, "as_dict"):
        return plain(record.as_dict())
    told: dict[str, Any] = {}
    for field in fields(record):
        value, how = getattr(record, field.name), field.metadata.get("json")
        if how == "merged":
            told |= plain(value) or {}
        elif value is not None or how != "optional":
            told[field.name] = plain(value)
    return told


def record(kind: type[_Record], content: object) -> _Record:
    """Record from the content that :func:`plain` made of it; keys without a field are left out.

    Raises:
        ValueError: it is of something else.
    """
    from pydantic import TypeAdapter  # takes a while to import, and few commands read records

    return TypeAdapter(kind).validate_python(content)
