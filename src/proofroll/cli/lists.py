"""What there is: scenes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from proofroll.cli import options

if TYPE_CHECKING:
    from rich.table import Table

    from proofroll.files.scene_file import SceneFile


def scenes(as_json: options.Json = False) -> None:
    """List the scenes and the parameters that can be set."""
    from proofroll.files.scene_file import read_scene_file, scene_names

    files = {name: read_scene_file(name) for name in scene_names()}
    content = [
        {"name": name, "title": file.title, "source": file.source, "parameters": file.parameters}
        for name, file in files.items()
    ]
    options.show(content, as_json, lambda: _tables(files))


def _tables(files: Mapping[str, SceneFile]) -> Iterator[Table | str]:
    from rich.table import Table

    for name, file in files.items():
        table = Table(title=f"{name}: {file.title}", title_justify="left", box=None, pad_edge=False)
        for column in ("parameter", "symbol", "default", "unit", "meaning"):
            table.add_column(column)
        for key, item in file.parameters.items():
            value = item.value if isinstance(item.value, str) else f"{item.value:g}"
            table.add_row(key, item.symbol, value, item.unit, item.meaning)
        yield from (table, "")
