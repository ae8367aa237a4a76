"""What the table of verdicts on a page hangs on, as one short hash: a stale table is noticed without a run."""

from __future__ import annotations

import hashlib
import json
import re
import tomllib
from pathlib import Path
from typing import Any

from proofroll.core.plugins import parse_engine
from proofroll.files.comparison_file import load_comparison
from proofroll.files.data_folders import data_folder
from proofroll.running.case import EngineFacts
from proofroll.running.engine_questions import resolve
from proofroll.running.idle_workers import Workers

ROOT = Path(__file__).resolve().parents[1]
# Extras without which nothing is simulated otherwise.
_NO_NUMBERS = {"report", "robots", "all", "dev", "cluster", "docs", "environments"}
# MuJoCo's options that became settings later count where they are not its defaults, which pages made before had.
_LATER = {"impratio": 1.0, "solver": "Newton", "iterations": 100, "noslip_iterations": 0, "eulerdamp": True}
# Of a comparison these are for a person.
_WORDS = ("title", "question", "order", "short")


def facts(name: str, workers: Workers | None = None) -> list[EngineFacts]:
    """Complete settings of every row of a comparison, in its order; engines are asked in one of ``workers``, if given.

    Raises:
        ProofrollError: an engine cannot be asked.
    """
    specs = [parse_engine(row.engine) for row in load_comparison(name).rows]
    found = resolve([(spec.name, spec.options) for spec in specs], workers)
    for item in found:
        if not isinstance(item, EngineFacts):
            raise item
    return [item for item in found if isinstance(item, EngineFacts)]


def pinned(root: Path = ROOT) -> dict[str, str]:
    """The pinned versions of what the numbers come from: the engines, and the libraries that integrate."""
    extras = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    wanted = {
        re.split(r"[\s;<>=\[]", text, maxsplit=1)[0] for name in extras.keys() - _NO_NUMBERS for text in extras[name]
    }
    lines = (line.partition("==") for line in (root / "constraints.txt").read_text(encoding="utf-8").splitlines())
    return {name: version for name, _, version in lines if name in wanted | {"numpy", "scipy"}}


def stamp(name: str, settings: list[EngineFacts], root: Path = ROOT) -> str:
    """The hash: of the comparison and its scene as their files have them, the settings of its rows, and the pins.

    Code of adapters and truths is left out, for it changes too often.
    """
    content: dict[str, Any] = tomllib.loads((data_folder("comparisons") / f"{name}.toml").read_text(encoding="utf-8"))
    content["rows"] = [{key: value for key, value in row.items() if key not in _WORDS} for row in content["rows"]]
    folder = data_folder("models") / content["scene"]
    scene = tomllib.loads((folder / "scene.toml").read_text(encoding="utf-8"))
    chosen = [[item.name, _counted(item), item.resolution, item.order] for item in settings]
    made = [
        {key: value for key, value in content.items() if key not in _WORDS},
        scene,
        [(folder / file).read_text(encoding="utf-8") for file in scene.get("files", [])],
        chosen,
        pinned(root),
    ]
    return hashlib.sha256(json.dumps(made, sort_keys=True).encode()).hexdigest()[:16]


def _counted(item: EngineFacts) -> dict[str, Any]:
    """Settings of a row but later ones at their defaults."""
    later = _LATER if item.name == "mujoco" else {}
    return {name: value for name, value in item.settings.items() if name not in later or value != later[name]}


def stamped(readme: str) -> str:
    """The hash that a README carries; empty if it has none."""
    found = re.search(r"<!-- verdicts:made-from (\w+) -->", readme)
    return found[1] if found else ""


def restamped(readme: str, value: str) -> str:
    """A README that carries another hash, before its table of verdicts."""
    line = f"<!-- verdicts:made-from {value} -->\n"
    bare = re.sub(r"<!-- verdicts:made-from \w* -->\n", "", readme)
    return bare.replace("<!-- verdicts:begin -->\n", f"{line}<!-- verdicts:begin -->\n")
