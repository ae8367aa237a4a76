"""Honest engines of several orders: textbook methods on the scene's own equations, with no errors but their own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from annotated_types import Gt
from scipy.integrate import solve_ivp
from tiny import Tiny

from proofroll.core.arrays import FloatArray
from proofroll.core.engine import whole_steps
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.contact.tree_contacts import ContactDynamics
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.elements.mechanism.run.sampling import MechanismBuilt, MechanismSample
from proofroll.engines.projection import Projection

# Order -> Runge-Kutta tableau: weights of earlier stages for each stage, and weights of all stages.
TABLEAUS: Mapping[int, tuple[list[list[float]], list[float]]] = {
    1: ([[]], [1.0]),
    2: ([[], [0.5]], [0.0, 1.0]),
    3: ([[], [0.5], [-1.0, 2.0]], [1 / 6, 2 / 3, 1 / 6]),
    4: ([[], [0.5], [0.0, 0.5], [0.0, 0.0, 1.0]], [1 / 6, 1 / 3, 1 / 3, 1 / 6]),
}
# Methods of other kinds, with their orders: semi-implicit and implicit Euler, implicit midpoint, and Adams-Bashforth of
# two steps.
_ROUNDS = 20  # of the fixed-point iteration of an implicit step
ORDERS = {"semi_implicit": 1, "implicit_euler": 1, "implicit": 2, "multistep": 2}


@dataclass(frozen=True)
class HonestSettings:
    """Settings; the formulation names the method."""

    formulation: str = "order_4"
    preset: str = "matched"
    dt: Annotated[float, Gt(0)] = 1e-3
    rtol: Annotated[float, Gt(0)] = 1e-10

    @property
    def resolution(self) -> str:
        """See :class:`proofroll.core.engine.Settings`."""
        return "rtol" if self.formulation == "adaptive" else "dt"

    @property
    def order(self) -> int | None:
        """See :class:`proofroll.core.engine.Settings`."""
        return ORDERS.get(self.formulation) or (None if self.formulation == "adaptive" else min(self.orders))

    @property
    def orders(self) -> tuple[int, ...]:
        """Orders of the methods that alternate from step to step."""
        return (1, 4) if self.formulation == "mixed" else (int(self.formulation[-1]),)


def _stepped(x: FloatArray, rates: Any, settings: HonestSettings, t: float, until: float, nq: int = 0) -> FloatArray:
    """State at the time ``until``, by alternating methods of fixed step or by DOP853; its first ``nq`` are places."""
    if settings.formulation == "adaptive":
        found = solve_ivp(lambda _, y: rates(y), (t, until), x, "DOP853", rtol=settings.rtol, atol=settings.rtol)
        return np.asarray(found.y[:, -1])
    before: FloatArray | None = None
    for step in range(whole_steps(t, until, settings.dt)):
        if settings.formulation in ORDERS:
            slope = _slope(x, rates, settings, before, nq)
            before = rates(x)
        else:
            slope = _weighted(x, rates, settings, TABLEAUS[settings.orders[step % len(settings.orders)]])
        x = x + settings.dt * slope
    return x


def _weighted(
    x: FloatArray, rates: Any, settings: HonestSettings, tableau: tuple[list[list[float]], list[float]]
) -> Any:
    """Mean slope of a step by a Runge-Kutta method."""
    slopes: list[FloatArray] = []
    for before in tableau[0]:
        moved = (settings.dt * w * k for w, k in zip(before, slopes, strict=True))
        slopes.append(rates(x + sum(moved, np.zeros_like(x))))
    return sum((w * k for w, k in zip(tableau[1], slopes, strict=True)), np.zeros_like(x))


def _slope(x: FloatArray, rates: Any, settings: HonestSettings, before: FloatArray | None, nq: int) -> Any:
    """Mean slope of a step by one of :data:`ORDERS`; ``before``: slope at the start of the step before, if any."""
    now = rates(x)
    if settings.formulation == "semi_implicit":
        later = rates(x + settings.dt * np.concatenate([np.zeros(nq), now[nq:]]))
        return np.concatenate([later[:nq], now[nq:]])
    if settings.formulation == "multistep" and before is not None:
        return (3 * now - before) / 2
    middle, part = now, 1.0 if settings.formulation == "implicit_euler" else 0.5
    for _ in range(1 if settings.formulation == "multistep" else _ROUNDS):
        middle = rates(x + part * settings.dt * middle)
    return middle


FORMULATIONS = (*(f"order_{order}" for order in TABLEAUS), "adaptive", "mixed")
ALL_KINDS = (*FORMULATIONS, *ORDERS)


class Rolling(Tiny):
    """A rolling ball in the reduced coordinates."""

    name: ClassVar[str] = "rolling"
    provides: ClassVar[Mapping[str, frozenset[str]]] = dict.fromkeys(FORMULATIONS, Tiny.provides["midpoint"])
    settings: ClassVar[type[Any]] = HonestSettings
    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        name: {"matched": HonestSettings(name)} for name in FORMULATIONS
    }

    def __init__(self, scene: Scene, settings: Any) -> None:
        super().__init__(scene, settings)
        self.chosen = settings

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        self.x = _stepped(self.x, self.rates, self.chosen, self.t, t)
        self.t = t


class Jointed:
    """A tree of joints with one coordinate each, in joint coordinates; reports no reactions."""

    name: ClassVar[str] = "jointed"
    provides: ClassVar[Mapping[str, frozenset[str]]] = dict.fromkeys(
        ALL_KINDS, Projection.provides["dependent"] - {"dry friction in joints", "stops of joints"}
    )
    settings: ClassVar[type[Any]] = HonestSettings
    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {name: {"matched": HonestSettings(name)} for name in ALL_KINDS}

    @staticmethod
    def version() -> str:
        """See :class:`proofroll.core.engine.Engine`."""
        return "1"

    @classmethod
    def build(cls, scene: Scene, settings: Any) -> Self:
        """See :class:`proofroll.core.engine.Engine`."""
        return cls(scene, settings)

    def __init__(self, scene: Scene, settings: Any) -> None:
        self.mechanism = scene.elements[0].mechanism  # type: ignore[attr-defined]  # it has one
        self.equations, self.chosen, self.t = JointCoordinates(self.mechanism), settings, 0.0
        self.x = np.concatenate(self.mechanism.start())

    def _halves(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        half = len(x) // 2
        return x[:half], x[half:]

    def _rates(self, x: FloatArray) -> FloatArray:
        q, v = self._halves(x)
        return np.concatenate([v, self.equations.solve(q, v).acceleration])

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        self.x = _stepped(self.x, self._rates, self.chosen, self.t, t, self.mechanism.nq)
        self.t = t

    def sample(self) -> MechanismSample:
        """See :class:`proofroll.core.engine.Engine`."""
        from scipy.spatial.transform import Rotation

        motion = self.equations.tree.at(*self._halves(self.x))
        turned = Rotation.from_matrix(motion.R_WB[:-1]).as_quat(scalar_first=True)
        return MechanismSample(motion.p_WB[:-1], motion.v_WB[:-1], motion.w_WB[:-1], turned)

    def built(self) -> MechanismBuilt:
        """See :class:`proofroll.core.engine.Engine`; its first acceleration is derived from its steps."""
        return MechanismBuilt(gravity=np.asarray(self.mechanism.gravity))


class Switching(Jointed):
    """A mechanism with efforts at their limits, a stop, or contacts that slide; no event is located.

    An impact on a stop acts at the end of an interval of ``dt``, also with an adaptive method.
    """

    name: ClassVar[str] = "switching"
    provides: ClassVar[Mapping[str, frozenset[str]]] = dict.fromkeys(ALL_KINDS, frozenset(MechanismCapability))

    def __init__(self, scene: Scene, settings: Any) -> None:
        super().__init__(scene, settings)
        self.contacts = ContactDynamics(self.mechanism) if self.mechanism.contacts else None
        self.mode: Any = self.contacts.begin()[0] if self.contacts else ("free",) * len(self.equations.switched)
        self.between = settings.dt if self.equations.switched else np.inf

    def _rates(self, x: FloatArray) -> FloatArray:
        if self.contacts:
            return np.asarray(self.contacts.rate(np.append(x, self.t), self.mode)[:-1])
        return np.asarray(self.equations.rate(self.t, x, self.mode or None))

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        pieces = max(1, round((t - self.t) / self.between))
        for end in np.linspace(self.t, t, pieces + 1)[1:]:
            super().advance(float(end))
            for joint in self.equations.switched:
                at = self.mechanism.nq + joint.velocity
                if self.x[joint.coordinate] <= joint.low and self.x[at] < 0:
                    self.x[at] *= -joint.restitution

    def _halves(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        nq = self.mechanism.nq
        return self.equations.tree.normalised(x[:nq]), x[nq:]
