"""Cases for two versions of an engine: comparisons, a scene, or all that there is."""

from __future__ import annotations

import dataclasses

from proofroll.core.comparison import Comparison, Row
from proofroll.core.errors import InputError
from proofroll.core.plugins import parse_engine
from proofroll.files.comparison_file import comparison_names, load_comparison
from proofroll.files.data_folders import study_folders
from proofroll.files.scene_file import scene_folder
from proofroll.files.toml import study_of
from proofroll.studies.comparison import default_comparison as first_look


def comparisons_about(subject: str, engine: str) -> list[Comparison]:
    """Comparisons to run: one, or those about a scene, or all that have rows of the engine.

    Args:
        subject: name or path of a comparison, or of a scene; empty: all comparisons, briefly.
        engine: plain name; of a scene without comparisons, each of its formulations and presets is run.

    Raises:
        InputError: there is no such thing, or it has nothing of this engine.
    """
    if not subject:
        comparisons = [load_comparison(name).briefly() for name in comparison_names()]
        comparisons = [item for item in comparisons if _rows_of(item, engine)]
        if not comparisons:
            raise InputError("engine", engine, "no comparison has rows of it; name a scene or a comparison")
        return comparisons
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
    """Rows of one engine in the default comparison of a scene."""
    looked = first_look.compared(name, {})
    rows = _rows_of(looked, engine)
    if not rows:
        why = f"no comparison about {name} has rows of it, and no formulation of it that is installed here can"
        raise InputError("engine", engine, why)
    return dataclasses.replace(looked, rows=rows, timed=False)
