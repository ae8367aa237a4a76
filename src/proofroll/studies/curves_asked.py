"""Which formulations and presets of which engines are swept."""

from __future__ import annotations

from collections.abc import Iterable

from proofroll.core.errors import InputError, ProofrollError
from proofroll.core.plugins import EngineSpec, engine_names, parse_engine
from proofroll.running.asking import described, resolve
from proofroll.running.case import EngineDescription, EngineFacts
from proofroll.running.worker_pool import Workers
from proofroll.studies.curve import Curve


def curves_of(
    engines: Iterable[str], workers: Workers | None = None, requires: frozenset[str] = frozenset()
) -> tuple[list[Curve], dict[str, str]]:
    """A curve without points for every formulation and preset of the engines, and why some engine has none.

    An engine is a name, or ``name[key=value,…]`` for one formulation or setting; none means all that are installed.
    Formulations that provide nothing of what the scene requires are for other kinds of scenes, and left out.
    """
    wanted: list[tuple[str, str | None]] = []
    absent: dict[str, str] = {}
    asked = [(text, parse_engine(text)) for text in list(engines) or engine_names()]
    told = described((spec.name for _, spec in asked), workers)
    for text, spec in asked:
        answer = told[spec.name]
        if isinstance(answer, InputError):
            raise answer
        if isinstance(answer, ProofrollError):
            absent[spec.name] = str(answer)
            continue
        chosen, foreign = _chosen(spec, answer, requires)
        if foreign:
            absent.setdefault(spec.name, "none of its formulations is for scenes of this kind")
        wanted += chosen
        if any(parse_engine(name).name == spec.name for name, _ in wanted):
            absent.pop(spec.name, None)
        elif spec.name not in absent:
            raise InputError("engine", text, f"{spec.name} has {', '.join(answer.presets)}")
    specs = [parse_engine(name) for name, _ in wanted]
    curves = []
    resolved = resolve([(spec.name, spec.options) for spec in specs], workers)
    for (name, level), facts in zip(wanted, resolved, strict=True):
        if isinstance(facts, InputError):
            raise facts
        if isinstance(facts, EngineFacts):
            curves.append(Curve(name, facts.on(requires), level))
        else:
            absent[name] = str(facts)
    return curves, absent


def _chosen(
    spec: EngineSpec, described: EngineDescription, requires: frozenset[str]
) -> tuple[list[tuple[str, str | None]], bool]:
    """Formulations and presets that a specification means, each with its level; whether some are for other scenes."""
    chosen: list[tuple[str, str | None]] = []
    foreign = False
    for formulation, presets in described.presets.items():
        if spec.options.get("formulation", formulation) != formulation:
            continue
        if requires and not requires & set(described.provides[formulation]):
            foreign = True
            continue
        for preset in presets:
            if spec.options.get("preset", preset) == preset:
                options = {"formulation": formulation, "preset": preset, **spec.options}
                inner = ",".join(f"{key}={value}" for key, value in options.items())
                chosen.append((f"{spec.name}[{inner}]", described.levels.get(formulation)))
    return chosen, foreign
