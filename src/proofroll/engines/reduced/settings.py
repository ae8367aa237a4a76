"""What a user can choose about the least model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from annotated_types import Gt

from proofroll.core.errors import InputError
from proofroll.elements.ball_on_surface.compiled.library import TIGHTEST

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
        rtol: relative tolerance of a step [-]; None in ``closed_form``.
    """

    formulation: Literal["equations", "closed_form"] = "equations"
    preset: Literal["matched", "tuned"] = "matched"
    integrator: Literal["dop853", "taylor"] | None = "dop853"
    rtol: Annotated[float, Gt(0)] | None = _TIGHTEST["dop853"]

    def __post_init__(self) -> None:
        """Refuses what the formulation does not have.

        Raises:
            InputError: a setting does not go with another.
        """
        if self.formulation == "closed_form":
            for name in ("integrator", "rtol"):
                if getattr(self, name) is not None:
                    advice = "a closed form is not integrated; leave it out, or take formulation=equations"
                    raise InputError(f"reduced: {name}", getattr(self, name), advice)
            return
        if self.integrator is None:
            raise InputError("reduced: integrator", None, f"choose one of {', '.join(_TIGHTEST)}")
        if self.rtol is None:
            raise InputError("reduced: rtol", None, f"{self.integrator} needs one, e.g. 1e-10")
        if self.rtol < _TIGHTEST[self.integrator]:
            advice = f"{self.integrator} allows no less than {_TIGHTEST[self.integrator]:.3g} in double precision"
            raise InputError("reduced: rtol", self.rtol, advice)

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
