"""Engines ``NAME@PLACE``, which run in a worker of another Python that has proofroll and the engine."""

import contextlib
import json
import os
import shutil
import subprocess
from pathlib import Path

from proofroll.core.errors import InputError, Missing, ProofrollError, choices
from proofroll.core.limits import HELLO_TIME_LIMIT
from proofroll.core.plugins import place_of, plain_name
from proofroll.running import environments
from proofroll.running.bound_program import printed_by
from proofroll.running.case import Status
from proofroll.running.identity import mismatch
from proofroll.running.process import Worker, WorkerDied, environment_of_another
from proofroll.running.program import PREFIX

# Program, valid in any Python 3, that asks a Python that did not answer as a worker for its version and proofroll's.
_PROBE = """
import sys, json
try:
    import proofroll
    found = proofroll.__version__
except Exception:
    found = None
print(json.dumps([list(sys.version_info[:3]), found]))
"""
_PROBE_SECONDS = 120.0
OLDEST = (3, 11)


def start(engine: str, memory: float | None = None) -> Worker:
    """Worker for an engine ``NAME``, in this interpreter, or ``NAME@PLACE``.

    Raises:
        InputError: there is no such place.
        Missing: there is no Python, or it does not have this proofroll.
        WorkerDied: the interpreter crashed or hung before an answer.
    """
    place = place_of(engine)
    if not place or place.startswith(PREFIX):  # a program is started by a worker of ours
        return Worker(memory)
    python = python_at(engine)
    worker = Worker(memory, python)
    try:
        answer = worker.request({"do": "hello", "place": place}, HELLO_TIME_LIMIT)
    except ProofrollError as error:
        worker.close()
        raise _explained(engine, python, error) from None
    except BaseException:
        worker.close()
        raise
    if wrong := mismatch(answer):
        worker.close()
        raise Missing(f"{engine}: {python} {wrong}; {_install(engine)}")
    return worker


def python_at(engine: str) -> Path:
    """Path of the Python for an engine ``NAME@PLACE``; the place is a path, the label of an environment, or a command.

    Raises:
        InputError: there is no such place.
        Missing: the environment's Python is gone.
    """
    name, place = plain_name(engine), place_of(engine)
    if os.sep in place or place.startswith(("~", ".")):
        # Links are not followed: the Python of a virtual environment is a link to another interpreter.
        path = Path(os.path.abspath(Path(place).expanduser()))
        if path.is_dir():
            path = path / "bin" / "python"
        if not path.exists():
            raise InputError("engine", engine, f"there is no {path}; give the path of a Python")
        if not path.is_file() or not os.access(path, os.X_OK):
            raise InputError("engine", engine, f"{path} is no program; give the path of a Python")
        return path
    remembered = environments.find(name, place)
    if remembered is not None:
        if not os.access(remembered.python, os.X_OK):
            again = f"proofroll engines remove {name}@{place}, and add it again"
            raise Missing(f"{engine}: its environment is gone ({remembered.python} is no program): {again}")
        return remembered.python
    command = shutil.which(place)
    if command is None:
        labels = choices(item.label for item in environments.remembered() if item.name == name)
        there_are = f"there are {labels}" if labels else "there is none of this engine"
        advice = f"no environment has this label ({there_are}); {_install(engine)}"
        raise InputError("engine", engine, advice)
    return Path(command)


def _install(engine: str) -> str:
    return f"proofroll engines add {plain_name(engine)} --requirement PACKAGE==VERSION makes one that has all"


def _explained(engine: str, python: Path, error: ProofrollError) -> ProofrollError:
    """Error that says why a worker did not identify itself, after probing its Python."""
    if isinstance(error, WorkerDied) and error.status == Status.TIMEOUT:
        return WorkerDied(error.status, f"{engine}: {python} did not answer within {HELLO_TIME_LIMIT:g} s")
    with contextlib.suppress(OSError, subprocess.SubprocessError, ValueError, TypeError, LookupError):
        code, told, _ = printed_by([python, "-c", _PROBE], environment_of_another(), _PROBE_SECONDS, os.sep)
        if code:
            raise OSError(code)
        version, has = json.loads(told.splitlines()[-1])
        written = ".".join(map(str, version))
        if tuple(version[:2]) < OLDEST:
            least = ".".join(map(str, OLDEST))
            return Missing(f"{engine}: {python} is Python {written}, and proofroll needs {least} or later")
        if has is None:
            return Missing(f"{engine}: {python} (Python {written}) has no proofroll; {_install(engine)}")
        return Missing(f"{engine}: proofroll {has} of {python} did not answer as a worker of this one: {error}")
    return WorkerDied(Status.CRASHED, f"{engine}: {python} did not answer as a Python with proofroll: {error}")
