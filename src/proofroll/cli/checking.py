"""Checks the file of a scene, a comparison or another study without running anything."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from proofroll.cli import options
from proofroll.core.entry_points import announced
from proofroll.core.errors import InputError, choices, require_known
from proofroll.core.number_format import counted

# Group of entry points for functions that read the file of a study, given its path as text; the name is ``study``.
READERS = "proofroll.study_readers"


def is_text_check(name: Path) -> bool:
    """True for the path or name of a scene or of the file of a study, False for robot files."""
    return name.suffix in {"", ".toml"} or name.is_dir()


def check_text(name: str, as_json: bool, plot: Path | None = None, settings: list[str] | None = None) -> None:
    """Prints one line on the content of a scene or of the file of a study, and below it how a scene starts.

    Args:
        name: of a scene or the file of a study, or a path.
        as_json: True for one JSON document instead.
        plot: page to which a scene is drawn.
        settings: parameters of a scene, as ``--set`` has them.

    Raises:
        InputError: the first mistake in it.
    """
    sound = checked_file(name, options.assignments(settings))
    if plot is not None:
        _draw(sound, plot)
    counts = ", ".join(counted(count, what) for what, count in sound.counts.items())
    needs = f"; engines must provide: {', '.join(sound.requires)}" if sound.requires else ""
    about = f"{sound.scene}, " if sound.kind != "scene" and sound.scene else ""
    head = f"{sound.name} is sound: {sound.kind}, {about}{counts}{needs}"
    doubts = [f"  warning: {line}" for line in sound.warnings]
    drawn = [] if plot is None else [f"The plot is in {plot}."]
    if as_json:
        options.write_json(sound)
        return
    options.show_lines([head, *(f"  {line}" for line in sound.start), *doubts, *drawn])


def _draw(file: SoundFile, plot: Path) -> None:
    """Draws a scene at its start to an HTML page."""
    if file.kind != "scene":
        raise InputError("--plot", plot, f"{file.name} is no scene; name one")
    if plot.suffix.lower() != ".html":
        raise InputError("--plot", plot, "a drawn scene is a page: end the name of the file in .html")
    options.require_pages()
    options.require_writable(plot, "--plot")
    from proofroll.report.page.scene_sheet import scene_page
    from proofroll.running.store import write_text

    write_text(plot, scene_page(file.path, file.start))


@dataclasses.dataclass(frozen=True)
class SoundFile:
    """Counts of the parts of a scene or file, requirements of a scene, its start, and numbers in a wrong unit."""

    kind: str
    name: str
    path: str
    scene: str
    counts: dict[str, int]
    requires: list[str] = dataclasses.field(default_factory=list)
    start: list[str] = dataclasses.field(default_factory=list)
    warnings: list[str] = dataclasses.field(default_factory=list)


def checked_file(name: str, parameters: Mapping[str, Any]) -> SoundFile:
    """Content of a scene (a name, the path of its folder or of its ``scene.toml``) or of the file of a study.

    Raises:
        InputError: there is no such scene or file, or the first mistake in it; a study has no parameters.
    """
    from proofroll.files.scene_file import scene_folder, scene_names
    from proofroll.files.scene_sources import source_of

    if source_of(name) is not None:
        return _scene(name, parameters)
    try:
        scene_folder(name)
    except InputError as error:
        from proofroll.files.comparison_file import comparison_names
        from proofroll.files.toml import named_file, study_of

        file = named_file(name)
        if Path(name).is_dir():
            raise error from None
        if file is None:
            advice = (
                f"there is no such scene or file; the scenes are {choices(scene_names(), name)}, "
                f"the comparisons {choices(comparison_names(), name)}"
            )
            raise InputError("check", name, advice) from None
        for key, value in parameters.items():
            raise InputError(f"--set {key}", value, "this is for scenes, and a study has its own points") from None
        return _comparison(file) if study_of(file) is None else _study(file, str(study_of(file)))
    return _scene(name, parameters)


def _scene(name: str, parameters: Mapping[str, Any]) -> SoundFile:
    from proofroll.core.element_abilities import DoubtsNumbers, TellsStart
    from proofroll.files.scene_file import load_scene, read_scene_file
    from proofroll.files.scene_sources import source_of

    file, scene = read_scene_file(name), load_scene(name, **parameters)
    tables = {f"[[{key}]]": len(value) for key, value in file.tables.items() if isinstance(value, list)}
    counts = {"parameters": len(file.parameters)} | tables
    start = [scene.title] if source_of(name) is not None else []
    start += [line for element in scene.elements if isinstance(element, TellsStart) for line in element.start_facts]
    doubts = [line for element in scene.elements if isinstance(element, DoubtsNumbers) for line in element.implausible]
    path = name if source_of(name) is not None else str(scene.folder / "scene.toml")
    return SoundFile(
        kind="scene",
        name=scene.name,
        path=path,
        scene=scene.name,
        counts=counts,
        requires=sorted(scene.requires),
        start=start,
        warnings=doubts,
    )


def _comparison(path: Path) -> SoundFile:
    from proofroll.files.comparison_file import load_comparison
    from proofroll.files.scene_file import load_scene
    from proofroll.running.engine_questions import lent_workers
    from proofroll.studies.comparison.planning import require_fit, row_facts

    comparison = load_comparison(str(path))
    with lent_workers(None) as workers:
        facts, _ = row_facts(
            comparison, list(enumerate(comparison.rows)), load_scene(comparison.scene).requires, workers
        )
        require_fit(comparison, facts, workers)
    counts = {
        "points": len(comparison.combinations()),
        "rows": len(comparison.rows),
        "tolerances": len(comparison.bands),
    }
    return SoundFile(kind="comparison", name=path.stem, path=str(path), scene=comparison.scene, counts=counts)


def _study(path: Path, study: str) -> SoundFile:
    readers = {point.name: point for point in announced(READERS)}
    require_known(f"{path.name}: study", study, readers, "no study of this name is installed; choose from")
    content = readers[study].load()(str(path))
    parts = (
        {"entries": content}
        if isinstance(content, list)
        else vars(content)
        if dataclasses.is_dataclass(content)
        else {}
    )
    counts = {
        f"[{key}]" if isinstance(value, Mapping) else f"[[{key}]]": len(value)
        for key, value in parts.items()
        if isinstance(value, (list, tuple, Mapping)) and value
    }
    return SoundFile(kind=study, name=path.stem, path=str(path), scene=getattr(content, "scene", ""), counts=counts)
