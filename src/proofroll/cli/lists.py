"""Command ``scenes``: lists the scenes."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated

import typer

from proofroll.cli import options

if TYPE_CHECKING:
    from rich.table import Table

    from proofroll.files.scene_file import SceneFile


def scenes(
    name: Annotated[
        str | None,
        typer.Argument(
            help="Scene of which all parameters are listed.",
            autocompletion=options.scenes_like,
            callback=options.own_first,
        ),
    ] = None,
    as_json: options.Json = False,
) -> None:
    """List the scenes, or the parameters of one scene."""
    from proofroll.files.scene_file import read_scene_file, scene_names, scene_titles

    if name is None and not as_json:
        options.show(None, as_json, lambda: _titles(scene_titles()))
        return
    files = {scene: read_scene_file(scene) for scene in (scene_names() if name is None else [name])}
    content = [
        {"name": name, "title": file.title, "source": file.source, "parameters": file.parameters}
        for name, file in files.items()
    ]
    options.show(content, as_json, lambda: _tables(files))


_LINE = 80  # characters


def _titles(titles: Mapping[str, str]) -> Iterator[str]:
    """Lines of name and title for each scene; a title that is too long is cut at a comma or colon."""
    wide = max(map(len, titles))
    for name, title in titles.items():
        line = f"{name:{wide}}  {title}"
        yield line if len(line) <= _LINE else re.split("[,:]", line)[0]
    yield "proofroll scenes NAME lists the parameters of one."


def _tables(files: Mapping[str, SceneFile]) -> Iterator[Table | str]:
    from rich.table import Table

    for name, file in files.items():
        columns = ("parameter", "symbol", "default", "unit", "meaning")
        table = Table(*columns, title=f"{name}: {file.title}", title_justify="left", box=None, pad_edge=False)
        for key, item in file.parameters.items():
            value = item.value if isinstance(item.value, str) else f"{item.value:g}"
            table.add_row(key, item.symbol, value, item.unit, item.meaning)
        yield from (table, "")
