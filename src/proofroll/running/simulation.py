"""One scene in one engine, from Python, in this process."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from proofroll.core.certificate import certify, first_difference
from proofroll.core.engine import require_provided
from proofroll.core.errors import InputError, Refused
from proofroll.core.plugins import load_engine, parse_engine, resolve_settings
from proofroll.core.scene import Scene
from proofroll.core.time_grid import time_grid
from proofroll.running.recording import record

if TYPE_CHECKING:
    import xarray as xr


def build(scene: Scene, engine: str, **settings: Any) -> Any:
    """The scene in the engine at time 0, after checking that the engine can represent it.

    Args:
        scene: from :func:`proofroll.load_scene`.
        engine: ``name`` or ``name[key=value,…]``.
        **settings: the engine's settings, put over those in brackets.

    Raises:
        InputError: unknown engine or setting.
        Missing: the engine is not installed.
        Refused: the engine cannot represent the scene.
    """
    spec = parse_engine(engine)
    kind = load_engine(spec.name)
    resolved = resolve_settings(kind, {**spec.options, **settings})
    require_provided(kind, resolved.formulation, scene)
    return kind.build(scene, resolved)


def simulate(
    scene: Scene,
    engine: str = "truth",
    *,
    until: float = 2.0,
    every: float = 0.01,
    **settings: Any,
) -> xr.Dataset:
    """The trajectory of a scene in an engine, with units on every variable.

    Args:
        scene: from :func:`proofroll.load_scene`.
        engine: ``truth``, ``name`` or ``name[key=value,…]``.
        until: last time [s].
        every: interval between samples [s].
        **settings: e.g. ``formulation="chart", dt=1e-4``.

    Returns:
        Dataset with the attribute ``status`` (``done`` or ``diverged``) and ``message``, one sentence.

    Raises:
        InputError: a value that makes no sense.
        Missing: the engine is not installed.
        Refused: the engine cannot represent the scene, or built something else than the scene says.
    """
    times = time_grid(until, every)
    spec = parse_engine(engine)
    if spec.name == "truth":
        options = {**spec.options, **settings}
        if options:
            raise InputError("truth", ", ".join(options), "the truth has no settings; leave them out")
        from proofroll.core.truth import truth

        return truth(scene, times).assign_attrs(status="done", message="two independent routes agree")
    built = build(scene, engine, **settings)
    difference = first_difference(certify(built, scene))
    if difference is not None:
        raise Refused(difference)
    recording = record(built, scene, times)
    return recording.dataset.assign_attrs(
        status="done" if recording.failure is None else "diverged",
        message=recording.message(until),
        wall_seconds=recording.wall_seconds,
    )
