"""Command `check`; checks of scenes and studies are in the harness."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from proofroll.cli import options
from proofroll.cli.checking import check_text, is_text_check
from proofroll.core.errors import InputError
from proofroll.core.limits import TIME_LIMIT
from proofroll.vocabulary.command import show_keys


def check(
    context: typer.Context,
    file: Annotated[
        str | None, typer.Argument(help="A robot file (URDF, MJCF), a scene, or a comparison or other study.")
    ] = None,
    engine: options.Engines = None,
    base: Annotated[str, typer.Option(help="What carries the root of a URDF: fixed or free.")] = "fixed",
    _root: options.Root = None,
    states: Annotated[int, typer.Option(min=1, max=1000, help="Random states that are compared.")] = 20,
    seed: Annotated[int, typer.Option(min=0, help="Of the random states.")] = 0,
    out: Annotated[Path | None, typer.Option("--out", help="Write check.html and check.json to this folder.")] = None,
    time_limit: Annotated[float, typer.Option(min=0.1, help="Wall seconds for each engine.")] = TIME_LIMIT,
    against: Annotated[Path | None, typer.Option(help="Another file of the robot, instead of engines.")] = None,
    names: Annotated[
        list[str] | None,
        typer.Option("--map", help="With --against: joint=joint where names differ, or a TOML file of pairs; repeat."),
    ] = None,
    accept: Annotated[
        list[str] | None,
        typer.Option(help="Accepted causes of differences: damping_left_out,friction_left_out; or repeat."),
    ] = None,
    control: options.Control = None,
    ground: options.Ground = None,
    settings: options.Set = None,
    plot: Annotated[Path | None, typer.Option(help="Draw a scene at its start to this page (.html).")] = None,
    keys: Annotated[
        bool, typer.Option("--keys", help="Print the keys of scenes and studies instead; FILE: a key, table or word.")
    ] = False,
    as_json: options.Json = False,
) -> None:
    """Check a scene, study or robot file before it is run. Robot files are checked in every engine's own importer.

    For a scene, or a robot file with --control, it prints the start, with the normal force or the degrees of freedom;
    --plot draws it.
    For a robot file: exit 1 if an engine (or the file of --against) does not hold the model that the file describes, or
    if the file is physically impossible. The other options are for these.
    """
    if keys:
        options.require_only(
            context, {"file", "keys", "as_json"}, "this is for files; --keys prints what they may hold"
        )
        show_keys(file or "", as_json)
        return
    if file is None:
        raise InputError("FILE", None, "name a scene, a study or a robot file, or give --keys")
    settings = options.with_ground(settings, control, ground)
    path = Path(file)  # which forgets that ./NAME is a path
    if control is not None or is_text_check(path):
        options.require_only(
            context,
            {"file", "plot", "settings", "as_json", "control", "ground", "_root"},
            "this is for robot files; nothing is run to check a scene or a study",
            {"engine": ", and `proofroll compare SCENE --engine NAME` says what an engine makes of one"},
        )
        name = options.own_first(file) if control is None else options.controlled(file, control)
        check_text(name, as_json, plot, settings)
        return
    if settings:
        advice = "this is for scenes; `proofroll run FILE --engine truth --set …` runs the scene of a robot file"
        raise InputError("--set", ", ".join(settings), advice)
    if plot is not None:
        raise InputError("--plot", plot, "this is for scenes; --out FOLDER writes a page about a robot file")
    from proofroll.robots.check.check import check as checked
    from proofroll.robots.check.terminal import WIDTH, check_parts
    from proofroll.robots.files.meaning import CheckSettings

    how = CheckSettings(base=base, states=states, seed=seed, time_limit=time_limit)
    if against is None:
        if names:
            raise InputError("--map", ", ".join(names), "this is for two files; name the other by --against FILE")
        with options.progress_bar("engines") as advance:
            accepted = [name.strip() for name in ",".join(accept or ()).split(",") if name.strip()]
            content = checked(path, engine or (), how, accept=accepted, progress=advance)
    else:
        from proofroll.robots.check.two_files import against as compared

        if engine:
            raise InputError("--engine", ", ".join(engine), "--against compares two files and asks no engine; drop one")
        content = compared(path, against, _partners(names or ()), how)
    if out is not None:
        from proofroll.robots.check.page import page
        from proofroll.running.store import write_text

        write_text(out / "check.html", page(content))
        write_text(out / "check.json", options.json_text(content))
    options.show(content, as_json, lambda: check_parts(content), widest=WIDTH)
    if any(row.differs for row in content.engines) or any(remark.level == "error" for remark in content.lint):
        raise typer.Exit(options.CONTRADICTED)
    raise typer.Exit(options.OK if any(row.layers for row in content.engines) else options.ENGINE)


def _partners(texts: Sequence[str]) -> dict[str, str]:
    """Joint of the first file -> joint of the second, from ``joint=joint`` or files of such lines."""
    from proofroll.files.toml import read_toml

    files = [text for text in texts if "=" not in text]
    written = [text for text in texts if "=" in text]
    for name in files:
        for ours, theirs in read_toml(Path(name)).items():
            if not isinstance(theirs, str):
                raise InputError(f"{name}: {ours}", theirs, 'write the name of a joint in the second file, "..."')
            written.append(f"{ours}={theirs}")
    return options.assignments(written, "--map")
