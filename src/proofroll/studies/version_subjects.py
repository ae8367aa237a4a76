"""What two versions of an engine are compared on: comparisons, or a scene."""

from __future__ import annotations

from proofroll.core.comparison import Band, Comparison, Row, Tolerance
from proofroll.core.errors import InputError
from proofroll.core.plugins import parse_engine
from proofroll.files.comparison_file import comparison_names, load_comparison
from proofroll.files.data_folders import study_folders
from proofroll.files.scene_file import load_scene, read_scene_file, scene_folder
from proofroll.files.toml import study_of
from proofroll.running.asking import describe

# Of a scene about which no comparison is written.
_UNTIL, _EVERY = 2.0, 0.01


_BECAUSE = (
    "a thousandth of its size is what a measurement or a picture would show; no comparison says more about this scene"
)


def comparisons_about(subject: str, engine: str) -> list[Comparison]:
    """What is run: a comparison, or those about a scene, or all that have rows of the engine.

    Args:
        subject: name or path of a comparison, or of a scene; empty: all comparisons, briefly.
        engine: plain name; of a scene without comparisons, each of its formulations and presets is run.

    Raises:
        InputError: there is no such thing, or it has nothing of this engine.
    """
    if not subject:
        found = [load_comparison(name).briefly() for name in comparison_names()]
        found = [item for item in found if _rows_of(item, engine)]
        if not found:
            raise InputError("engine", engine, "no comparison has rows of it; name a scene or a comparison")
        return found
    try:
        scene_folder(subject)
    except InputError:
        loaded = load_comparison(subject)
        if not _rows_of(loaded, engine):
            raise InputError("engine", engine, f"{loaded.name} has no rows of it") from None
        return [loaded]
    files = [path for folder in study_folders() for path in sorted(folder.rglob("*.toml")) if study_of(path) is None]
    about = [item for path in files if (item := load_comparison(str(path))).scene == subject and _rows_of(item, engine)]
    return about or [_of_scene(subject, engine)]


def _rows_of(comparison: Comparison, engine: str) -> list[Row]:
    return [row for row in comparison.rows if parse_engine(row.engine).name == engine]


def _of_scene(name: str, engine: str) -> Comparison:
    """Every formulation and preset of an engine on a scene, held to a thousandth of what decides there."""
    scene = load_scene(name)
    told = describe(engine) if named_engine(engine) else None
    if told is None:
        raise InputError("engine", engine, f"no comparison about {name} has rows of it, and it is not installed here")
    rows = [
        Row(f"{engine}[formulation={formulation},preset={preset}]", "thousandth")
        for formulation, presets in told["presets"].items()
        if set(scene.requires) & set(told["provides"][formulation])
        for preset in presets
    ]
    if not rows:
        raise InputError("engine", engine, f"none of its formulations is for scenes like {name}")
    bands = {"thousandth": Band(_BECAUSE, {scene.deciding: Tolerance(1e-3, True)})}
    title = read_scene_file(name).title
    return Comparison(name, title, title, name, _UNTIL, _EVERY, bands=bands, rows=rows, timed=False)


def named_engine(name: str) -> bool:
    """Whether an installed package announces this engine."""
    from proofroll.core.plugins import engine_names

    return name in engine_names()
