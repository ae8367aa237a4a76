"""Tables that are written as TOML are read as they were."""

from __future__ import annotations

import math
import tomllib

from proofroll.files.toml import toml_text


def test_written_tables_are_read_as_they_were() -> None:
    """Numbers to the last digit, texts with quotes, bools, lists, tables, tables in rows and lists of tables."""
    content = {
        "title": 'a "quoted" \\ text\nof two lines, µ',
        "number": 0.1 + 0.2,
        "rate": 1e-300,
        "whole": 3,
        "true": True,
        "empty": [],
        "gravity": {"direction": [0.0, -1.0, 0.0]},
        "bodies": [{"name": "a", "inertia": [[1.0, 0.0], [0.0, 1.0]]}, {"name": "b"}],
        "pairs": [{"friction": {"static": 0.5, "kinetic": 0.3}}, {"friction": math.inf}],
    }
    assert tomllib.loads(toml_text(content)) == content
