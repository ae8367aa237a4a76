"""Location of an engine's largest difference at a layer: joint or body, state, the engine's value and the true one."""

import numpy as np

from proofroll.robots.check.layers import RobotTruth
from proofroll.robots.model import Array
from proofroll.robots.protocol import Reading

_TORQUES = ("gravity", "bias", "inverse dynamics")


def worst_place(truth: RobotTruth, reading: Reading, layer: str) -> str | None:
    """Clause with joint or body, state (counted from 0), the engine's and the true value; None: not for this layer."""
    groups = truth.robot.groups
    common = [name for name in reading.joints if name in groups]
    bodies = {joint.name: joint.child for joint in truth.robot.moving}
    carried = [name for name in common if name in reading.mass]
    if layer in {"mass", "bodies"} and carried:
        kinds: dict[str, tuple[dict[str, Array], dict[str, Array]]] = {
            "mass": ({n: np.array(reading.mass[n]) for n in carried}, {n: np.array(groups[n].mass) for n in carried}),
            "centre of mass": (reading.com, {n: groups[n].com for n in carried}),
            "inertia": (reading.inertia, {n: groups[n].inertia for n in carried}),
        }
        for what, (values, true) in kinds.items():
            worst = max(carried, key=lambda name: float(np.abs(values[name] - true[name]).max()))
            numbers, true_numbers = np.ravel(values[worst]), np.ravel(true[worst])
            index = int(np.argmax(np.abs(numbers - true_numbers)))
            if abs(numbers[index] - true_numbers[index]) > 1e-9 * max(abs(numbers[index]), abs(true_numbers[index])):
                return f"body {bodies[worst]}: {what} {numbers[index]:.6g}, true {true_numbers[index]:.6g}"
    if layer == "kinematics":
        true_poses = truth.frames
        differences = [
            (float(np.abs(values - true).max(axis=axes)[state]), name, what, state)
            for name in common
            if name in reading.position
            for what, values, true, axes in (
                ("position", reading.position[name], true_poses[bodies[name]][0], (1,)),
                ("rotation", reading.rotation[name], true_poses[bodies[name]][1], (1, 2)),
            )
            for state in [int(np.argmax(np.abs(values - true).max(axis=axes)))]
        ]
        off, name, what, state = max(differences, default=(0.0, "", "", 0))
        return f"body {bodies[name]}: {what} off by {off:.3g} at state {state}" if name else None
    if layer in _TORQUES:
        texts, expected = {
            "gravity": (reading.g, truth.dynamics.g),
            "bias": (reading.h, truth.dynamics.h),
            "inverse dynamics": (reading.inverse, truth.inverse),
        }[layer]
        return None if texts is None else _torque(truth, reading, texts, expected)
    return None


def _torque(truth: RobotTruth, reading: Reading, values: Array, true: Array) -> str | None:
    start, worst = 0, (0.0, "")
    for name, dofs in zip(reading.joints, reading.dofs, strict=True):
        columns = truth.robot.columns.get(name)
        if columns is not None and columns.stop - columns.start == dofs:
            torque, true_torque = values[:, start : start + dofs], true[:, columns]
            state, index = np.unravel_index(int(np.argmax(np.abs(torque - true_torque))), torque.shape)
            sentence = (
                f"joint {name}: {torque[state, index]:.6g} at state {state}, true {true_torque[state, index]:.6g}"
            )
            worst = max(worst, (float(np.abs(torque - true_torque).max()), sentence))
        start += dofs
    return worst[1] or None
