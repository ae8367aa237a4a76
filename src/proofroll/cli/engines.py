"""Commands ``engines``: lists engines, and makes and removes environments of other versions."""

import dataclasses
import string
import sys
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Annotated, Any

import typer

from proofroll.cli import options
from proofroll.core.errors import Missing, ProofrollError

engines = typer.Typer(help="List engines, and make environments of other versions.", rich_markup_mode=None)


@engines.callback(invoke_without_command=True)
def listed(
    context: typer.Context,
    capabilities: Annotated[
        bool, typer.Option("--capabilities", help="Start each engine, and show what its formulations provide.")
    ] = False,
    as_json: options.Json = False,
) -> None:
    """List the engines with the versions of their packages.

    Environments made by ``add`` are among them, as ``NAME@LABEL``; any command that takes ``--engine`` takes these.
    ``--capabilities`` and ``--json`` start each engine, and say why one does not start.
    """
    if context.invoked_subcommand is not None:
        return
    from proofroll.core.plugins import engine_names, installed_package
    from proofroll.running.environments import remembered, root

    others = {f"{item.name}@{item.label}": f"in Python {item.interpreter} of its own" for item in remembered()}
    if not capabilities and not as_json:
        packages = {name: installed_package(name) for name in engine_names()}
        rows = [(name, version or "not installed", package) for name, (package, version) in packages.items()]
        rows += [(f"{item.name}@{item.label}", item.version, str(item.folder)) for item in remembered()]
        name_width, version_width = (max(len(row[column]) for row in rows) for column in (0, 1))
        for name, version, package in rows:
            sys.stdout.write(f"{name:{name_width}}  {version:{version_width}}  {package}\n")
        sys.stdout.write("proofroll engines --capabilities starts each, and shows what it can represent.\n")
        return
    with options.spinner("engines"), ThreadPoolExecutor() as pool:
        described = list(pool.map(_described, [*engine_names(), *others]))
    if as_json:
        options.write_json(described)
        return
    from rich.table import Table

    from proofroll.report.terminal.screen import console

    installed = Table("engine", "version", "formulations (presets)", box=None, pad_edge=False)
    for item in described:
        name = item["name"]
        if item["status"] != "installed":
            installed.add_row(name, item["status"], item["message"].removeprefix(f"{name}: "))
        elif name in others:
            installed.add_row(name, item["version"], others[name])
        else:
            letters = _letters(item["presets"])
            formulations = "\n".join(
                f"{letters[key]} {key} ({', '.join(presets)})" for key, presets in item["presets"].items()
            )
            installed.add_row(name, item["version"].replace(", ", "\n"), formulations)
    console().print(installed)
    provided = [item for item in described if item["status"] == "installed" and item["name"] not in others]
    if provided:
        console().print(_capabilities(provided))
        sys.stdout.write("A scene runs in a formulation that has all that proofroll check says it requires.\n")
    if others:
        sys.stdout.write(f"Engines with @ are folders NAME/LABEL of {root()}\n")


@engines.command()
def add(
    name: Annotated[
        str, typer.Argument(help="Name of the engine, e.g. mujoco, or rapier, whose package examples/engines has.")
    ],
    requirement: Annotated[
        list[str] | None, typer.Option(help="What is installed, as pip reads it, e.g. mujoco==3.8.1.")
    ] = None,
    label: Annotated[str, typer.Option(help="Remember it as NAME@LABEL; by default the version that is pinned.")] = "",
    python: Annotated[str, typer.Option(help="Its Python, e.g. python3.12; by default the one that runs this.")] = "",
) -> None:
    """Make an environment with an engine of another version and this proofroll, and remember it.

    It is kept below PROOFROLL_ENGINES, by default XDG_DATA_HOME/proofroll/engines. Without --requirement, the package
    of an engine in examples/engines of a checkout is installed into this Python.
    """
    from proofroll.core.plugins import engine_names
    from proofroll.running.make_environment import add as made
    from proofroll.running.make_environment import example_packages, install

    if not requirement and name.isidentifier() and name not in engine_names():
        with options.spinner(f"{name}: installing its package"):
            version, folder = install(name, example_packages())
        sys.stdout.write(f"{name}: version {version}, installed from {folder}\n")
        return
    with options.spinner(f"{name}: making an environment") as say:
        added = made(name, requirement or (), label, python, lambda text: say(f"{name}: {text}"))
    sys.stdout.write(f"{name}@{added.label}: {name} {added.version}, Python {added.interpreter}, in {added.folder}\n")


@engines.command()
def remove(
    environment: Annotated[list[str], typer.Argument(help="NAME@LABEL of an environment; several may be given.")],
) -> None:
    """Forget environments and delete their folders."""
    from proofroll.running.environments import remove as removed

    for item in environment:
        removed(item)
        sys.stdout.write(f"{item} is removed\n")


def _letters(formulations: Iterable[str]) -> dict[str, str]:
    """Formulation of an engine -> the letter that stands for it."""
    return dict(zip(formulations, string.ascii_lowercase, strict=False))


def _capabilities(engines: Sequence[Mapping[str, Any]]) -> Any:
    """Matrix of capabilities and engines, whose cells have the letters of the formulations that provide each."""
    from rich.table import Column, Table

    table = Table(Column("capability", overflow="fold"), *(item["name"] for item in engines), box=None, pad_edge=False)
    for capability in sorted({name for item in engines for names in item["provides"].values() for name in names}):
        cells = []
        for item in engines:
            letters = _letters(item["presets"])
            cells.append("".join(letters[key] for key in letters if capability in item["provides"].get(key, ())))
        table.add_row(capability, *cells)
    return table


def _described(name: str) -> dict[str, Any]:
    from proofroll.running.engine_questions import describe

    try:
        return {"status": "installed", **dataclasses.asdict(describe(name))}
    except Missing as error:
        return {"name": name, "status": "missing", "message": str(error)}
    except ProofrollError as error:
        return {"name": name, "status": "broken", "message": str(error)}
