"""Records of robots as arrays that training frameworks log, and what each of them means by its arrays."""

import importlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.core.errors import InputError, choices, require_known
from proofroll.core.number_format import counted
from proofroll.elements.mechanism import Mechanism
from proofroll.robots.model import Array

ARRAYS = (".npz", ".h5", ".hdf5", ".parquet")  # endings of files that hold arrays
_POSE, _TWIST = 7, 6  # numbers of a floating base: place and quaternion, velocity and angular velocity


@dataclass(frozen=True)
class Layout:
    """Meaning of arrays, each (times, numbers).

    Attributes:
        names: quantity here -> names that its array may have; ``base`` has 13 numbers, ``qpos`` and ``qvel`` begin with
            those of a floating base.
        quaternion: order of its components, ``wxyz`` or ``xyzw``.
        at_centre: True if the velocity of the base is that of its centre of mass, False if of its origin.
        spin_in_base: True if its angular velocity is along its own axes.
        by_level: True if joints are in the order of their distance from the root, False if in that of the robot file.
        inertial: True if place, attitude and velocity of the base are those of the inertial frame of its link.
        from_refs: columns that count from the ``ref`` of an MJCF.
        step: usual step of the program, which rows so far apart may be [s]; None: it has none.
    """

    names: Mapping[str, tuple[str, ...]]
    quaternion: str
    at_centre: bool = False
    spin_in_base: bool = False
    by_level: bool = False
    inertial: bool = False
    from_refs: tuple[str, ...] = ()
    step: float | None = None


_BASE_PARTS = ("base_place", "base_attitude", "base_velocity", "base_spin")  # arrays that make a ``base``
_TIME = ("time", "t")
_COMMON = {"action": ("action", "actions"), "target": ("target", "targets", "joint_pos_target", "dof_pos_target")}
_GYM = {
    "base": ("root_states", "root_state"),
    "q": ("dof_pos", "q"),
    "v": ("dof_vel", "v"),
    "effort": ("torques", "torque"),
} | _COMMON
LAYOUTS: Mapping[str, Layout] = {
    "playground": Layout(
        names={"qpos": ("qpos",), "qvel": ("qvel",), "target": ("ctrl",), "action": ("action", "actions")}
        | {"effort": ("torque", "torques", "actuator_force", "qfrc_actuator")},
        quaternion="wxyz",
        spin_in_base=True,
        from_refs=("q", "target"),
    ),
    "isaaclab": Layout(  # 2.x; its views give velocities of centres of mass
        names={"base": ("root_state_w",), "q": ("joint_pos",), "v": ("joint_vel",)}
        | {"effort": ("applied_torque", "torques", "torque")}
        | _COMMON,
        quaternion="wxyz",
        at_centre=True,
        by_level=True,
    ),
    "pybullet": Layout(  # what getBasePositionAndOrientation, getBaseVelocity and getJointStates return
        names={"base_place": ("base_position",), "base_attitude": ("base_orientation",)}
        | {"base_velocity": ("base_linear_velocity",), "base_spin": ("base_angular_velocity",)}
        | {"q": ("joint_positions", "joint_position"), "v": ("joint_velocities", "joint_velocity")}
        | {"effort": ("applied_torques", "torques", "torque")}
        | _COMMON,
        quaternion="xyzw",
        inertial=True,
        step=1 / 240,
    ),
    "isaacgym": Layout(names=_GYM, quaternion="xyzw", at_centre=True),
    "legged_gym": Layout(names=_GYM, quaternion="xyzw", at_centre=True),
}


def read_arrays(path: Path) -> dict[str, Array]:
    """Arrays of a file by name: ``.npz``, HDF5 (``.h5``, ``.hdf5``) or ``.parquet``.

    Raises:
        InputError: the file cannot be read, or what reads it is not installed.
    """
    readers = dict(zip(ARRAYS, (_of_npz, _of_hdf5, _of_hdf5, _of_parquet), strict=True))
    require_known("record", path.suffix, ARRAYS, "arrays are in files that end in")
    try:
        return {name: np.asarray(values) for name, values in readers[path.suffix](path).items()}
    except ImportError as error:
        raise InputError("record", path, f"pip install {error.name or 'pyarrow'} reads it; or write a .npz") from None
    except Exception as error:
        raise InputError("record", path, f"the file cannot be read: {' '.join(str(error).split())[:200]}") from None


def _of_npz(path: Path) -> dict[str, Any]:
    with np.load(path, allow_pickle=False) as content:
        return {name: content[name] for name in content.files}


