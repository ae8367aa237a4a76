"""Copies of scenes in MJX, which one compiled function moves together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import jax
import numpy as np
from mujoco import mjx

from proofroll.adapter import MechanismSample, Refused, Scene, whole_steps
from proofroll_mjx.settings import MjxSettings
from proofroll_mjx.start import kinds_of_step, set_precision, start_of


class MjxBatch:
    """Copies of a few scenes. See :class:`proofroll.core.engine_abilities.Batch`."""

    def __init__(self, scenes: Sequence[Scene], pattern: Sequence[int], settings: MjxSettings) -> None:
        set_precision(settings)
        self.device = jax.devices()[0].platform
        self._dt, self._count = settings.dt, 0
        starts = [start_of(scene, settings) for scene in scenes]
        models, states = ([getattr(start, name) for start in starts] for name in ("model", "data"))
        if any(jax.tree.structure(item) != jax.tree.structure(models[0]) for item in models[1:]):
            raise Refused("MJX moves copies of one structure together, and these scenes differ in theirs")
        self._arrays, numbers = starts[0].arrays, np.array(pattern)
        leaves = [jax.tree.leaves(item) for item in models]
        differing = tuple(
            any(not np.array_equal(leaf, values[0]) for leaf in values[1:]) for values in zip(*leaves, strict=True)
        )
        # Numbers of the model that all scenes share are there once.
        chosen = [
            jax.numpy.stack(values)[numbers] if differs else values[0]
            for values, differs in zip(zip(*leaves, strict=True), differing, strict=True)
        ]
        structure = jax.tree.structure(models[0])
        self._model = jax.tree.unflatten(structure, chosen)
        self._steps, self._forward = _compiled(structure, differing)
        self._data = jax.tree.map(
            lambda kind, *values: jax.numpy.stack(values)[numbers].astype(kind.dtype), kinds_of_step(starts[0]), *states
        )
        self._data = jax.block_until_ready(self._steps(self._model, self._data, 0))  # compiles

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine_abilities.Batch`."""
        count = whole_steps(self._count * self._dt, t, self._dt)
        self._data = jax.block_until_ready(self._steps(self._model, self._data, count))
        self._count += count

    def sample(self) -> MechanismSample:
        """See :class:`proofroll.core.engine_abilities.Batch`."""
        data = self._forward(self._model, self._data)
        return self._arrays.sample(lambda name: getattr(data, name))


@cache
def _compiled(structure: Any, differing: tuple[bool, ...]) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """Steps and evaluation of copies whose models differ in some of their arrays."""
    axes = jax.tree.unflatten(structure, [0 if differs else None for differs in differing])

    def steps(model: Any, data: Any, count: Any) -> Any:
        return jax.lax.fori_loop(0, count, lambda _, state: mjx.step(model, state), data)

    return (
        jax.jit(jax.vmap(steps, in_axes=(axes, 0, None))),
        jax.jit(jax.vmap(mjx.forward, in_axes=(axes, 0))),
    )
