"""Checks of an engine's declarations; nothing is built."""

import dataclasses
import json
import math
from collections.abc import Mapping
from typing import Any

from proofroll.conformance.subject import require
from proofroll.core.engine import EPSILON
from proofroll.core.entry_points import announced
from proofroll.core.errors import InputError
from proofroll.core.formulations import extended
from proofroll.core.plugins import GROUP, resolve_settings


def name_is_the_entry_point(engine: Any) -> None:
    """Check: an installed package announces the engine under its own name."""
    points = [point for point in announced(GROUP) if point.name == engine.name]
    require(points, f"no installed package has the entry point {GROUP}: {engine.name}; add it and install the package")
    kind = points[0].load()
    require(engine in (kind, extended(kind)), f"the entry point {engine.name} leads to {kind!r} instead of {engine!r}")


def version_is_told(engine: Any) -> None:
    """Check: the engine's version is a text."""
    version = engine.version()
    require(isinstance(version, str) and version.strip(), f"version() gave {version!r} instead of text")


def provides_capabilities(engine: Any) -> None:
    """Check: each formulation declares its capabilities, a frozen set of texts, none of them empty."""
    require(
        isinstance(engine.provides, Mapping), "provides must be a mapping: formulation -> frozenset of capabilities"
    )
    missing = engine.presets.keys() ^ engine.provides.keys()
    require(not missing, f"provides and presets must name the same formulations; only one has {sorted(missing)}")
    for formulation, provides in engine.provides.items():
        require(
            isinstance(provides, frozenset), f"provides of {formulation} is a {type(provides).__name__}, no frozenset"
        )
        require(provides, f"{formulation} provides nothing, so it can represent no scene")
        odd = {item for item in provides if not (isinstance(item, str) and item)}
        require(not odd, f"provides of {formulation} holds {odd}, which are no texts")


def settings_are_a_frozen_dataclass(engine: Any) -> None:
    """Check: the settings are a frozen dataclass with defaults for all fields, and have formulation and preset."""
    kind = engine.settings
    require(dataclasses.is_dataclass(kind), "settings must be a dataclass")
    require(kind.__dataclass_params__.frozen, "settings must be frozen: @dataclass(frozen=True)")
    fields = {field.name: field for field in dataclasses.fields(kind)}
    for name in ("formulation", "preset"):
        require(name in fields, f"settings need the field {name}")
    for name, field in fields.items():
        missing = field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING
        require(not missing, f"the setting {name} needs a default")


def presets_are_complete(engine: Any) -> None:
    """Check: each formulation has a preset matched or default; each preset has its own names and survives JSON."""
    require(engine.presets, "presets are empty; give each formulation its settings")
    for formulation, presets in engine.presets.items():
        require({"matched", "default"} & set(presets), f"{formulation} needs a preset matched or default")
        unknown = set(presets) - {"default", "matched", "tuned"}
        require(not unknown, f"{formulation} has the preset {unknown}; only default, matched and tuned have a meaning")
        for preset, settings in presets.items():
            place = f"presets[{formulation!r}][{preset!r}]"
            require(settings.formulation == formulation, f"{place}.formulation is {settings.formulation!r}")
            require(settings.preset == preset, f"{place}.preset is {settings.preset!r}")
            unused = getattr(settings, "unused", ())
            asked = {name: value for name, value in dataclasses.asdict(settings).items() if name not in unused}
            again = resolve_settings(engine, json.loads(json.dumps(asked)))
            require(again == settings, f"{place} is {again} after it was written as JSON and read")


def resolution_and_order_are_told(engine: Any) -> None:
    """Check: each preset names the setting that trades speed for accuracy, if any; only a step has an order."""
    for formulation, presets in engine.presets.items():
        for preset, settings in presets.items():
            place = f"presets[{formulation!r}][{preset!r}]"
            if settings.resolution is None:
                require(settings.order is None, f"{place}.order is {settings.order!r}; without a step there is none")
                continue
            require(
                settings.resolution in {"dt", "rtol"}, f"{place}.resolution is {settings.resolution!r}, not dt or rtol"
            )
            value = getattr(settings, settings.resolution, None)
            usable = isinstance(value, float) and math.isfinite(value) and value > 0
            require(usable, f"{place}.{settings.resolution} is {value!r} instead of a positive number")
            order = settings.order
            if settings.resolution == "dt":
                whole = isinstance(order, int) and not isinstance(order, bool) and order > 0
                require(whole or order is None, f"{place}.order is {order!r}, neither a whole order nor None")
            else:
                require(order is None, f"{place}.order is {order!r}; with a tolerance there is none")


def precision_is_told(engine: Any) -> None:
    """Check: each preset declares double or single precision, or none, which means double."""
    for formulation, presets in engine.presets.items():
        for preset, settings in presets.items():
            declared = getattr(settings, "precision", "double")
            place = f"presets[{formulation!r}][{preset!r}].precision"
            require(declared in EPSILON, f"{place} is {declared!r}, not single or double")


def bad_settings_give_one_line(engine: Any) -> None:
    """Check: an unknown or invalid setting gives one line with its name, not a traceback."""
    preset = next(iter(next(iter(engine.presets.values())).values()))
    chosen, resolution = {"formulation": preset.formulation, "preset": preset.preset}, preset.resolution
    bad: list[tuple[str, object]] = [("no_such_setting", 1), ("formulation", "no_such"), ("preset", "no_such")]
    if resolution is not None:
        bad += [(resolution, value) for value in (0, -1.0, math.nan, math.inf, "text", None)]
    for name, value in bad:
        try:
            settings = resolve_settings(engine, {**chosen, name: value})
        except InputError as error:
            text = str(error)
            require("\n" not in text, f"the message about {name}={value!r} has more than one line: {text!r}")
            require(name in text, f"the message about {name}={value!r} does not name the setting: {text!r}")
        except Exception as error:
            raise AssertionError(
                f"{name}={value!r} gave {type(error).__name__} instead of InputError: {error}"
            ) from error
        else:
            raise AssertionError(f"{name}={value!r} was accepted: {settings}")
