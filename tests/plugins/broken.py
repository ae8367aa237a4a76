"""An engine with a choice of defects: the projection method on a slightly different scene, or with wrong samples.

``open_*`` defects show in the certificate. ``hidden_*`` defects do not: the engine reports the scene's own numbers,
starts rightly, and moves wrongly.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from placed_balls import gravity_of, placed, scene_with

from proofroll.core.arrays import FloatArray
from proofroll.core.gravity import Gravity
from proofroll.core.plugins import load_engine
from proofroll.core.scene import Scene
from proofroll.papers.blajer_2006.ball.as_body import RunOnBody, on_body
from proofroll.papers.blajer_2006.ball.sampling import BallBuilt, BallSample
from proofroll.papers.blajer_2006.projection.settings import ProjectionBallSettings

Projection = load_engine("projection")


def _ball(**factors: float) -> Callable[[Scene], Scene]:
    def change(scene: Scene) -> Scene:
        ball = placed(scene).ball
        values = {name: getattr(ball, name) * factor for name, factor in factors.items()}
        return scene_with(scene, ball=dataclasses.replace(ball, **values))

    return change


def _gravity(scene: Scene) -> Scene:
    return scene_with(scene, gravity=Gravity(gravity_of(scene).magnitude * 1.001, gravity_of(scene).direction))


def _resistance(scene: Scene) -> Scene:
    contact = dataclasses.replace(placed(scene).contact, rolling_resistance=0.0)
    return scene_with(scene, contact=contact)


def _same(scene: Scene) -> Scene:
    return scene


# Defect -> function that changes the scene before it is built.
BUILT: Mapping[str, Callable[[Scene], Scene]] = {
    "inertia": _ball(inertia_ratio=2.0),
    "gravity": _gravity,
    "radius": _ball(radius=1.001, inertia_ratio=1.001**-2),  # of the same inertia
    "mass": _ball(mass=1.001),
    "resistance": _resistance,
    "friction": _same,  # the reported friction has the wrong sign
    "rate": _same,  # the reported velocity is 0.01 % more than the rate of the position
    "period": _same,  # the position has an added oscillation that is zero at every hundredth of a second
    "clock": _same,  # the engine's time runs 0.1 % slow
    "none": _same,
}


@dataclass(frozen=True)
class BrokenSettings:
    """Settings; the formulation names the defect."""

    formulation: str = "open_none"
    preset: str = "matched"
    rtol: float = 1e-12

    @property
    def resolution(self) -> str:
        """See :class:`proofroll.core.engine.Settings`."""
        return "rtol"

    @property
    def order(self) -> int | None:
        """See :class:`proofroll.core.engine.Settings`."""
        return None


class Broken:
    """The projection method with a defect."""

    name: ClassVar[str] = "broken"
    settings: ClassVar[type[BrokenSettings]] = BrokenSettings
    presets: ClassVar[Mapping[str, Mapping[str, BrokenSettings]]] = {
        name: {"matched": BrokenSettings(name)}
        for name in [f"{kind}_{defect}" for kind in ("open", "hidden") for defect in BUILT]
    }
    provides: ClassVar[Mapping[str, frozenset[str]]] = dict.fromkeys(presets, Projection.provides["rotating_frame"])

    @staticmethod
    def version() -> str:
        """See :class:`proofroll.core.engine.Engine`."""
        return "1"

    @classmethod
    def build(cls, scene: Scene, settings: BrokenSettings) -> RunOnBody:
        """See :class:`proofroll.core.engine.Engine`."""
        return on_body(cls(scene, settings), scene)

    def __init__(self, scene: Scene, settings: BrokenSettings) -> None:
        kind, self.defect = settings.formulation.split("_")
        self.hidden = kind == "hidden"
        inner = ProjectionBallSettings(formulation="rotating_frame", rtol=settings.rtol)
        self.wrong = Projection.build(BUILT[self.defect](scene), inner).own
        self.right = Projection.build(scene, inner).own
        self.t = 0.0

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        self.t = t
        self.wrong.advance(t * 0.999 if self.defect == "clock" else t)

    def sample(self) -> BallSample:
        """See :class:`proofroll.core.engine.Engine`."""
        if self.hidden and self.t == 0:
            return self.right.sample()
        found = self.wrong.sample()
        if self.defect == "rate":
            return dataclasses.replace(found, v_WB=found.v_WB * 1.0001)
        if self.defect == "period":
            beat = 1e-5 * math.sin(200 * math.pi * self.t)
            return dataclasses.replace(found, p_WB=found.p_WB + np.array([0, 0, beat]))
        if self.defect != "friction" or found.force is None:
            return found
        return dataclasses.replace(found, force=self._reversed(found.p_WB, found.force))

    def _reversed(self, p_WB: FloatArray, force: FloatArray) -> FloatArray:
        e1 = p_WB * [1, 1, 0] / 0.2
        return 2 * (force @ e1) * e1 - force

    def built(self) -> BallBuilt:
        """See :class:`proofroll.core.engine.Engine`."""
        return (self.right if self.hidden else self.wrong).built()
