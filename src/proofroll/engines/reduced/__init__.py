"""The least model of a ball that rolls on a surface: a closed form, or five equations without constraints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import proofroll
from proofroll.core.engine_abilities import Level, Term
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.compiled.library import with_heyoka
from proofroll.elements.ball_on_surface.element import rolling_ball
from proofroll.elements.ball_on_surface.model import ROLLS, BallCapability
from proofroll.engines.reduced.models import ClosedFormModel, Compiled, Integrated, ReducedModel
from proofroll.engines.reduced.settings import PRESETS, ReducedSettings


class Reduced:
    """The scene's least model: a closed form, or five equations of motion with no constraint left.

    It shares the closed form and the equations with the truth's first route (:mod:`rolling_equations`), so agreement
    with the truth is news only as far as the truth's second route, which shares neither, agrees too.
    """

    name: ClassVar[str] = "reduced"
    provides: ClassVar[Mapping[str, frozenset[str]]] = {
        "equations": ROLLS | {BallCapability.MOVING_WALL},
        "closed_form": (ROLLS | {BallCapability.MOVING_WALL}) - {BallCapability.ROLLING_RESISTANCE},
    }
    lacking: ClassVar[Mapping[str, Mapping[str, str]]] = {
        "closed_form": {
            BallCapability.ROLLING_RESISTANCE: "there is no closed form with rolling resistance; "
            "take formulation=equations"
        }
    }
    settings: ClassVar[type[ReducedSettings]] = ReducedSettings
    presets: ClassVar[Mapping[str, Mapping[str, ReducedSettings]]] = PRESETS
    levels: ClassVar[Mapping[str, Level]] = {"equations": Level.REDUCED, "closed_form": Level.CLOSED_FORM}
    shares: ClassVar[Mapping[str, Sequence[str]]] = {
        "equations": (
            "reduced equations",
            "surface coordinates with direction of slip",
            "local frame with direction of slip",
        ),
        "closed_form": ("closed form",),
    }
    terms: ClassVar[Sequence[Term]] = ()  # the least model has nothing left to switch off

    @staticmethod
    def version() -> str:
        """The equations are part of proofroll; heyoka integrates them where it is installed."""
        return with_heyoka(proofroll.__version__)

    @classmethod
    def build(cls, scene: Scene, settings: ReducedSettings) -> ReducedModel:
        """See :class:`proofroll.core.engine.Engine`; what it builds is a run of one of the models."""
        body = rolling_ball(scene)
        if settings.rtol is None:
            return ClosedFormModel(body)
        return (Compiled if settings.integrator == "taylor" else Integrated)(body, settings.rtol)
