"""Common parts of programs that show a failure of an engine, for all kinds of elements and engines."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class FailedRun:
    """A run just beyond a boundary of a stability map, whose failure a program is to show.

    Attributes:
        scene, parameters, engine, version, settings, resolution, until, every: the case.
        where: the point of the map, for a person.
        boundary: ``stable`` or ``accurate``.
        failure: name of the sign of failure.
        silent: True if the engine does not report the failure.
        truth: the true run, or None.
        scale, allowed: range of the deciding observable, and the part of it that its error may be.
        note: reason for which the program imports proofroll; empty: it does not.
    """

    scene: str
    parameters: Mapping[str, float]
    engine: str
    version: str
    settings: Mapping[str, Any]
    resolution: str
    until: float
    every: float
    where: str
    boundary: str
    failure: str
    silent: bool
    truth: xr.Dataset | None
    scale: float
    allowed: float
    note: str


_MAIN = '''

def main():
    """Runs the model, prints what is wrong and returns 1 if the failure shows, else 0."""
    times, rows, stopped = [EVERY * number for number in range(SAMPLES + 1)], [], ""
    try:
        for row in run(times):
            if not all(np.all(np.isfinite(part)) for part in row):
                stopped = f"the state is not finite at {times[len(rows)]:g} s, and the engine did not say so"
                break
            rows.append([np.array(part) for part in row])
    except RuntimeError as error:
        stopped = f"the engine stopped: {error}"
    print(f"{len(rows)} of {len(times)} samples, step {STEP:g}")
    shown = dict.fromkeys(("diverged", "solver gave up", "crashed"), bool(stopped))
    shown |= signs(bool(stopped), *(np.array(column) for column in zip(*rows)))
    if stopped:
        print(stopped)
    print(f"{FAILURE}: {'shown' if shown[FAILURE] else 'not shown'}")
    return 1 if shown[FAILURE] else 0


if __name__ == "__main__":
    sys.exit(main())
'''

_ASKING = """SCENE = load_scene({scene!r}, **{parameters!r})


def run(times):
    \"\"\"What is held against the truth at each time, from a run by proofroll.\"\"\"
    found = simulate(SCENE, {engine!r}, until=times[-1], every=times[1], **{settings!r})
    yield from zip(*(found[name].to_numpy() for name in {names!r}))
    if found.attrs["status"] != "done":
        raise RuntimeError(found.attrs["message"])
"""


def assignment(**values: Any) -> str:
    """Lines ``NAME = value``, of plain data or numpy numbers and arrays, with all digits."""
    plain = {name: value.tolist() if hasattr(value, "tolist") else value for name, value in values.items()}
    return "".join(f"{name} = {value!r}\n" for name, value in plain.items())


def imported_packages(head: str) -> list[str]:
    """Packages named by import lines, except Python's standard library."""
    lines = [line.split() for line in head.splitlines() if line.startswith(("import ", "from "))]
    names = dict.fromkeys(words[1].partition(".")[0] for words in lines)
    return [name for name in names if name not in sys.stdlib_module_names]


def asking(failed: FailedRun, *names: str) -> str:
    """Source of ``SCENE`` and ``run(times)``, which yields these variables of a run by proofroll."""
    parameters, settings = dict(failed.parameters), dict(failed.settings)
    return _ASKING.format(
        scene=failed.scene, parameters=parameters, engine=failed.engine, settings=settings, names=names
    )


def program(failed: FailedRun, what: str, part: str, numbers: Mapping[str, Any], signs: str) -> str:
    """Text of the whole program.

    Args:
        failed: the failed run that it shows.
        what: sentence about what moves, without its end.
        part: part of the engine: imports, and ``run(times)``, which yields the arguments of ``signs`` at each time.
        numbers: constants that ``signs`` uses.
        signs: source of the function ``signs(stopped, …)`` of arrays over the samples; it prints numbers and returns
            name of a failure -> True if it shows.
    """
    head, _, rest = part.partition("\n\n")
    definitions = {
        "EVERY": failed.every,
        "STEP": float(failed.settings[failed.resolution]),
        "SAMPLES": round(failed.until / failed.every),
        "FAILURE": failed.failure,
        "RANGE": failed.scale,
        "ALLOWED": failed.allowed,
    }
    against = "# What the run is held against; TRUE is what two independent routes say.\n"
    lines = "\n".join(_docstring_lines(failed, what, imported_packages(head)))
    return (
        f'"""{lines}\n"""\n\n{head}\nimport sys\n\n{rest}\n{against}'
        + assignment(**definitions, **numbers)
        + signs
        + _MAIN
    )


def _docstring_lines(failed: FailedRun, what: str, needs: list[str]) -> list[str]:
    """Lines of the program's docstring: the failure, the case, and the packages that it needs."""
    numbers = ", ".join(f"{name} = {value:g}" for name, value in failed.parameters.items()) or "default parameters"
    settings = ", ".join(f"{key}={value}" for key, value in failed.settings.items())
    return [
        f"{failed.engine} {failed.version}: {failed.failure} ({failed.where}).",
        "",
        f"{what} ({failed.scene}, {numbers}).",
        f"Beyond the largest {failed.resolution} that is {failed.boundary}. "
        + ("The engine does not say so." if failed.silent else "The engine says so."),
        f"Settings: {settings}.",
        *([f"Why proofroll: {failed.note}."] if failed.note else []),
        f"Needs {' and '.join(needs)} alone. Exit code 1: the failure shows.",
    ]
