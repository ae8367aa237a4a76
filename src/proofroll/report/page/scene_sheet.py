"""Sheet of a comparison's scene: drawing, and every parameter with symbol, values, unit, meaning and source."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from proofroll.core.scene import Scene
from proofroll.files.scene_file import SceneFile, load_scene, read_scene_file
from proofroll.files.scene_parameters import Parameter
from proofroll.report.kinds import kind_of
from proofroll.report.labels import symbol, unit
from proofroll.report.pages import environment, rendered
from proofroll.report.pen import Picture

# Largest number of values of a parameter that are listed one by one.
_LISTED = 5


@dataclass(frozen=True)
class ShownParameter:
    """A parameter for readers; ``varied``: True if it has several values."""

    name: str
    symbol: str
    values: str
    unit: str
    meaning: str
    source: str
    varied: bool


@dataclass(frozen=True)
class SceneSheet:
    """Sheet of a scene; ``undrawn``: reason for a missing drawing; ``caption``: of the drawings, as markup."""

    title: str
    source: str
    parameters: list[ShownParameter]
    drawings: list[Picture]
    undrawn: str
    caption: str


def scene_sheet(scene: str, points: Sequence[dict[str, float]]) -> SceneSheet:
    """Sheet of a scene by name or path; ``points`` as for :func:`sheet_of`."""
    return sheet_of(
        read_scene_file(scene), points, [load_scene(scene, **point) for point in points] or [load_scene(scene)]
    )


def scene_page(scene: str, start: Sequence[str]) -> str:
    """HTML page of a scene with sentences on its start; text from the scene's file is escaped."""
    return rendered(environment(), "scene_page.html", sheet=scene_sheet(scene, []), start=start)


def sheet_of(file: SceneFile, points: Sequence[dict[str, float]], scenes: Sequence[Scene]) -> SceneSheet:
    """Sheet of a scene for the cases of a comparison.

    Args:
        file: the scene's.
        points: values of the parameters that differ from the scene's own, one entry for each case.
        scenes: scenes of these cases; without cases the scene with its own parameters.
    """
    kind = kind_of(scenes[0])
    drawings, undrawn = kind.drawings(scenes) if kind else ([], "There is no drawing for this kind of scene.")
    parameters = []
    for name, parameter in file.parameters.items():
        set_to = [point.get(name) for point in points]
        default = _own(parameter.value, file.parameters)
        values = list(dict.fromkeys(default if value is None else _written(value) for value in set_to)) or [default]
        parameters.append(
            ShownParameter(
                name=name,
                symbol=_letter(parameter.symbol) or symbol(name),
                values=_listed(values),
                unit=unit(parameter.unit),
                meaning=parameter.meaning,
                source=parameter.source,
                varied=len(values) > 1,
            )
        )
    return SceneSheet(
        title=file.title,
        source=file.source,
        parameters=parameters,
        drawings=drawings,
        undrawn=undrawn,
        caption=kind.caption if kind else "",
    )


def _letter(text: str) -> str:
    """Symbol of the file with Greek letters and without the underscore of an index: ``mu_s`` is μs."""
    name, _, rest = text.partition("_")
    head, bracket, tail = name.partition("(")
    return symbol(head) + bracket + tail + rest


def _own(value: float | str, parameters: Mapping[str, Parameter]) -> str:
    """Text of a default value, or the symbol of the parameter that it refers to."""
    if isinstance(value, str):
        return f"= {_letter(parameters[value].symbol) or value}"
    return _written(value)


def _written(value: float) -> str:
    return "∞" if math.isinf(value) else f"{value:.6g}"


def _listed(values: list[str]) -> str:
    """All values, or the first ones and the number of further ones, as text."""
    if len(values) <= _LISTED + 1:
        return ", ".join(values)
    return f"{', '.join(values[:_LISTED])} and {len(values) - _LISTED} more"
