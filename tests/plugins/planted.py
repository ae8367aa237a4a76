"""Engines with a planted fault: an engine with one text of its source replaced, made when it is asked for."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

_SOURCE = Path(__file__).resolve().parents[2] / "docs" / "examples" / "tree_euler.py"
# Name of a fault -> text of the example of mechanisms, and what takes its place.
FAULTS = {
    "sound": ("", ""),
    "sign": ("+ np.cross(w, inertia @ w)", "- np.cross(w, inertia @ w)"),
    "frame": ("R @ body.inertia @ R.T", "body.inertia"),
    "row": ("bias[:3] + np.cross(bias[3:], c)", "bias[:3]"),
    "carried": ("+ np.cross(w, np.cross(w, c))", ""),
    "turning": ("inertia @ bias[3:] + np.cross", "np.cross"),
    "centre": ("c, inertia = R @ body.com,", "c, inertia = body.com,"),
    "rest": ("self.q, self.v = mechanism.start()", "self.q, self.v = mechanism.start()[0], 0 * mechanism.start()[1]"),
    "clock": ("self.q = self.q + self.dt * self.v", "self.q = self.q + 1.001 * self.dt * self.v"),
    "attitude": ("to_quaternion(R) for R", "to_quaternion(R.T) for R"),
}
# Name of a fault -> module of an engine, text of it, and what takes its place; and the engine's class.
IN_ENGINES = {
    "bristle": (
        "proofroll.engines.exudyn.smooth.joint_laws",
        "(-1.0 if rate < 0 else 1.0) if joint.friction",
        "1.0 if joint.friction",
        "proofroll.engines.exudyn.adapter:Exudyn",
    ),
    "late": (
        "proofroll.engines.exudyn.smooth.joint_laws",
        "return float(moved(signal, t).place)",
        "return float(moved(signal, 0.99 * t).place)",
        "proofroll.engines.exudyn.adapter:Exudyn",
    ),
    "rebound": (
        "proofroll.engines.projection.contact.contact_modes",
        "= self.contacts[hit].restitution,",
        "= 0.97 * self.contacts[hit].restitution,",
        "proofroll.engines.projection.adapter:Projection",
    ),
}


def _replaced(source: str, right: str, wrong: str) -> str:
    assert right in source
    return source.replace(right, wrong) if right else source


def __getattr__(fault: str) -> Any:
    """Class of an engine with a fault of this name; one in an installed engine changes this process."""
    if fault in FAULTS:
        module = ModuleType(f"planted_{fault}")
        module.__file__, sys.modules[f"planted_{fault}"] = str(_SOURCE), module  # dataclasses look there
        text = _replaced(_SOURCE.read_text(encoding="utf-8"), *FAULTS[fault])
        exec(compile(text, str(_SOURCE), "exec", dont_inherit=True), vars(module))
        engine: Any = vars(module)["TreeEuler"]
    elif fault in IN_ENGINES:
        name, right, wrong, place = IN_ENGINES[fault]
        where, _, kind = place.partition(":")
        engine = getattr(importlib.import_module(where), kind)
        right_one = importlib.import_module(name)
        assert right_one.__file__ is not None
        faulty = ModuleType(name)
        faulty.__package__ = right_one.__package__
        text = _replaced(Path(right_one.__file__).read_text(encoding="utf-8"), right, wrong)
        exec(compile(text, right_one.__file__, "exec", dont_inherit=True), vars(faulty))
        for label, item in vars(faulty).items():  # others hold the classes, so that their methods are replaced
            if isinstance(item, type) and item.__module__ == name:
                for attribute, value in vars(item).items():
                    if isinstance(value, FunctionType) and "__class__" not in value.__code__.co_freevars:
                        setattr(getattr(right_one, label), attribute, value)
    else:
        raise AttributeError(fault)
    engine.name = fault
    globals()[fault] = engine
    return engine
