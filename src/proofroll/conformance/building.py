"""Checks of the model that an engine builds and of its sample at time 0."""

import dataclasses
from collections.abc import Iterable
from typing import Any
from unittest import SkipTest

import numpy as np

from proofroll.conformance.subject import Subject, UnlikeSceneError, bits, lacking_capabilities, require, scenes
from proofroll.core.arrays import FloatArray, in_single_precision
from proofroll.core.certificate import EXACT, ROUNDINGS, SAY_SINGLE, certify, first_difference
from proofroll.core.element import Element
from proofroll.core.element_abilities import HasOptionalCapabilities
from proofroll.core.engine import Sample, precision_of
from proofroll.core.engine_abilities import require_provided
from proofroll.core.errors import Missing, Refused
from proofroll.core.multi_element import REQUIRED
from proofroll.core.scene import Scene


def builds_or_refuses(subject: Subject) -> None:
    """Check: the engine builds the scene, or refuses it in one line that says why."""
    try:
        subject.engine.build(subject.scene.for_an_engine, subject.settings)
    except (Refused, Missing) as refusal:
        text = str(refusal)
        require(text.strip() and "\n" not in text, f"a refusal must be one line that says why, not {text!r}")
    except Exception as error:
        raise AssertionError(f"build raised {type(error).__name__} instead of Refused: {error}") from error


def provides_what_it_says(engine: Any) -> None:
    """Check: for each capability that a formulation provides, some preset builds some scene that needs it."""
    for formulation, provides in engine.provides.items():
        for capability in sorted(provides):
            needing = [scene for scene in scenes().values() if capability in scene.requires <= provides]
            refusals = [_refusal(engine, formulation, scene) for scene in needing]
            if needing and all(refusals):
                refused = "; ".join(f"{scene.name}: {why}" for scene, why in zip(needing, refusals, strict=True))
                raise AssertionError(
                    f"{formulation} provides {capability}, but builds no scene that needs it: {refused}"
                )


def provides_for_some_scene(engine: Any) -> None:
    """Check: each formulation provides all that some scene requires; otherwise nothing of it would be checked."""
    for formulation in engine.presets:
        missing = {name: lacking_capabilities(engine, formulation, scene) for name, scene in scenes().items()}
        needs = "; ".join(f"{name}: {_listed(items)}" for name, items in missing.items())
        require(not all(missing.values()), f"{formulation} can represent no scene; each requires more: {needs}")


def _refusal(engine: Any, formulation: str, scene: Scene) -> str:
    """Reason with which all presets refuse the scene (that of the last); empty if one builds it."""
    why = "it has no preset"
    for settings in engine.presets.get(formulation, {}).values():
        try:
            require_provided(engine, formulation, scene)
            engine.build(scene.for_an_engine, settings)
        except (Refused, Missing) as refusal:
            why = str(refusal)
        else:
            return ""
    return why


def certificate_holds(subject: Subject) -> None:
    """Check: the engine's mass, inertia, gravity, radius, start, first accelerations and forces are the scene's."""
    difference = first_difference(certify(subject.build(), subject.scene, subject.settings))
    if difference is not None:
        raise UnlikeSceneError(subject, str(difference))


def builds_only_what_is_required(subject: Subject) -> None:
    """Check: the model holds all required terms, and no others without a reason.

    A reason is a setting with the name of a question, ``orientation=true``, or an entry in the engine's
    :class:`proofroll.core.engine_abilities.CannotLeaveOut`.
    """
    engine = subject.build()
    terms = getattr(engine.built(), "terms", None)
    if terms is None:
        raise SkipTest("the engine does not report its model")
    elements = subject.scene.elements
    optional = frozenset().union(*(item.optional for item in elements if isinstance(item, HasOptionalCapabilities)))
    required = subject.scene.requires & optional
    left_out = required - terms
    require(not left_out, f"the scene requires {_listed(left_out)}, which the engine did not build")
    settings = subject.settings
    excused = set(getattr(subject.engine, "inherent", {}).get(settings.formulation, {}))
    wished = [field.name for field in dataclasses.fields(settings) if getattr(settings, field.name) is True]
    excused |= {item.askable.get(name) for item in elements for name in wished}
    wasted = terms - subject.scene.requires - excused
    require(not wasted, f"{_listed(wasted)} is in the model, which the scene does not require")
    follows = engine.sample().q_WB is not None
    listed = bool(terms & {item.askable.get("orientation") for item in elements})
    require(
        follows == listed, f"the orientation is {'' if listed else 'not '}in the model, but a sample contradicts this"
    )


