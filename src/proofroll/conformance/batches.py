"""Checks of batches: copies move as runs of their scenes do, and one that overflows disturbs no other."""

from collections.abc import Sequence
from dataclasses import fields, replace
from unittest import SkipTest

import numpy as np

from proofroll.conformance.subject import Subject, require
from proofroll.core.certificate import ROUNDINGS
from proofroll.core.engine import Sample
from proofroll.core.scene import Scene


def copies_move_as_runs(subject: Subject, scenes: Sequence[Scene]) -> None:
    """Check: each copy of a batch ends as a run of its scene alone, and copies of one scene end alike."""
    first_twins, last_twins = [0, 1], [1, 0]
    copies = _moved_as_runs(subject, scenes, first_twins + last_twins)
    for copy, twin in zip(copies[:2], reversed(copies[2:]), strict=True):
        apart = subject.distance(copy, twin)
        require(apart <= ROUNDINGS * subject.epsilon, f"two copies of one scene end {apart:.2g} apart (relative)")


def a_copy_that_overflows_stays_alone(subject: Subject, scenes: Sequence[Scene]) -> None:
    """Check: beside a copy whose numbers are not finite the others move as they do without it."""
    _, overflowing, _ = _moved_as_runs(subject, scenes, [0, len(scenes) - 1, 0])
    if np.all(np.isfinite(subject.scaled(overflowing))):
        raise SkipTest("the engine keeps velocities of any size finite")


def _moved_as_runs(subject: Subject, scenes: Sequence[Scene], pattern: Sequence[int]) -> list[Sample]:
    """Last samples of the copies of a batch; those that do not overflow must end as runs of their scenes alone."""
    t = subject.span(2)
    batch = subject.engine.build_batch([scene.for_an_engine for scene in scenes], pattern, subject.settings)
    require(isinstance(batch.device, str) and batch.device, "a batch names no device; give the place, as cpu")
    batch.advance(t / 2)
    batch.advance(t)
    sample = batch.sample()
    shape, count = np.shape(sample.p_WB), len(pattern)
    require(len(shape) == 3 and shape[0] == count, f"p_WB has the shape {shape} instead of ({count}, bodies, 3)")
    arrays = {item.name: getattr(sample, item.name) for item in fields(sample)}
    copies = []
    for number, index in enumerate(pattern):
        own_arrays = {name: None if values is None else values[number] for name, values in arrays.items()}
        copies.append(type(sample)(**own_arrays))
        if index == len(scenes) - 1:
            continue
        apart = subject.distance(copies[-1], replace(subject, scene=scenes[index]).at(t).sample())
        allowed = f"(relative, allowed {subject.closeness:.2g})"
        require(apart <= subject.closeness, f"copy {number} ends {apart:.2g} from a run of its scene alone {allowed}")
    return copies
