"""The process in which engines run: one request a line on standard input, one answer a line on a private pipe.

``python -m proofroll.worker FD PARENT`` serves requests until its input ends. What an engine prints cannot reach the
answers, and what an engine breaks costs only this process.
"""

from __future__ import annotations

import gc
import json
import os
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

from proofroll.case import Case
from proofroll.case_run import run
from proofroll.clean_runs import time_once
from proofroll.errors import Diverged, InputError, Missing, ProofrollError, Refused
from proofroll.identity import describe, resolve
from proofroll.memory import volunteer


def main(answers: int, parent: int) -> None:
    """Serves requests; ``answers`` is the file descriptor for the answers, ``parent`` the process that asks."""
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    volunteer()
    requests = os.fdopen(os.dup(0), encoding="utf-8")
    with open(os.devnull, "rb") as nothing:
        os.dup2(nothing.fileno(), 0)  # an engine that asks its user something must not read the next request
    with os.fdopen(answers, "w", encoding="utf-8") as pipe, requests:
        for line in requests:
            request = json.loads(line)
            number = request.pop("number")
            pipe.write(json.dumps({**_answer(request), "number": number}) + "\n")
            pipe.flush()


def _end_with(parent: int) -> None:
    """Ends this process when its parent is gone, even in the middle of a case."""
    while os.getppid() == parent:
        time.sleep(0.5)
    os._exit(1)


def _answer(request: dict[str, Any]) -> dict[str, Any]:
    actions: dict[str, Callable[..., dict[str, Any]]] = {
        "describe": describe,
        "resolve": resolve,
        "run": run,
        "time": time_once,
        "reproduce": reproduce,
        "bench": bench,
        "robot": robot,
    }
    action = actions[request.pop("do")]
    try:
        return action(**request)
    except InputError as error:
        value = error.value if isinstance(error.value, (bool, int, float, str)) else str(error.value)
        return {"error": "input", "field": error.field, "value": value, "advice": error.advice}
    except Missing as error:
        return {"error": "missing", "message": str(error)}
    except ProofrollError as error:  # a full disk, say
        return {"error": "crashed", "message": str(error)}
    except Exception as error:
        return {"error": "crashed", "message": one_line(error)}


def reproduce(case: dict[str, Any]) -> dict[str, Any]:
    """The engine's own program for a case, or why there is none."""
    from proofroll.engine import Reproduces
    from proofroll.registry import load_engine, resolve_settings
    from proofroll.scene_file import load_scene

    wanted = Case.from_dict(case)
    kind = load_engine(wanted.engine.name)
    if not isinstance(kind, Reproduces):
        return {
            "program": None,
            "message": f"{wanted.engine.name} offers no program of its own",
        }
    try:
        settings = resolve_settings(kind, wanted.engine.settings)
        program = kind.reproducer(load_scene(wanted.scene, **wanted.parameters), settings)
    except Refused as error:
        return {"program": None, "message": str(error)}
    return {"program": program, "message": ""}


def bench(**what: Any) -> dict[str, Any]:
    """An adapter against a bare loop; see :func:`proofroll.bench.adapters.measure_adapter`."""
    from proofroll.bench.adapters import measure_adapter

    gc.freeze()  # modules need not be looked at again in every collection
    try:
        return measure_adapter(**what)
    except (Refused, Diverged) as error:
        return {"message": str(error)}


def robot(step: str, **what: Any) -> dict[str, Any]:
    """A robot file in an engine's own importer; see :mod:`proofroll.robots.reading`."""
    from proofroll.robots import reading

    return reading.STEPS[step](**what)


def one_line(error: BaseException) -> str:
    """Kind and text of an exception in one line."""
    text = " ".join(str(error).split())
    return f"{type(error).__name__}: {text}"[:400] if text else type(error).__name__


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
