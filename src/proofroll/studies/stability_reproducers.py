"""Writes a self-contained program for every boundary of a map that shows the failure with the engine alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from proofroll.studies.stability import StabilityMap


def write_reproducers(found: StabilityMap, study: dict[str, Any], folder: Path) -> None:
    """Puts the path of each program into its point, or why there is none."""