def _listed(capabilities: Iterable[str]) -> str:
    return ", ".join(sorted(capabilities))


def samples_are_well_formed(subject: Subject) -> None:
    """Check: samples hold finite arrays of the right shapes and declared precision; orientations start as identity."""
    start = subject.build()
    (element,) = subject.scene.elements
    at_start = start.sample()
    _well_formed(at_start, element, "at time 0")
    orientation = at_start.q_WB
    # An orientation that can be asked for is relative to the start; any other is checked by the certificate.
    if orientation is not None and "orientation" in element.askable:
        identity = float(np.max(np.abs(np.abs(orientation) - [1, 0, 0, 0])))
        require(
            identity < max(EXACT, ROUNDINGS * subject.epsilon), f"q_WB at time 0 is {orientation} instead of 1, 0, 0, 0"
        )
    moved = subject.at(subject.span(1)).sample()
    _well_formed(moved, element, "after a step")
    for name in REQUIRED if precision_of(subject.settings) == "double" else ():
        old_values, new_values = (getattr(sample, name) for sample in (at_start, moved))
        require(
            not in_single_precision(new_values[new_values != old_values]),
            f"after a step all numbers of {name} have single precision (float32), though the settings say double or "
            f"nothing: {SAY_SINGLE}",
        )
    for name in (item.name for item in dataclasses.fields(at_start)):
        lost = _is_there(getattr(at_start, name)) and not _is_there(getattr(moved, name))
        require(not lost, f"{name} is there at time 0, and not later; only time 0 may lack one")


def _is_there(value: FloatArray | None) -> bool:
    return value is not None and bool(np.all(np.isfinite(value)))


def _well_formed(sample: Sample, element: Element, when: str) -> None:
    kind, bodies = element.sample_type, len(element.bodies)
    require(isinstance(sample, kind), f"sample() gave {type(sample).__name__} instead of {kind.__name__} {when}")
    single = bodies == 1 and np.ndim(sample.p_WB) == np.ndim(sample.v_WB) == 1  # one body needs no axis of bodies
    for name, size in kind.widths.items():
        value = getattr(sample, name)
        if value is None and name not in REQUIRED:
            continue
        require(isinstance(value, np.ndarray), f"{name} is {type(value).__name__} instead of an array {when}")
        shape = (size,) if single else (bodies, size)
        require(value.shape == shape, f"{name} has the shape {value.shape} instead of {shape} {when}")
        require(value.dtype == np.float64, f"{name} is of type {value.dtype} instead of float64 {when}")
        require(np.all(np.isfinite(value)), f"{name} is {value} {when}")
    if sample.q_WB is not None:
        off = float(np.max(np.abs(np.linalg.norm(sample.q_WB, axis=-1) - 1)))
        require(off < 1e-6, f"q_WB has a length that is off by {off} from 1 {when}")


def reading_back_changes_nothing(subject: Subject) -> None:
    """Check: ``built()`` and ``sample()`` are repeatable and change nothing, and later steps change no sample."""
    engine = subject.build()
    sample = engine.sample()
    old_bits = bits(sample)
    engine.built()
    engine.built()
    require(bits(engine.sample()) == old_bits, "sample() gives other numbers after built()")
    t = subject.span(1)
    engine.advance(t)
    # A shared buffer may be overwritten only by the next sample, of this engine or of another one.
    moved, alone = bits(engine.sample()), bits(subject.at(t).sample())
    require(bits(sample) == old_bits, "the arrays of a sample change with later steps: return copies")
    require(moved == alone, "a run whose engine was sampled at time 0 ends elsewhere than one that was not")
