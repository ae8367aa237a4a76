"""Checks of an engine's motion against the scene and its truth; nothing that the adapter says of itself is believed."""

from __future__ import annotations

import dataclasses
from functools import cache
from typing import TYPE_CHECKING
from unittest import SkipTest

import numpy as np

from proofroll.certificate import first_difference
from proofroll.conformance.subject import Subject, require, scenes
from proofroll.first_steps import MOST, first_steps, softness
from proofroll.mechanics import natural_acceleration
from proofroll.scene import Scene
from proofroll.surfaces import FloatArray

if TYPE_CHECKING:
    import xarray as xr

# Length of the run [s], and parts of it that are no whole number of any interval at which somebody samples.
_LENGTH = 0.1
_PARTS = (2**0.5 - 1, (5**0.5 - 1) / 2, np.pi / 4, 1.0)
# Largest difference, relative to what gravity does in that time: more, and the ball goes somewhere else.
_MOST = 0.1
# An error is at most twice the change from a step to its half; as much again is spared for the terms beyond the first.
_MARGIN = 4.0
_ROUND_OFF = 1e-8


@cache
def truth_scenes() -> dict[str, Scene]:
    """Scenes that show a frame taken for another: turned about the axis, tilted, spinning about e1; slow and fast."""
    return {
        "plane": scenes()["plane"],
        "slow": _turned("cylinder-resisting", -1.0, 0.05, velocity=(1.2, 0.2), spin=5.0),
        "fast": _turned("cylinder", 2.0, -0.2, velocity=(4.5, -0.7)),
    }


def _turned(name: str, gamma: float, tilt: float, **motion: object) -> Scene:
    """A scene of the conformance checks that starts at the angle ``gamma``, with its axis tilted, both in rad."""
    scene = scenes()[name]
    start = dataclasses.replace(scene.initial[0], coordinates=(gamma, 0.1), **motion)  # type: ignore[arg-type]  # as named
    wall = dataclasses.replace(scene.surfaces[0], tilt=tilt)
    return dataclasses.replace(scene, initial=(start,), surfaces=(wall,))


def first_steps_fit_the_scene(subject: Subject) -> None:
    """The first acceleration, derived from the first steps, is the scene's, whatever the adapter says or does not."""
    subject.build()
    lines = first_steps(subject.engine, subject.scene, subject.settings)
    if not lines:
        raise SkipTest("its contact is so soft that its springs move first; the run against the truth judges it")
    difference = first_difference([dataclasses.replace(line, tolerance=min(line.tolerance, MOST)) for line in lines])
    require(difference is None, str(difference))


def moves_as_the_truth(subject: Subject) -> None:
    """A short run ends where the truth does, with its velocities and forces; so it does between any two samples."""
    step = subject.settings.dt if subject.fixed_step else None
    times = np.array([0.0, *(part * _LENGTH for part in _PARTS)])
    if step is not None:
        times = np.unique(np.ceil(times / step - 1e-9)) * step
    true = _truth(subject.scene, tuple(times.tolist()))
    moved = _moved(subject, times)
    finer = _moved(subject.finer(0.5), times) if step is not None else moved
    soft = softness(subject.build())
    body = subject.scene.rolling
    fall = float(np.linalg.norm(body.gravity)) * times[-1]
    sizes = {
        "p_WB": fall * times[-1] / 2,
        "v_WB": fall,
        "w_WB": fall / body.ball.radius,
        "force": body.ball.mass * natural_acceleration(body),
    }
    for name, values in moved.items():
        error, change = (float(np.max(np.abs(values - other))) / sizes[name] for other in (true[name], finer[name]))
        # The speed may be many times what gravity adds to it; a tolerance is relative to it.
        rough = max(_ROUND_OFF, 10 * subject.closeness)
        allowed = min(_MOST, _MARGIN * change + soft + rough)
        require(
            error <= allowed,
            f"{name} is off by {error:.2g} of what gravity makes of it in {times[-1]:.2g} s, allowed {allowed:.2g}",
        )


def _moved(subject: Subject, times: FloatArray) -> dict[str, FloatArray]:
    """State and force of the engine at all times but the first."""
    engine, samples = subject.build(), []
    for t in times[1:].tolist():
        engine.advance(t)
        samples.append(engine.sample())
    names = ("p_WB", "v_WB", "w_WB", *(("force",) if samples[0].force is not None else ()))
    return {name: np.array([getattr(sample, name) for sample in samples]) for name in names}


def _truth(scene: Scene, times: tuple[float, ...]) -> dict[str, FloatArray]:
    """The same of the truth."""
    dataset = _trajectory(scene.digest, times)
    frame = scene.rolling.surface.frame(np.stack([dataset[name] for name in scene.rolling.surface.coordinates], -1))
    local = np.stack([-dataset["N"], dataset["F2"], dataset["F3"]], -1)
    force = np.einsum("tij,tj->ti", frame, local)
    return {name: dataset[name].to_numpy()[1:] for name in ("p_WB", "v_WB", "w_WB")} | {"force": force[1:]}


@cache
def _trajectory(digest: str, times: tuple[float, ...]) -> xr.Dataset:
    """The truth of one of :func:`truth_scenes`, which many engines and presets are held against."""
    from proofroll.truth import truth

    return truth(next(scene for scene in truth_scenes().values() if scene.digest == digest), np.array(times))
