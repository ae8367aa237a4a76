"""The schema of report.json in the documentation."""

from __future__ import annotations

from typing import Any

import pytest
from report_schema import SCHEMA, problems


def known(schema: dict[str, Any]) -> set[str]:
    """Keywords of a schema and of all schemas in it."""
    inner = [*schema.get("properties", {}).values(), schema.get("items", {}), schema.get("additionalProperties", {})]
    return set(schema).union(*(known(item) for item in inner if item))


def test_the_schema_uses_only_what_is_checked_here() -> None:
    """A keyword that this test does not know would promise what nobody holds a report against."""
    assert known(SCHEMA) <= {
        "$schema", "title", "description", "type", "enum", "const", "pattern", "required", "properties",
        "additionalProperties", "items", "minItems", "maxItems",
    }  # fmt: skip


def test_what_breaks_the_schema_is_found() -> None:
    """A missing field, another type, a verdict that there is not, and thirteen words where twelve are allowed."""
    row = SCHEMA["properties"]["comparisons"]["items"]["properties"]["rows"]["items"]["properties"]
    short = row["claim"]["properties"]["short"]
    assert next(problems({}, SCHEMA)) == ".date is missing"
    assert list(problems(3, short))
    assert list(problems("perhaps", row["verdict"]))
    assert not list(problems(" ".join(["word"] * 12), short))
    assert list(problems(" ".join(["word"] * 13), short))
    with pytest.raises(KeyError):
        list(problems({}, {"type": "thing"}))
