"""Runs one scene in one engine from Python, in this process."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

from proofroll.core import multi_element
from proofroll.core.certificate import first_difference
from proofroll.core.controlled_engine import commanded
from proofroll.core.dataset import truth_message
from proofroll.core.engine import fixed_step
from proofroll.core.errors import InputError, Refused
from proofroll.core.first_steps import certificate
from proofroll.core.plugins import lacking_of, load_engine, parse_engine, resolve_settings
from proofroll.core.scene import Scene
from proofroll.core.time_grid import EVERY, off_grid, require_whole_steps, sampling_interval, time_grid
from proofroll.core.whole_turns import samples_between
from proofroll.files.scene_file import load_scene
from proofroll.files.scene_sources import with_control
from proofroll.running.identity import manifest, truth_version, versions
from proofroll.running.recording import record

if TYPE_CHECKING:
    import xarray as xr

# Methods of a run, which the class of most engines has itself.
_OF_A_RUN = ("advance", "sample", "built")


def build(scene: Scene, engine: Any, **settings: Any) -> Any:
    """Engine with the scene at time 0, after checking that it can represent the scene.

    Args:
        scene: from :func:`proofroll.load_scene`.
        engine: ``name``, ``name[key=value,…]``, or the class, which no package needs to announce.
        **settings: the engine's settings, besides those in brackets.

    Raises:
        InputError: unknown engine or setting, or a setting that is given twice.
        Missing: the engine is not installed.
        Refused: the engine cannot represent the scene.
    """
    kind, resolved = _resolved(scene, engine, settings)
    return multi_element.build(kind, scene, resolved)


def _resolved(scene: Scene, engine: Any, settings: dict[str, Any]) -> tuple[Any, Any]:
    """Class and complete settings of an engine. Raises InputError as :func:`build` does."""
    if not isinstance(engine, str):
        # The ``build`` of a class with none of a run's methods returns runs of another class.
        other_runs = hasattr(engine, "build") and not any(hasattr(engine, name) for name in _OF_A_RUN)
        if lacking := lacking_of(engine, *(() if other_runs else _OF_A_RUN)):
            shown = engine.__name__ if isinstance(engine, type) else repr(engine)
            raise InputError("engine", shown, f"give a name, or a class that has {', '.join(lacking)} too")
        return engine, resolve_settings(engine, settings, scene.requires)
    spec = parse_engine(engine)
    for key, value in settings.items():
        if key in spec.options:
            raise InputError(f"{spec.name}: {key}", value, f"{spec.options[key]} is in the brackets; give it once")
    kind = load_engine(spec.name)
    return kind, resolve_settings(kind, {**spec.options, **settings}, scene.requires)


def simulate(
    scene: Scene | str,
    engine: str | type[Any] = "truth",
    *,
    until: float = 2.0,
    every: float | None = None,
    control: str | Path | None = None,
    **settings: Any,
) -> xr.Dataset:
    """Trajectory of a scene in an engine, with units on every variable.

    Args:
        scene: from :func:`proofroll.load_scene`, or the name or path that it takes.
        engine: ``truth``, ``name``, ``name[key=value,…]``, or the class, which no package needs to announce.
        until: last time [s].
        every: sampling interval [s]; by default 0.01 s, or the nearest whole number of steps.
        control: path of a controller's file, for a scene that is the path of a robot file.
        **settings: e.g. ``formulation="chart", dt=1e-4``.

    Returns:
        Dataset with the attributes ``status`` (``done`` or ``diverged``), ``message`` (one sentence) and those of
        :func:`proofroll.running.identity.manifest`: engine, settings, parameters, versions. The truth's variables have
        an attribute ``error_bar``, in their unit.

    Raises:
        InputError: a value that makes no sense.
        Missing: the engine is not installed.
        Refused: the engine cannot represent the scene, or its model contradicts it (certificate).
    """
    if control is not None:
        if not isinstance(scene, str):
            raise InputError("control", control, "it is for the path of a robot file; this scene is loaded already")
        scene = with_control(scene, Path(control))
    if isinstance(scene, str):
        scene = load_scene(scene)
    spec = parse_engine(engine) if isinstance(engine, str) else None
    if spec is not None and spec.name == "truth":
        options = {**spec.options, **settings}
        if options:
            raise InputError("truth", ", ".join(options), "the truth has no settings; leave them out")
        from proofroll.core.truth import truth

        times = time_grid(until, EVERY if every is None else every)
        dataset = truth(scene, times, samples_between(scene, times))
        dataset = dataset.assign_attrs(status="done", message=truth_message(dataset))
        return dataset.assign_attrs(manifest("truth", {}, scene, versions("truth", truth_version())))
    kind, resolved = _resolved(scene, engine, settings)
    times = time_grid(until, sampling_interval(fixed_step(resolved)) if every is None else every)
    built = multi_element.build(kind, scene, resolved)
    step = multi_element.step_of(built, resolved)
    require_whole_steps(times, step)
    lines = certificate(kind, built, scene, resolved)
    difference = first_difference(lines)
    if difference is not None:
        raise Refused(difference)
    recording = record(built, scene, times, off_grid(times, step), samples_between(scene, times, step))
    return recording.dataset.assign_attrs(
        status="done" if recording.failure is None else "diverged",
        message=recording.message(until),
        wall_seconds=recording.wall_seconds,
        **manifest(kind.name, dataclasses.asdict(resolved), scene, versions(kind.name, kind.version()), lines),
    )


def simulate_built(engine: Any, scene: Scene, *, until: float = 2.0, every: float | None = None) -> xr.Dataset:
    """Trajectory of an engine that was built by the caller and is at time 0; see :func:`simulate`."""
    if len(scene.elements) == 1:  # whoever built it alone left the controller of the scene out
        engine = commanded(engine, scene.elements[0], None)
    recording = record(engine, scene, time_grid(until, EVERY if every is None else every))
    status = "done" if recording.failure is None else "diverged"
    return recording.dataset.assign_attrs(status=status, message=recording.message(until))
