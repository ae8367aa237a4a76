"""Differences of two versions of an engine, for ``diff``; their environments are made."""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from proofroll.cli import options
from proofroll.core.errors import InputError, ProofrollError

if TYPE_CHECKING:
    from proofroll.studies.versions.versions import VersionsStudy


def versions(
    old: str,
    new: str,
    subjects: Sequence[str],
    *,
    rounds: int,
    out: Path,
    fresh: bool,
    jobs: int | None,
    scheduler: str | None,
) -> tuple[VersionsStudy, list[Any]]:
    """Runs the same cases in two versions of an engine; returns the differences, as records and for a terminal.

    The parameters are those of ``diff``. Page and JSON document are written to ``out``; a missing environment is made.

    Raises:
        InputError: a name is unknown, the engines are two, or both versions are one.
    """
    from proofroll.core.plugins import place_of, plain_name
    from proofroll.report.versions import heading, lines, page, table
    from proofroll.studies.versions.versions import compare_versions, comparisons_about

    engine = plain_name(old)
    if engine != plain_name(new):
        raise InputError("new", new, f"is no version of {engine}; name two of one engine, as {engine}@VERSION")
    comparisons = comparisons_about(subjects, engine)  # before minutes are spent on environments
    options.require_pages()
    sides = _side(engine, place_of(old) or engine), _side(engine, place_of(new) or engine)
    if sides[0] == sides[1]:
        raise InputError("new", new, f"both are {sides[0]}; name two versions")
    runner = options.new_runner(out, fresh, jobs, scheduler)
    with options.progress_bar("cases") as advance:
        content = compare_versions(sides, comparisons, runner, rounds, advance)
    file = _keep(content, page(content), out)
    return content, [heading(content), table(content), *lines(content), f"The page is in {file}.html."]


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
    from proofroll.core.plugins import package_of
    from proofroll.running.make_environment import add

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
