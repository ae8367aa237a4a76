"""What there is: scenes and engines."""

from __future__ import annotations

from typing import Any

from proofroll.cli.options import Json, write_json
from proofroll.core.errors import Missing, ProofrollError


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


def engines(as_json: Json = False) -> None:
    """List the engines: what is installed, what each provides, and why one is missing."""
    from concurrent.futures import ThreadPoolExecutor

    from proofroll.core.plugins import engine_names

    with ThreadPoolExecutor() as pool:
        found = list(pool.map(_described, engine_names()))
    if as_json:
        write_json(found)
        return
    from rich.table import Table

    from proofroll.report.terminal import console

    table = Table(box=None, pad_edge=False)
    for column in ("engine", "version", "formulations (settings)", "provides"):
        table.add_column(column)
    for item in found:
        if item["status"] != "installed":
            table.add_row(item["name"], item["status"], item["message"], "")
            continue
        formulations = "\n".join(f"{name} ({', '.join(presets)})" for name, presets in item["presets"].items())
        table.add_row(
            item["name"], item["version"], formulations, "\n".join(sorted(set().union(*item["provides"].values())))
        )
    console().print(table)


def _described(name: str) -> dict[str, Any]:
    from proofroll.running.runner import describe

    try:
        return {"status": "installed", **describe(name)}
    except Missing as error:
        return {"name": name, "status": "missing", "message": str(error)}
    except ProofrollError as error:
        return {"name": name, "status": "broken", "message": str(error)}
