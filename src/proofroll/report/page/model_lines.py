"""Lines for a reader's own model: what makes a setting there, what checks it, and what keeps it."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from proofroll.core.engine_abilities import TellsLines
from proofroll.core.errors import ProofrollError
from proofroll.core.number_format import exact
from proofroll.core.plugins import load_engine, parse_engine, resolve_settings
from proofroll.files.scene_sources import ROOT, root_words
from proofroll.report.answer.sentences import command_of
from proofroll.report.pages import slug
from proofroll.studies.answer.records import EngineAnswer, SceneAnswer


@dataclass(frozen=True)
class ModelLines:
    """Texts to copy by their heads; ``note``: why none of them is the engine's own file or program, else empty."""

    blocks: dict[str, str]
    note: str = ""


def of(made: SceneAnswer, item: EngineAnswer) -> ModelLines:
    """Lines for an engine that holds a tolerance, for the answer's question: its own, a command, and a test."""
    lines, note = _own(item.spec)
    given = ", ".join(f"{name}={value!r}" for name, value in made.parameters.items())
    name, below = json.dumps(made.scene), root_words()[1:]
    scene = f"load_scene({name}, {given})" if given else name
    bounds = {bound.quantity: f"{bound.allowed:.12g} {bound.unit}".removesuffix(" 1") for bound in made.bounds}
    why = f"{made.tolerance} is close enough"
    arguments = [scene, f'"{item.spec}"', f"tolerance={bounds!r}", f"because={json.dumps(why)}"]
    arguments += [f"until={exact(made.until)}", f"every={exact(made.every)}"]
    test = [
        *(["from proofroll import load_scene", "", ""] if given else []),
        f"def test_{slug(made.scene).replace('-', '_')}(assert_agrees{', monkeypatch' if below else ''}):",
        *(f'    monkeypatch.setenv("{ROOT}", {json.dumps(folder)})' for folder in below),
        "    assert_agrees(",
        *(f"        {argument}," for argument in arguments),
        "    )",
    ]
    own = {"In your model": "\n".join(lines)} if lines else {}
    return ModelLines(own | {"Check it": command_of(made, item), "Keep it, pytest": "\n".join(test)}, note)


def own_lines(name: str, settings: Mapping[str, Any]) -> Sequence[str]:
    """Lines of an engine's own file or program that make settings.

    Raises:
        ProofrollError: the engine is missing, or its adapter tells no lines.
    """
    engine = load_engine(name)
    if not isinstance(engine, TellsLines):
        raise ProofrollError("its adapter tells no lines for a model of your own")
    return engine.lines(resolve_settings(engine, settings))


@cache
def _own(spec: str) -> tuple[Sequence[str], str]:
    """The same for ``name[key=value,…]``, or why there are none."""
    try:
        asked = parse_engine(spec)
        return own_lines(asked.name, asked.options), ""
    except ProofrollError as error:
        return (), str(error)
