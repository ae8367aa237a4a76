"""Sentences on motions in which nothing happens, so that agreement about them says little."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from proofroll.core.scene import Scene

_STILL = 1e-12  # part of the size of an element by which it moves in round-off


def untouched(scene: Scene, variables: Any, events: Sequence[Any]) -> bool:
    """True if bodies may touch and none does: no event, and no force of a contact.

    Args:
        scene: of the motion.
        variables: of it, a mapping by name.
        events: of it.
    """
    forces = [name for name, item in scene.observables.items() if item.of_contacts and name in variables]
    arrays = [np.asarray(variables[name].values) for name in forces]
    return bool(arrays) and not events and not any(np.any(values != 0) for values in arrays)


def quiet(scene: Scene, variables: Any, events: Sequence[Any]) -> str:
    """Sentence on a motion in which nothing moves, or nothing touches; empty: something does.

    Args:
        scene: of the motion.
        variables: of it, a mapping by name, ``time`` among them.
        events: of it.
    """
    end = float(variables["time"].values[-1])
    if end > 0 and not events and _still(scene, variables):
        return f"Nothing moves up to {end:g} s: every body stays where it starts."
    if end > 0 and untouched(scene, variables, events):
        return f"Nothing touches up to {end:g} s: no contact and no impact is part of the answer."
    return ""


def _still(scene: Scene, variables: Any) -> bool:
    """True if no body of any element moves or turns."""
    for element in scene.elements:
        for name, size in (("p_WB", element.length), ("q_WB", 1.0)):
            item = variables.get(scene.label(element, name))
            if item is None:
                return False
            values = np.asarray(item.values)
            if len(values) < 2 or not np.abs(values - values[:1]).max(initial=0.0) <= _STILL * size:
                return False
    return True
