"""Process in which engines run: it reads one request a line from standard input, and answers through a private pipe.

``python -m proofroll.running.worker FD PARENT LIFE`` serves requests until its input ends. Text that an engine prints
cannot get into the answers, and a crash of an engine ends only this process.
"""

import gc
import json
import os
import pkgutil
import signal
import sys
from collections.abc import Callable
from typing import Any

from proofroll.core.errors import (
    Diverged,
    InputError,
    Missing,
    ProofrollError,
    Refused,
    Unwritable,
    raised_at,
    require_known,
)
from proofroll.core.pace import PACE
from proofroll.running.case import Case
from proofroll.running.identity import describe, identify_and_settle, resolve
from proofroll.running.loading import watch_foreign
from proofroll.running.memory import volunteer
from proofroll.running.process_end import end_with, end_with_pipe
from proofroll.running.run_case import run
from proofroll.running.time_case import time_once


def main(answers: int, parent: int, life: int) -> None:
    """Serves requests until standard input ends.

    Args:
        answers: file descriptor of the pipe for answers.
        parent: number of the process that sends requests.
        life: file descriptor of a pipe that the parent holds open while it lives.
    """
    end_with(parent)
    end_with_pipe(life)
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # an engine might catch KeyboardInterrupt as its own failure
    volunteer()
    watch_foreign()
    gc.disable()  # until the engine is loaded: imports leave no garbage, and collection takes a tenth of the start
    requests = os.fdopen(os.dup(0), encoding="utf-8")
    with open(os.devnull, "rb") as nothing:
        os.dup2(nothing.fileno(), 0)  # an engine that asks its user something must not read the next request
    with os.fdopen(answers, "w", encoding="utf-8") as pipe, requests:
        for line in requests:
            request = json.loads(line)
            number = request.pop("number")
            answer = _answer(request)
            used = sum(os.times()[:4])  # processor time of this process and of its ended children
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
    except Unwritable as error:
        return {"error": "unwritable", "message": str(error), "errno": error.number, "reason": error.reason}
    except ProofrollError as error:
        return {"error": "crashed", "message": str(error)}
    except Exception as error:
        return {"error": "crashed", "message": one_line(error)}
    finally:
        gc.enable()


def write(case: dict[str, Any], what: str) -> dict[str, Any]:
    """Text of the ``reproducer`` or ``model_file`` that an engine writes for a case, or why it writes none."""
    from proofroll.core.element_abilities import HoldsTargets
    from proofroll.core.engine_abilities import Reproduces, WritesModels
    from proofroll.running.loading import engine_and_settings, scene_of

    asked = Case.from_dict(case)
    kind, settings = engine_and_settings(asked)
    ability, lacking = {
        "reproducer": (Reproduces, f"{asked.engine.name} offers no program of its own"),
        "model_file": (WritesModels, "it writes no file of its model"),
    }[what]
    if not isinstance(kind, ability):
        return {"message": lacking}
    scene = scene_of(asked)
    if any(isinstance(element, HoldsTargets) and element.commands() for element in scene.elements):
        return {"message": "proofroll sets the targets of its controller between steps, and a program alone does not"}
    try:
        return {"text": getattr(kind, what)(scene, settings)}
    except (Refused, Diverged) as error:
        return {"message": str(error)}


def call(function: str, arguments: dict[str, Any]) -> dict[str, Any]:
    """Calls a function ``module:name`` of any package in this process, e.g. one that measures an engine."""
    gc.freeze()  # exclude loaded modules from collection
    try:
        answer: dict[str, Any] | None = pkgutil.resolve_name(function)(**arguments)
    except (Refused, Diverged) as error:
        return {"message": str(error)}
    return answer or {}


def one_line(error: BaseException) -> str:
    """Type and text of an exception in one line, with the line of the engine's adapter that raised it."""
    text, line = " ".join(str(error).split()), raised_at(error)
    summary = f"{type(error).__name__}: {text}"[:400] if text else type(error).__name__
    return f"{summary} ({line})" if line else summary


if __name__ == "__main__":
    PACE.aloud = True
    main(*map(int, sys.argv[1:4]))
