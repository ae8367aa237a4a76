"""Engines with a planted fault: the example engine of mechanisms, with one text of its source replaced."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType
from typing import Any

_SOURCE = Path(__file__).resolve().parents[2] / "docs" / "examples" / "tree_euler.py"
# Name of a fault -> text of the example, and what takes its place.
FAULTS = {
    "sound": ("", ""),
    "sign": ("+ np.cross(w, inertia @ w)", "- np.cross(w, inertia @ w)"),
    "frame": ("R @ body.inertia @ R.T", "body.inertia"),
    "row": ("bias[:3] + np.cross(bias[3:], c)", "bias[:3]"),
}


def planted(fault: str) -> Any:
    """Class of the example engine with a fault."""
    right, wrong = FAULTS[fault]
    source = _SOURCE.read_text(encoding="utf-8")
    assert right in source
    module = ModuleType(f"planted_{fault}")
    module.__file__, sys.modules[f"planted_{fault}"] = str(_SOURCE), module  # dataclasses look there
    text = source.replace(right, wrong) if right else source
    exec(compile(text, str(_SOURCE), "exec", dont_inherit=True), vars(module))
    engine: Any = vars(module)["TreeEuler"]
    engine.name = fault
    return engine


sound, sign, frame, row = map(planted, FAULTS)
