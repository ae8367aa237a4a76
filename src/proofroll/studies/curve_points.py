"""A point of a curve with its errors against the truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from proofroll.core.arrays import largest_difference
from proofroll.files.trajectory_file import read
from proofroll.running.case import Status
from proofroll.running.runner import Runner
from proofroll.studies.curve import CurvePoint
from proofroll.studies.reference import Reference


def judged(points: Sequence[CurvePoint], references: Mapping[float, Reference], runner: Runner) -> CurvePoint:
    """The point with its observables and their errors, if it has a trajectory that reached the end.

    Args:
        points: the run, and the one over few samples if there is one.
        references: the truth by sampling interval.
        runner: where the trajectories are.
    """
    point, *others = (_measured(point, references[point.case.every], runner) for point in points)
    if not others:
        return point
    (sparse,) = others
    reference = references[sparse.case.every]
    # What is derived from neighbouring samples, as an audit, is not compared where there are few.
    errors = {
        name: max(error, sparse.errors.get(name, np.inf)) if name in reference.dataset else error
        for name, error in point.errors.items()
    }
    return replace(point, errors=errors, dense=point.errors, sparse=sparse)


def _measured(point: CurvePoint, reference: Reference, runner: Runner) -> CurvePoint:
    if point.result.status != Status.DONE:
        return point
    curves = reference.observed(read(runner.store.trajectory(point.case)))
    errors, bars = {}, {}
    for name, curve in curves.items():
        true, bar = reference.true(name, curve)
        errors[name], bars[name] = largest_difference(curve, true), bar
    return replace(point, curves=curves, errors=errors, bars=bars)