def _of_hdf5(path: Path) -> dict[str, Any]:
    library, arrays = importlib.import_module("h5py"), dict[str, Any]()

    def visit(name: str, item: Any) -> None:
        if isinstance(item, library.Dataset):
            arrays[name] = item[()]

    with library.File(path) as content:
        content.visititems(visit)
    return arrays


def _of_parquet(path: Path) -> dict[str, Any]:
    table = importlib.import_module("pandas").read_parquet(path)
    return {str(name): np.stack(table[name].to_numpy()) for name in table.columns}


def floats(arrays: Mapping[str, Array], layout: str, joints: int) -> bool:
    """True if the arrays have a floating base, of a robot with so many other joints.

    Raises:
        InputError: there is no such layout, or no array of the state.
    """
    require_known("--as", layout, LAYOUTS, "choose the program whose arrays these are, from")
    named = _named(arrays, LAYOUTS[layout])
    if "qpos" in named:
        return bool(named["qpos"].shape[1] == joints + _POSE)
    return "base" in named or _BASE_PARTS[0] in named


def columns_of(
    path: Path,
    arrays: Mapping[str, Array],
    layout: str,
    mechanism: Mechanism,
    driven: Sequence[str],
    refs: Mapping[str, float],
) -> tuple[Array, dict[str, Array]]:
    """Times [s] and columns of a record (:class:`.ControlRecord`) in arrays.

    Args:
        path: of the file, for messages.
        arrays: of it.
        layout: of :data:`LAYOUTS`.
        mechanism: the robot.
        driven: its driven joints, in the order of its controller.
        refs: joint -> what MuJoCo's qpos is in the pose of the file, where coordinates here are 0.

    Raises:
        InputError: an array is lacking, or has another number of columns than the robot has joints.
    """
    kind = LAYOUTS[layout]
    quantities = _named(arrays, kind)
    times = _times(path, arrays, len(next(iter(quantities.values()), ())))
    joints = _in_order(mechanism, arrays, by_level=kind.by_level)
    _require_shapes(path, kind, arrays, quantities, len(joints), len(times))
    quantities = _with_base(path, kind, quantities)
    if "qpos" in quantities and "qvel" in quantities:
        positions, rates = quantities.pop("qpos"), quantities.pop("qvel")
        if positions.shape[1] == len(joints) + _POSE:
            quantities["base"] = np.concatenate([positions[:, :_POSE], rates[:, :_TWIST]], axis=1)
        quantities["q"], quantities["v"] = positions[:, -len(joints) :], rates[:, -len(joints) :]
    for name in ("q", "v"):
        if name not in quantities:
            names = choices(kind.names.get(name, ("qpos", "qvel")))
            raise InputError(str(path), name, f"{layout} calls it {names}; the file has {choices(list(arrays))}")
    columns: dict[str, Array] = {}
    moved = [joint for joint in joints if joint in driven]
    for name in ("q", "v", "action", "target", "effort"):
        if name not in quantities:
            continue
        width = quantities[name].shape[1]
        labels = joints if width == len(joints) else moved
        if width != len(labels):
            advice = f"it has {width} columns; the robot has {len(joints)} joints, of which {len(moved)} are driven"
            raise InputError(str(path), name, advice)
        zeros = refs if name in kind.from_refs else {}
        columns |= {f"{name}.{label}": quantities[name][:, k] - zeros.get(label, 0.0) for k, label in enumerate(labels)}
    if "base" in quantities:
        if not np.all(np.any(quantities["base"][:, 3:_POSE], axis=1)):
            raise InputError(str(path), "quaternion of the base", "it is zero in a row, which is no orientation")
        columns |= _base(quantities["base"], kind, mechanism)
    return times, columns


def _require_shapes(
    path: Path, layout: Layout, arrays: Mapping[str, Array], quantities: Mapping[str, Array], joints: int, rows: int
) -> None:
    """Raises InputError for an array with another number of rows than times, or of columns than its state has."""
    parts = dict(zip(_BASE_PARTS, ((3,), (4,), (3,), (3,)), strict=True))
    widths = parts | {"base": (_POSE + _TWIST,), "qpos": (joints, joints + _POSE), "qvel": (joints, joints + _TWIST)}
    if "qpos" in quantities and quantities["qpos"].shape[1] in widths["qpos"]:
        floating = quantities["qpos"].shape[1] == joints + _POSE
        widths["qvel"] = (joints + _TWIST * floating,)
    for quantity, values in quantities.items():
        name = next(name for name in layout.names[quantity] if name in arrays)
        if len(values) != rows:
            raise InputError(str(path), name, f"it has {counted(len(values), 'rows')}, and the file {rows} times")
        if values.shape[1] not in widths.get(quantity, (values.shape[1],)):
            meant = " or ".join(map(str, widths[quantity]))
            advice = f"it has {counted(values.shape[1], 'columns')}, and a robot of {counted(joints, 'joints')} {meant}"
            what = ": place, quaternion, velocity and angular velocity of its base" if quantity == "base" else ""
            raise InputError(str(path), name, advice + what)


