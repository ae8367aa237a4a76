"""Sentences on motions in which nothing happens, so that agreement about them says little."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from proofroll.core.scene import Scene

_STILL = 1e-12  # part of the size of an element by which it moves in round-off
_SAME = 1e-6  # relative difference of two intervals of time that is round-off


def untouched(scene: Scene, variables: Any, events: Sequence[Any]) -> bool:
    """True if bodies may touch and none does: no event, no force of a contact, and every gap is open.

    Args:
        scene: of the motion.
        variables: of it, a mapping by name.
        events: of it.
    """
    forces = [name for name, item in scene.observables.items() if item.of_contacts and name in variables]
    arrays = [np.asarray(variables[name].values) for name in forces]
    open_gap = _STILL * min(element.length for element in scene.elements)
    gaps = [name for name, item in scene.observables.items() if item.apart and name in variables]
    closed = any(np.any(np.asarray(variables[name].values) <= open_gap) for name in gaps)
    return bool(arrays) and not (events or closed or any(np.any(values != 0) for values in arrays))


def quiet(scene: Scene, variables: Any, events: Sequence[Any]) -> str:
    """Sentence on a motion in which nothing moves, or nothing touches; empty: something does.

    Args:
        scene: of the motion.
        variables: of it, a mapping by name, ``time`` among them.
        events: of it.
    """
    times = np.asarray(variables["time"].values, dtype=float)
    end = float(times[-1])
    if len(times) < 2 or times[0] > (1 + _SAME) * (times[1] - times[0]):
        return ""  # what happened before the first sample is not known
    if not events and _still(scene, variables):
        return f"Nothing moves up to {end:g} s: every body stays where it starts."
    if untouched(scene, variables, events):
        return f"Nothing touches up to {end:g} s: no contact and no impact is part of the answer."
    return ""


def _still(scene: Scene, variables: Any) -> bool:
    """True if no body of any element moves or turns."""
    for element in scene.elements:
        rate = 1 / element.natural_time
        for name, size, rests in (
            ("p_WB", element.length, False),
            ("q_WB", 1.0, False),
            ("v_WB", rate * element.length, True),
            ("w_WB", rate, True),
        ):
            item = variables.get(scene.label(element, name))
            if item is None:
                return False
            values = np.asarray(item.values)
            least = 0.0 if rests else values[:1]
            if not np.abs(values - least).max(initial=0.0) <= _STILL * size:
                return False
    return True
