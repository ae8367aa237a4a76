"""Certificates under a hypothesis: what an engine says of time 0, held against what another model would say."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import Cause

# Differences that are left in units of what a line allows; an engine that is soft there says so in its tolerance.
_EXACT = 1e-6


def differing(lines: Iterable[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Lines of quantities that the engine says, and that are not the scene's."""
    return [line for line in lines if not line["holds"] and line["found"] and np.all(np.isfinite(line["found"]))]


def scale_of(line: Mapping[str, Any]) -> float:
    """What a line's difference is relative to, in its unit."""
    apart = float(np.max(np.abs(np.subtract(line["found"], line["expected"]))))
    return apart / line["difference"] if apart and line["difference"] else 1.0


def left(
    lines: Sequence[Mapping[str, Any]], expected: Mapping[str, Sequence[float]], given: Collection[str]
) -> FloatArray:
    """Relative differences of all that the engine says from what another model expects, one after the other.

    What it was ``given``, as a mass, and says to hold is left out: an adapter may say what it meant to build.
    """
    parts = [np.zeros(0)]
    for line in lines:
        if line["quantity"] in given and line["holds"]:
            continue
        want = np.asarray(expected.get(line["quantity"], line["expected"]), dtype=np.float64)
        got = np.asarray(line["found"], dtype=np.float64)
        if line["difference"] is None or got.shape != want.shape:
            continue
        known = np.isfinite(got) & np.isfinite(want)
        parts.append((got - want)[known] / scale_of(line) * (1 if line["tolerance"] <= _EXACT else 0))
    return np.concatenate(parts)


def single_precision(lines: Sequence[Mapping[str, Any]]) -> Iterator[Cause]:
    """The cause that the engine computes with 24 bits: what differs is the float32 of what is expected."""
    wrong = differing(lines)
    same = [np.array_equal(np.float32(line["expected"]), np.asarray(line["found"])) for line in wrong]
    exact = [line for line, alike in zip(wrong, same, strict=True) if alike and any(line["expected"])]
    if exact:
        before = max(line["difference"] for line in exact)
        name, says = str(exact[0]["quantity"]), "what the engine holds are single-precision numbers (float32)"
        remedy = "compute in double precision, or declare a tolerance of 1e-6 for what float32 cannot hold"
        yield Cause("float32", says, f"at time 0 {name}, relative", "1", before, 0.0, remedy)
