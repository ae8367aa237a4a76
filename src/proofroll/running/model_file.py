"""The file of a model that an engine's own tools read, written in the engine's own process."""

from __future__ import annotations

import dataclasses
from typing import Any

from proofroll.core.engine_abilities import WritesModels
from proofroll.core.errors import Refused
from proofroll.running.asking import lent_workers
from proofroll.running.case import Case
from proofroll.running.loading import loaded, scene_of

_SECONDS = 300.0


def model_file(case: Case) -> str:
    """The text of the file.

    Raises:
        Refused: the engine writes none, or none of this scene.
    """
    arguments = {"case": dataclasses.asdict(case)}
    with lent_workers(None) as lent, lent.lend(case.engine.name) as worker:
        answer = worker.request({"do": "call", "function": f"{__name__}:written", "arguments": arguments}, _SECONDS)
    if "text" not in answer:
        raise Refused(f"{case.engine.name}: {answer['message']}")
    return str(answer["text"])


def written(case: dict[str, Any]) -> dict[str, Any]:
    """The same, in this process; ``text``."""
    wanted = Case.from_dict(case)
    kind, settings = loaded(wanted)
    if not isinstance(kind, WritesModels):
        raise Refused("it writes no file of its model")
    return {"text": kind.model_file(scene_of(wanted), settings)}
