"""The models that a scene can be given: the rungs of the ladder, and what can be switched in each of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from proofroll.core.engine import Level
from proofroll.core.errors import ProofrollError
from proofroll.core.plugins import engine_names
from proofroll.core.scene import Capability, Scene
from proofroll.running.runner import describe

# Rolling resistance that a scene without any is given to see what the term costs: f in radii (Blajer 2006, figure 5).
_RESISTANCE = 0.02
# Friction that is bounded far away from what rolling needs: this many times as much.
_FAR = 10.0


@dataclass(frozen=True)
class Model:
    """An engine with options, on the scene with some parameters.

    Attributes:
        engine: its name.
        options: put over the preset, formulation and preset among them.
        parameters: of the scene, put over those that were given.
        asks: what is wanted besides the motion.
    """

    engine: str
    options: Mapping[str, Any]
    parameters: Mapping[str, float] = field(default_factory=dict)
    asks: tuple[str, ...] = ()

    @property
    def formulation(self) -> str:
        """Which of the engine's models."""
        return str(self.options["formulation"])


@dataclass(frozen=True)
class Rung:
    """A model of the ladder.

    Attributes:
        level: its level.
        model: what is run; None if there is none.
        variant: what distinguishes it from the formulation's own, e.g. ``condim=4``; empty for that one.
        message: why there is none.
    """

    level: Level
    model: Model | None
    variant: str = ""
    message: str = ""


@dataclass(frozen=True)
class Switch:
    """A term of a model, with it and without.

    Attributes:
        term: for a person.
        kind: ``scene`` or ``engine``.
        model: the model in which it is switched.
        on, off: the model with and without it; None where it cannot be left out.
        because: what it is for.
    """

    term: str
    kind: str
    model: Model
    on: Model | None
    off: Model | None
    because: str


def described(engines: Sequence[str]) -> dict[str, dict[str, Any] | ProofrollError]:
    """What every engine tells of itself, or why it cannot; all that are announced if none is named."""
    found: dict[str, dict[str, Any] | ProofrollError] = {}
    for name in engines or engine_names():
        try:
            found[name] = describe(name)
        except ProofrollError as error:
            found[name] = error
    return found


def rungs(engines: Mapping[str, dict[str, Any] | ProofrollError]) -> list[Rung]:
    """The ladder from the least model to the most, each formulation with its best preset that tunes nothing."""
    ladder: list[Rung] = []
    for level in Level:
        before = len(ladder)
        for told in engines.values():
            if isinstance(told, ProofrollError):
                continue
            for formulation, presets in told["presets"].items():
                if told["levels"].get(formulation) != level:
                    continue
                model = Model(told["name"], {"formulation": formulation, "preset": _preset(presets)})
                ladder.append(Rung(level, model))
                for term in told["terms"]:
                    if term["rung"] and formulation in term["formulations"]:
                        ladder.append(Rung(level, _with(model, term["on"]), _written(term["on"])))
        if len(ladder) == before:
            ladder.append(Rung(level, None, message="no engine that was asked has a model of this level"))
    return ladder


def _preset(presets: Mapping[str, Any]) -> str:
    return "matched" if "matched" in presets else next(iter(presets))


def _with(model: Model, options: Mapping[str, Any]) -> Model:
    return Model(model.engine, {**model.options, **options}, model.parameters, model.asks)


def _written(options: Mapping[str, Any]) -> str:
    return ",".join(f"{key}={value}" for key, value in options.items())


def switches(
    ladder: Sequence[Rung], engines: Mapping[str, dict[str, Any] | ProofrollError], scene: Scene, needed: float
) -> list[Switch]:
    """Every optional term: the scene's in one model of each engine and level, the engine's in each model that has it.

    Args:
        ladder: from :func:`rungs`.
        engines: from :func:`described`.
        scene: as it was given.
        needed: friction that rolling needs in it, at most [-].
    """
    found: list[Switch] = []
    models = [(rung.level, rung.model) for rung in ladder if rung.model is not None and not rung.variant]
    seen: set[tuple[str, Level]] = set()
    for level, model in models:
        told = engines[model.engine]
        assert isinstance(told, dict)  # it has a rung
        if (model.engine, level) not in seen:
            found += _of_the_scene(model, scene, needed, told["inherent"].get(model.formulation, {}))
        seen.add((model.engine, level))
    for _, model in models:
        told = engines[model.engine]
        assert isinstance(told, dict)
        found += [
            Switch(term["name"], "engine", model, _with(model, term["on"]), _with(model, term["off"]), term["because"])
            for term in told["terms"]
            if model.formulation in term["formulations"]
        ]
    return found


def _of_the_scene(model: Model, scene: Scene, needed: float, inherent: Mapping[str, str]) -> list[Switch]:
    """Rolling resistance, bounded friction and orientation."""

    def on(term: str, because: str, put: Mapping[str, float], taken: Mapping[str, float]) -> Switch:
        return Switch(
            term,
            "scene",
            model,
            Model(model.engine, model.options, put),
            Model(model.engine, model.options, taken),
            because,
        )

    found: list[Switch] = []
    contact, ball = scene.rolling.contact, scene.rolling.ball
    if "rolling_resistance" in scene.parameters:
        f = contact.rolling_resistance or _RESISTANCE * ball.radius
        because = "the scene has it" if contact.rolling_resistance else f"the scene has none; here with f = {f:g} m"
        found.append(on("rolling resistance", because, {"rolling_resistance": f}, {"rolling_resistance": 0.0}))
    if "mu_static" in scene.parameters:
        unbounded = {"mu_static": float("inf")} | ({"mu_kinetic": float("inf")} if _has(scene, "mu_kinetic") else {})
        if Capability.BOUNDED_FRICTION in scene.requires:
            found.append(on("bounded friction", "the scene bounds it", {}, unbounded))
        else:
            far = _FAR * (needed or 1.0)
            because = f"the scene has no bound; here one of {far:.3g}, {_FAR:g} times what rolling needs"
            bounded = dict.fromkeys(unbounded, far)
            found.append(on("bounded friction", because, bounded, {}))
    if Capability.ORIENTATION in inherent:
        found.append(Switch("orientation asked", "scene", model, None, None, inherent[Capability.ORIENTATION]))
    elif not scene.asks:
        asked = Model(model.engine, model.options, asks=("orientation",))
        found.append(Switch("orientation asked", "scene", model, asked, model, "nothing else depends on it"))
    return found


def _has(scene: Scene, parameter: str) -> bool:
    return parameter in scene.parameters
