"""Formulations and presets of engines as studies over steps and tolerances take them."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from proofroll.core.engine_abilities import offered
from proofroll.core.errors import InputError, ProofrollError
from proofroll.core.plugins import EngineSpec, engine_names, parse_engine
from proofroll.running.case import EngineDescription, EngineFacts
from proofroll.running.engine_questions import describe_each, resolve
from proofroll.running.idle_workers import Workers


@dataclass(frozen=True, kw_only=True)
class SweptSetting:
    """Record of an engine with settings, whose step or tolerance is swept.

    Attributes:
        engine: name of the engine.
        curve: ``name[formulation=…,preset=…]``.
        level: rung on the ladder of models; None: not declared.
        settings, resolution, caveat, family, precision: the engine's facts.
    """

    engine: str
    curve: str
    level: str | None
    settings: dict[str, Any]
    resolution: str | None
    caveat: str = ""
    family: str = ""
    precision: str = "double"


@dataclass(frozen=True)
class Curve:
    """One engine, formulation and preset, to be run over steps or tolerances.

    Attributes:
        engine: ``name[formulation=…,preset=…]``.
        facts: with the preset's own step or tolerance.
    """

    engine: str
    facts: EngineFacts

    @property
    def fixed_step(self) -> bool:
        """True if the curve is swept over steps; False: over tolerances."""
        return self.facts.resolution == "dt"

    @property
    def fixed(self) -> bool:
        """True if the curve is one point: nothing can be refined, or the user gave the step or the tolerance."""
        resolution = self.facts.resolution
        return resolution is None or resolution in parse_engine(self.engine).options

    def setting(self, facts: EngineFacts) -> dict[str, Any]:
        """Values of the fields of :class:`SweptSetting` with the facts of one of its runs."""
        facts_shown = {
            name: getattr(facts, name) for name in ("settings", "resolution", "caveat", "family", "precision")
        }
        return {"engine": facts.name, "curve": self.engine, "level": facts.level or None} | facts_shown


def curves_of(
    engines: Iterable[str], workers: Workers | None = None, requires: frozenset[str] = frozenset()
) -> tuple[list[Curve], dict[str, str]]:
    """Curves, one for each formulation and preset of the engines; and engine without a curve -> reason.

    Formulations that provide nothing that the scene requires are for other kinds of scenes, and left out.

    Args:
        engines: ``name``, or ``name[key=value,…]`` for one formulation or setting; empty: all that are installed.
        workers: pool for the questions to engines; None: new workers.
        requires: capabilities that the scene requires.

    Raises:
        InputError: an unknown engine, formulation or setting.
    """
    engines_asked: list[str] = []
    absent: dict[str, str] = {}
    asked = [(text, parse_engine(text)) for text in list(engines) or engine_names()]
    descriptions = describe_each((spec.name for _, spec in asked), workers)
    for text, spec in asked:
        answer = descriptions[spec.name]
        if isinstance(answer, InputError):
            raise answer
        if isinstance(answer, ProofrollError):
            absent[spec.name] = str(answer)
            continue
        chosen, foreign = _chosen(spec, answer, requires)
        if foreign:
            absent.setdefault(spec.name, "none of its formulations is for scenes of this kind")
        engines_asked += chosen
        if any(parse_engine(name).name == spec.name for name in engines_asked):
            absent.pop(spec.name, None)
        elif spec.name not in absent:
            raise InputError("engine", text, f"{spec.name} has {', '.join(answer.presets)}")
    specs = [parse_engine(name) for name in engines_asked]
    curves = []
    resolved = resolve([(spec.name, spec.options) for spec in specs], workers)
    for name, facts in zip(engines_asked, resolved, strict=True):
        if isinstance(facts, InputError):
            raise facts
        if isinstance(facts, EngineFacts):
            curves.append(Curve(name, facts.on(requires)))
        else:
            absent[name] = str(facts)
    return curves, absent


def _chosen(spec: EngineSpec, described: EngineDescription, requires: frozenset[str]) -> tuple[list[str], bool]:
    """Formulations and presets that a specification selects, as ``name[key=value,…]``.

    The second value is True if some were left out because they are for other kinds of scenes.
    """
    chosen: list[str] = []
    foreign = False
    for formulation, presets in described.presets.items():
        if spec.options.get("formulation", formulation) != formulation:
            continue
        able = not requires or requires & set(described.provides[formulation])
        fits = "formulation" in spec.options or offered(formulation, requires, described.made_for)
        if not able or not fits:
            foreign = True
            continue
        for preset in presets:
            if spec.options.get("preset", preset) == preset:
                options = {"formulation": formulation, "preset": preset, **spec.options}
                chosen.append(str(EngineSpec(spec.name, options)))
    return chosen, foreign
