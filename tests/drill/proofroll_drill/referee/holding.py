"""Truths of random mechanisms held against the referee: every error in parts of its own bar."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from proofroll.core.errors import ProofrollError
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.assembly import check_start
from proofroll.elements.mechanism.record import Record
from proofroll.elements.mechanism.rotations import Array
from proofroll.truth.mechanism.two_routes import find_truth

from .random_mechanisms import random_mechanism
from .solver import Referee

UNTIL = 0.2  # s


@dataclass(frozen=True)
class Held:
    """One mechanism.

    Attributes:
        seed, style: which.
        kinds: of its joints, then of its loops.
        refused: why there is no truth; empty if there is one.
        worst: largest error of each quantity, in parts of its bar.
        determinate: how many components of reactions were compared.
    """

    seed: int
    style: str
    kinds: str
    refused: str
    worst: dict[str, float]
    determinate: int

    @property
    def sound(self) -> bool:
        """True if there is a truth, and no error beyond its bar."""
        return not self.refused and all(value <= 1 for value in self.worst.values())

    @property
    def text(self) -> str:
        """One line for a person."""
        largest = max(self.worst, key=lambda name: self.worst[name], default="")
        found = self.refused or f"largest error {self.worst[largest]:.2g} of its bar, {largest}"
        return f"{self.seed} {self.style} ({self.kinds}): {found}"


def hold(seed: int, until: float = UNTIL) -> Held:
    """The truth of a random mechanism against the referee's at three times from 0 until one [s]."""
    style, mechanism = random_mechanism(seed)
    kinds = " ".join(c.kind for c in mechanism.connections)
    times = np.array([0.0, until / 2, until])
    try:
        check_start(mechanism)
        found = find_truth(mechanism, times)
    except ProofrollError as error:
        return Held(seed, style, kinds, str(error), {}, 0)
    worst = {}
    for name, size in errors(mechanism, found.record, found.determinate).items():
        beyond = size > 0
        worst[name] = float((size[beyond] / found.bars[name][beyond]).max(initial=0))
    return Held(seed, style, kinds, "", worst, int(found.determinate.sum()))


def errors(mechanism: Mechanism, record: Record, determinate: NDArray[np.bool_]) -> dict[str, Array]:
    """Largest difference of each quantity of a record from the referee's at each time."""
    seen = Referee(mechanism).run(record.time)
    placed = record.placed(mechanism)
    slices = zip(mechanism.joints, mechanism.q_slices, strict=True)
    angles = [at.start + n for j, at in slices if j.kind in {"revolute", "universal"} for n in range(j.nq)]
    wrench = [[np.where(determinate, value, 0) for value in values]
              for values in (record.wrench, (one["wrench"] for one in seen))]  # fmt: skip
    # a rotation matrix differs by up to four times as much as its quaternion
    pairs: dict[str, tuple[Any, Any]] = {
        "p_WB": (record.p_WB, [one["p_WB"] for one in seen]),
        "v_WB": (record.v_WB, [one["v_WB"] for one in seen]),
        "w_WB": (record.w_WB, [one["w_WB"] for one in seen]),
        "q_WB": (placed.R_WB[:, :-1] / 4, [one["R_WB"] / 4 for one in seen]),
        "energy": (placed.energy(), [one["energy"] for one in seen]),
        "q": (record.q[:, angles], [one["angles"] for one in seen]),
        "wrench": (wrench[0], wrench[1]),
    }
    return {
        name: np.array([float(np.abs(a - b).max(initial=0)) for a, b in zip(given, true, strict=True)])
        for name, (given, true) in pairs.items()
    }