def _named(arrays: Mapping[str, Array], layout: Layout) -> dict[str, Array]:
    """Quantity -> its array, (times, numbers); of several environments the first one."""
    quantities = {}
    for quantity, names in layout.names.items():
        name = next((name for name in names if name in arrays), None)
        if name is not None:
            values = np.asarray(arrays[name], float)
            values = values[:, 0] if values.ndim > 2 else values
            quantities[quantity] = values[:, None] if values.ndim == 1 else values
    return quantities


def _with_base(path: Path, layout: Layout, quantities: Mapping[str, Array]) -> dict[str, Array]:
    """Quantities whose arrays of parts of a base are one. Raises InputError if some of them lack."""
    parts = [name for name in _BASE_PARTS if name in quantities]
    lacking = [layout.names[name][0] for name in _BASE_PARTS if parts and name not in parts]
    if lacking:
        raise InputError(str(path), lacking[0], f"the record has parts of its base, and lacks {choices(lacking)}")
    others = {name: item for name, item in quantities.items() if name not in parts}
    return others | ({"base": np.concatenate([quantities[name] for name in parts], axis=1)} if parts else {})


def _times(path: Path, arrays: Mapping[str, Array], count: int) -> Array:
    name = next((name for name in _TIME if name in arrays), None)
    if name is not None:
        times = np.ravel(np.asarray(arrays[name], float))
        steps, even = np.diff(times), np.linspace(times[0], times[-1], len(times))
        rounding = np.finfo(arrays[name].dtype).eps * np.abs(times).max() if arrays[name].dtype.kind == "f" else 0.0
        return np.asarray(even if len(steps) and np.ptp(steps) <= 4 * rounding else times, float)
    if "dt" not in arrays:
        advice = "give an array time [s], or a number dt, the interval between rows"
        raise InputError(str(path), "time", f"{advice}; the file has {choices(list(arrays))}")
    return np.asarray(float(np.ravel(arrays["dt"])[0]) * np.arange(count), float)


def _in_order(mechanism: Mechanism, arrays: Mapping[str, Array], *, by_level: bool) -> list[str]:
    """Joints in the order of the arrays: that of ``joint_names`` among them, if there is one."""
    single = [joint for joint in mechanism.joints if joint.nq == 1]
    names_array = next((arrays[name] for name in ("joint_names", "dof_names") if name in arrays), None)
    if names_array is not None:
        names = [item.decode() if isinstance(item, bytes) else str(item) for item in np.ravel(names_array).tolist()]
        for name in names:
            require_known("joint_names", name, [joint.name for joint in single], "the robot has no such joint; it has")
        return names
    if not by_level:
        return [joint.name for joint in single]
    level = {"world": 0}
    for joint in mechanism.joints:
        level[joint.child] = level[joint.parent] + 1
    return [joint.name for joint in sorted(single, key=lambda joint: level[joint.child])]


def _base(values: Array, layout: Layout, mechanism: Mechanism) -> dict[str, Array]:
    """Columns of the base: its place, quaternion, and velocities in world axes."""
    order = [3 + layout.quaternion.index(letter) for letter in "wxyz"]
    attitude, velocity, spin = values[:, order], values[:, 7:10], values[:, 10:13]
    turned = Rotation.from_quat(attitude, scalar_first=True)
    spin = turned.apply(spin) if layout.spin_in_base else spin
    if layout.at_centre:
        base = next(joint.child for joint in mechanism.joints if joint.nq == _POSE)
        centre = np.array(mechanism.bodies[mechanism.body_index[base]].com)
        velocity = velocity - np.cross(spin, turned.apply(centre))
    parts = {"p_WB": values[:, :3], "q_WB": attitude, "v_WB": velocity, "w_WB": spin}
    return {
        f"{name}.{'wxyz'[k] if name == 'q_WB' else 'xyz'[k]}": part[:, k]
        for name, part in parts.items()
        for k in range(part.shape[1])
    }
