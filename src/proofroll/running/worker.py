"""The process in which engines run: one request a line on standard input, one answer a line on a private pipe.

``python -m proofroll.running.worker FD PARENT LIFE`` serves requests until its input ends. What an engine prints cannot
reach the answers, and what an engine breaks costs only this process.
"""

import gc
import json
import os
import pkgutil
import signal
import sys
from collections.abc import Callable
from typing import Any

from proofroll.core.errors import Diverged, InputError, Missing, ProofrollError, Refused, raised_at, require_known
from proofroll.running.case import Case
from proofroll.running.ending import end_with, end_with_pipe
from proofroll.running.handshake import identify_and_settle
from proofroll.running.identity import describe, resolve
from proofroll.running.integrity import watch
from proofroll.running.memory import volunteer
from proofroll.running.run_case import run
from proofroll.running.time_case import time_once


def main(answers: int, parent: int, life: int) -> None:
    """Serves requests; ``answers`` is the pipe for the answers, ``life`` one that ``parent``, who asks, holds open."""
    end_with(parent)
    end_with_pipe(life)
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # an engine that catches it would take it for its own failure
    volunteer()
    gc.disable()  # until the engine is loaded: modules leave nothing to collect, and to look costs a tenth of the start
    watch()
    requests = os.fdopen(os.dup(0), encoding="utf-8")
    with open(os.devnull, "rb") as nothing:
        os.dup2(nothing.fileno(), 0)  # an engine that asks its user something must not read the next request
    with os.fdopen(answers, "w", encoding="utf-8") as pipe, requests:
        for line in requests:
            request = json.loads(line)
            number = request.pop("number")
            answer = _answer(request)
            used = sum(os.times()[:4])  # of the processor, with that of processes that it waited for
            pipe.write(json.dumps({**answer, "number": number, "used": used}) + "\n")
            pipe.flush()


def _answer(request: dict[str, Any]) -> dict[str, Any]:
    actions: dict[str, Callable[..., dict[str, Any]]] = {
        "hello": identify_and_settle,
        "describe": describe,
        "resolve": resolve,
        "run": run,
        "time": time_once,
        "write": write,
        "call": call,
    }
    name = request.pop("do")
    try:
        require_known("do", name, actions, "this worker knows")
        return actions[name](**request)
    except InputError as error:
        value = error.value if isinstance(error.value, (bool, int, float, str)) else str(error.value)
        return {"error": "input", "field": error.field, "value": value, "advice": error.advice}
    except Missing as error:
        return {"error": "missing", "message": str(error)}
    except ProofrollError as error:  # a full disk, say
        return {"error": "crashed", "message": str(error)}
    except Exception as error:
        return {"error": "crashed", "message": one_line(error)}
    finally:
        gc.enable()


def write(case: dict[str, Any], what: str) -> dict[str, Any]:
    """The text that an engine writes of a case, its ``reproducer`` or ``model_file``; or why it writes none."""
    from proofroll.core.engine_abilities import Reproduces, WritesModels
    from proofroll.running.loading import loaded, scene_of

    wanted = Case.from_dict(case)
    kind, settings = loaded(wanted)
    ability, lacking = {
        "reproducer": (Reproduces, f"{wanted.engine.name} offers no program of its own"),
        "model_file": (WritesModels, "it writes no file of its model"),
    }[what]
    if not isinstance(kind, ability):
        return {"message": lacking}
    try:
        return {"text": getattr(kind, what)(scene_of(wanted), settings)}
    except (Refused, Diverged) as error:
        return {"message": str(error)}


def call(function: str, arguments: dict[str, Any]) -> dict[str, Any]:
    """A function of another package in this process, ``module:name``, e.g. one that measures an engine."""
    gc.freeze()  # modules need not be looked at again in every collection
    try:
        answer: dict[str, Any] | None = pkgutil.resolve_name(function)(**arguments)
    except (Refused, Diverged) as error:
        return {"message": str(error)}
    return answer or {}


def one_line(error: BaseException) -> str:
    """Kind and text of an exception in one line, and where in the engine's adapter it arose."""
    text, where = " ".join(str(error).split()), raised_at(error)
    said = f"{type(error).__name__}: {text}"[:400] if text else type(error).__name__
    return f"{said} ({where})" if where else said


if __name__ == "__main__":
    main(*map(int, sys.argv[1:4]))
