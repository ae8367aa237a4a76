"""Default axes of the stability map of a scene without a file."""

from proofroll.core.errors import ProofrollError
from proofroll.files.scene_file import load_scene, read_scene_file
from proofroll.studies.stability.axes import Axis, AxisTerm

# Values of a parameter along an axis, relative to its default, as far as its bounds allow.
_PARTS = (0.1, 1.0, 10.0)


def axes_of(name: str) -> list[Axis]:
    """Axes of a stability map: each continuous parameter of the scene that is not zero, and the length of the run."""
    file = read_scene_file(name)
    values = load_scene(name).parameters
    axes = []
    for key, item in file.parameters.items():
        if item.integer or not values[key]:
            continue
        allowed = [part for part in _PARTS if _loads(name, key, part * values[key])]
        if len(allowed) > 1:
            axes.append(Axis(key, "1", f"{item.meaning}, in parts of the default", allowed, {key: AxisTerm(key)}))
    return [*axes, Axis("horizon", "swings", "length of the run in natural times", [1.0, 3.0], horizon=True)]


def _loads(name: str, key: str, value: float) -> bool:
    try:
        load_scene(name, **{key: value})
    except ProofrollError:
        return False
    return True
