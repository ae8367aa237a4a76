"""What there is: scenes."""

from __future__ import annotations

from proofroll.cli.options import Json, write_json


def scenes(as_json: Json = False) -> None:
    """List the scenes and the parameters that can be set."""
    from proofroll.files.scene_file import read_scene_file, scene_names

    files = {name: read_scene_file(name) for name in scene_names()}
    if as_json:
        import dataclasses

        write_json(
            [
                {
                    "name": name,
                    "title": file.title,
                    "source": file.source,
                    "parameters": {key: dataclasses.asdict(item) for key, item in file.parameters.items()},
                }
                for name, file in files.items()
            ]
        )
        return
    from rich.table import Table

    from proofroll.report.terminal import console

    out = console()
    for name, file in files.items():
        table = Table(title=f"{name}: {file.title}", title_justify="left", box=None, pad_edge=False)
        for column in ("parameter", "symbol", "default", "unit", "meaning"):
            table.add_column(column)
        for key, item in file.parameters.items():
            value = item.value if isinstance(item.value, str) else f"{item.value:g}"
            table.add_row(key, item.symbol, value, item.unit, item.meaning)
        out.print(table)
        out.print()
