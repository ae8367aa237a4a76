"""Command ``versions``: one engine in two versions."""

from __future__ import annotations

import contextlib
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from proofroll.cli import options
from proofroll.core.entry_points import announced
from proofroll.core.errors import InputError, ProofrollError

if TYPE_CHECKING:
    from proofroll.studies.versions.versions import VersionsStudy

# Group of entry points for other subjects than scenes and comparisons; the name is the ending of their files.
SUBJECTS = "proofroll.version_subjects"
# Default rounds of timing: with twelve, estimates varied by 5 %; with twenty the interval is some 4 % wide.
_ROUNDS = 20


def versions(
    engine: Annotated[str, typer.Argument(help="Name of the engine, e.g. mujoco.")],
    old: Annotated[str, typer.Argument(help="A version, a label of `proofroll engines`, or the path of a Python.")],
    new: Annotated[str, typer.Argument(help="The version to which it is compared, likewise.")] = "",
    subject: Annotated[
        str,
        typer.Argument(
            help="A comparison, a scene or a robot file; by default all comparisons.", callback=options.own_first
        ),
    ] = "",
    rounds: Annotated[int, typer.Option(min=0, help="Rounds of timing; 0: no speed.")] = _ROUNDS,
    out: options.Out = Path("out"),
    fresh: options.Fresh = False,
    jobs: options.Jobs = None,
    scheduler: options.Scheduler = None,
    as_json: options.Json = False,
) -> None:
    """Run the same cases in two versions of an engine and show what changed; exit 1 if a verdict did.

    Environments that are missing are made, as by `proofroll engines add`; workers of a cluster need their own. Speed is
    measured here, and never decides the exit code.
    """
    from proofroll.report.versions import heading, lines, page, robot_table, table

    engine, old, new, subject = _spelled(engine, old, new, subject)
    readers = {point.name: point for point in announced(SUBJECTS)}
    robot = readers.get(Path(subject).suffix.removeprefix("."))
    if robot is not None and scheduler is not None:
        raise InputError("--scheduler", scheduler, "a robot file is checked here; leave the option out")
    if robot is None:
        from proofroll.studies.versions.versions import comparisons_about

        comparisons = comparisons_about(subject, engine)  # before minutes are spent on environments
    options.require_pages()
    sides = _side(engine, old), _side(engine, new)
    if sides[0] == sides[1]:
        raise InputError("new", new, f"both are {sides[0]}; name two versions")
    if robot is not None:
        with options.spinner(f"{engine} {old} and {new}"):
            content: VersionsStudy = robot.load()(subject, *sides)
    else:
        from proofroll.studies.versions.versions import compare_versions

        runner = options.new_runner(out, fresh, jobs, scheduler)
        with options.progress_bar("cases") as advance:
            content = compare_versions(sides, comparisons, runner, rounds, advance)
    file = _keep(content, page(content), out)
    made = table if robot is None else robot_table
    place = f"The page is in {file}.html."
    options.show(content, as_json, lambda: [heading(content), made(content), *lines(content), place], widest=80)
    if content.lost:
        raise typer.Exit(options.ENGINE)
    raise typer.Exit(options.CONTRADICTED if content.changed else options.OK)


def _spelled(engine: str, old: str, new: str, subject: str) -> tuple[str, str, str, str]:
    """Engine, two versions and subject; also from arguments in the form NAME@OLD NAME@NEW SUBJECT."""
    from proofroll.core.plugins import place_of, plain_name

    name = plain_name(engine)
    if place_of(engine):
        if subject:
            raise InputError(
                "engine", engine, f"the version stands behind it: {name} {place_of(engine)} {new} {subject}"
            )
        old, new, subject = place_of(engine), old, new
    if not new:
        raise InputError("new", None, f"name two versions: proofroll versions {name} {old} VERSION")
    old, new = (place_of(text) if plain_name(text) == name and "@" in text else text for text in (old, new))
    return name, old, new, subject


def _keep(content: VersionsStudy, page: str, out: Path) -> Path:
    """Writes page and JSON document; returns their path without ending."""
    from proofroll.running.store import write_text

    out.mkdir(parents=True, exist_ok=True)
    words = ["versions", content.engine, content.old.version, content.new.version]
    file = out / re.sub(r"[^\w.+-]", "_", "-".join(map(str, words)))
    write_text(file.with_name(f"{file.name}.html"), page)
    write_text(file.with_name(f"{file.name}.json"), options.json_text(content))
    return file


def _side(engine: str, text: str) -> str:
    """Engine ``NAME`` or ``NAME@PLACE`` for a version, a label or a path; its environment is made if necessary."""
    from proofroll.core.plugins import engine_names
    from proofroll.running import environments
    from proofroll.running.engine_questions import describe

    if text == engine:
        return engine  # the installed one
    if os.sep in text or text.startswith(("~", ".")) or environments.find(engine, text) is not None:
        return f"{engine}@{text}"
    if not re.fullmatch(r"\d[\w.+]*", text):
        raise InputError("version", text, f"no environment of {engine} has this label; see proofroll engines")
    if engine in engine_names():
        with contextlib.suppress(ProofrollError):  # it is not installed here
            if f"{describe(engine).version}.".startswith(f"{text}."):  # 1.13 means 1.13.6 if that is installed
                return engine
    return _made(engine, text)


def _made(engine: str, version: str) -> str:
    """Makes the environment of a version; returns its engine ``NAME@VERSION``."""
    from proofroll.running.make_environment import add, package_of

    package = package_of(engine)
    by_hand = f"proofroll engines add {engine} --requirement {package or 'PACKAGE'}=={version}"
    if not package:
        raise InputError("engine", engine, f"no environment of {version} is remembered; {by_hand}")
    options.complain(f"no environment of {engine} {version} is remembered: making one, as {by_hand} does")
    try:
        with options.spinner(f"{engine} {version}") as say:
            add(engine, [f"{package}=={version}"], tell=lambda text: say(f"{engine} {version}: {text}"))
    except InputError:  # a wrong argument, which is wrong by hand, too
        raise
    except ProofrollError as error:
        raise ProofrollError(f"{error}; when that is mended, or with more requirements: {by_hand}") from None
    return f"{engine}@{version}"
