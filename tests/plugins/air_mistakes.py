"""Mistakes of bookkeeping, planted in the law of a robot in the air."""

from __future__ import annotations

import numpy as np

from proofroll.robots.control.bookkeeping.law import ControlLaw
from proofroll.robots.control.bookkeeping.mistakes import orders


def planted(law: ControlLaw) -> dict[str, tuple[str, str, ControlLaw]]:
    """Name -> id of the mistake, layer at which a record shows it, and the law with it."""
    known = dict(orders(law.joints))
    swap = next(order for words, order in known.items() if "swapped" in words)
    places = known["place by place"]
    signs, offset = law.signs.copy(), np.where(np.arange(len(law.pose)) % 2, -0.2, 0.1)
    signs[1] = -1
    laws = {
        "legs swapped": ("joint_order", "target", {"action_order": swap}),
        "place by place": ("joint_order", "target", {"action_order": places}),
        "order in the observation": ("observed_order", "observation", {"observed_order": swap}),
        "pose missing": ("pose_missing", "target", {"pose": 0 * law.pose}),
        "pose off": ("pose", "target", {"pose": law.pose + offset}),
        "half kp": ("kp", "effort", {"kp": 0.5 * law.kp}),
        "kp + 10 %": ("kp", "effort", {"kp": 1.1 * law.kp}),
        "half kd": ("kd", "effort", {"kd": 0.5 * law.kd}),
        "kd + 10 %": ("kd", "effort", {"kd": 1.1 * law.kd}),
        "double scale": ("scale", "target", {"scale": 2 * law.scale}),
        "half scale": ("scale", "target", {"scale": 0.5 * law.scale}),
        "a step more": ("decimation", "instants", {"extra_steps": 1}),
        "a step less": ("decimation", "instants", {"extra_steps": -1}),
        "an instant late": ("late", "target", {"delay": 1}),
        "no clamp": ("clamp_missing", "effort", {"limit": np.inf * law.limit}),
        "half the clamp": ("clamp", "effort", {"limit": 0.5 * law.limit}),
        "no armature": ("armature", "acceleration", {"armature": 0 * law.armature}),
        "xyzw": ("quaternion", "observation", {"scalar_last": True}),
        "sign of gravity": ("gravity_sign", "observation", {"gravity_sign": -1.0}),
        "velocity in the base": ("velocity_frame", "observation", {"velocity_turns": 1}),
        "spin in the world": ("spin_frame", "observation", {"spin_turns": 0}),
        "sign of a joint": ("joint_sign", "target", {"signs": signs}),
        "state before": ("state_before", "effort", {"lag": 1}),
        "gravity 9.80": ("gravity", "acceleration", {"gravity": 9.80 / 9.81}),
        "no gravity": ("gravity", "acceleration", {"gravity": 0.0}),
    }
    return {name: (cause, layer, law.change(**changes)) for name, (cause, layer, changes) in laws.items()}
