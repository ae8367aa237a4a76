"""Engines that move copies together: an honest one, and two whose copies disturb each other."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import fields
from typing import Any, ClassVar

import numpy as np

from proofroll.core.errors import Diverged
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.sampling import MechanismSample
from proofroll.engines.mujoco import Mujoco

BATCHES = {name: f"batched:{name.title()}" for name in ("batched", "mixing", "spreading")}


class Copies:
    """Copies of scenes, each a run of MuJoCo."""

    device = "cpu"

    def __init__(self, scenes: Sequence[Scene], pattern: Sequence[int], settings: Any) -> None:
        self.runs = [Mujoco.build(scenes[index], settings) for index in pattern]

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine_abilities.Batch`."""
        for run in self.runs:
            with suppress(Diverged):
                run.advance(t)

    def sample(self) -> MechanismSample:
        """See :class:`proofroll.core.engine_abilities.Batch`."""
        samples = [run.sample() for run in self.runs]
        names = [item.name for item in fields(samples[0]) if getattr(samples[0], item.name) is not None]
        return MechanismSample(**{name: np.stack([getattr(sample, name) for sample in samples]) for name in names})


class Batched(Mujoco):
    """MuJoCo with copies that move one beside the other."""

    name: ClassVar[str] = "batched"
    copies: ClassVar[type[Copies]] = Copies

    @classmethod
    def build_batch(cls, scenes: Sequence[Scene], pattern: Sequence[int], settings: Any) -> Copies:
        """See :class:`proofroll.core.engine_abilities.RunsBatches`."""
        return cls.copies(scenes, pattern, settings)


class MixedCopies(Copies):
    """Copies that each add a thousandth of their neighbour's angular velocity."""

    def sample(self) -> MechanismSample:
        """See :class:`proofroll.core.engine_abilities.Batch`."""
        sample = super().sample()
        sample.w_WB[1:] += 1e-3 * sample.w_WB[:-1]
        return sample


class SpreadCopies(Copies):
    """Copies that are all not finite where one of them is."""

    def sample(self) -> MechanismSample:
        """See :class:`proofroll.core.engine_abilities.Batch`."""
        sample = super().sample()
        if not np.all(np.isfinite(sample.v_WB)):
            sample.v_WB[:] = np.nan
        return sample


class Mixing(Batched):
    """Engine whose copies read a value of their neighbour."""

    name: ClassVar[str] = "mixing"
    copies: ClassVar[type[Copies]] = MixedCopies


class Spreading(Batched):
    """Engine in which one copy that is not finite spoils all."""

    name: ClassVar[str] = "spreading"
    copies: ClassVar[type[Copies]] = SpreadCopies
