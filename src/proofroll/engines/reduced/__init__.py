"""The least model of a ball that rolls on a surface: a closed form, or five equations without constraints."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
from annotated_types import Gt

import proofroll
from proofroll.core.engine_abilities import Level, Term, require_provided
from proofroll.core.errors import refuse_first
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.compiled.library import TIGHTEST, with_heyoka
from proofroll.elements.ball_on_surface.element import rolling_ball
from proofroll.elements.ball_on_surface.model import ROLLS, BallCapability
from proofroll.engines.reduced.models import ClosedFormModel, Compiled, Integrated, ReducedModel

# What double precision, and scipy (it accepts nothing below 100 machine epsilons), leave of each method.
_TIGHTEST: Mapping[str, float] = {"dop853": 100 * float(np.finfo(float).eps), "taylor": TIGHTEST}


@dataclass(frozen=True)
class ReducedSettings:
    """Settings of the least model.

    Attributes:
        formulation: ``equations``, integrated, or ``closed_form``, where there is one.
        preset: where the other values come from.
        integrator: ``dop853`` (scipy, on any surface) or ``taylor`` (heyoka, compiled, on a cylinder or plane); None
            in ``closed_form``.
        rtol: relative tolerance of a step [1]; None in ``closed_form``.
    """

    formulation: Literal["equations", "closed_form"] = "equations"
    preset: Literal["matched", "tuned"] = "matched"
    integrator: Literal["dop853", "taylor"] | None = "dop853"
    rtol: Annotated[float, Gt(0)] | None = _TIGHTEST["dop853"]

    def __post_init__(self) -> None:
        """Raises InputError where the formulation has no such setting, or needs another value."""
        refuse_first("reduced", self, self._rules())

    def _rules(self) -> Iterator[tuple[bool, str, str]]:
        if self.formulation == "closed_form":
            advice = "a closed form is not integrated; leave it out, or take formulation=equations"
            yield self.integrator is not None, "integrator", advice
            yield self.rtol is not None, "rtol", advice
        else:
            yield self.integrator is None, "integrator", f"choose one of {', '.join(_TIGHTEST)}"
            yield self.rtol is None, "rtol", f"{self.integrator} needs one, e.g. 1e-10"
            assert self.integrator is not None  # the first rule broken ends this
            assert self.rtol is not None
            tightest = _TIGHTEST[self.integrator]
            advice = f"{self.integrator} allows no less than {tightest:.3g} in double precision"
            yield self.rtol < tightest, "rtol", advice

    @property
    def resolution(self) -> Literal["rtol"] | None:
        """The setting that trades speed for accuracy; a closed form has none."""
        return "rtol" if self.formulation == "equations" else None

    @property
    def order(self) -> int | None:
        """None: every step is adaptive."""
        return None


# There is no default: nobody writes these equations first. tuned is the same model, compiled.
PRESETS: Mapping[str, Mapping[str, ReducedSettings]] = {
    "equations": {
        "matched": ReducedSettings(),
        "tuned": ReducedSettings("equations", "tuned", "taylor", _TIGHTEST["taylor"]),
    },
    "closed_form": {"matched": ReducedSettings("closed_form", "matched", None, None)},
}


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
        require_provided(cls, settings.formulation, scene)
        body = rolling_ball(scene)
        if settings.rtol is None:
            return ClosedFormModel(body)
        return (Compiled if settings.integrator == "taylor" else Integrated)(body, settings.rtol)
