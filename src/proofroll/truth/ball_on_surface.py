"""The truth of a ball on a surface, as the harness asks for it."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.element import Element
from proofroll.core.errors import Diverged, InputError
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.element import BallOnSurface
from proofroll.elements.ball_on_surface.model import BallCapability
from proofroll.truth.onset import edge_between, onset
from proofroll.truth.truth import truth

if TYPE_CHECKING:
    import xarray as xr

_ILL_POSED = "the time of the first slip hangs on less than the parameters are known to"


class BallOnSurfaceTruth:
    """See :class:`proofroll.core.truth.ElementTruth`, :class:`proofroll.core.truth.FindsEdges`."""

    @staticmethod
    def covers(element: Element) -> bool:
        """Every ball on a surface."""
        return isinstance(element, BallOnSurface)

    @staticmethod
    def truth(element: Element, times: FloatArray, asks: Sequence[str]) -> xr.Dataset:
        """See :func:`proofroll.truth.truth.truth`; with bounded friction also the conditioning of the first slip."""
        scene = Scene(element.name, "", (element,), asks=tuple(asks))
        try:
            # What is not finite is refused by name; a warning before that says nothing more.
            with np.errstate(invalid="ignore", divide="ignore"):
                found = truth(scene, times)
        except ZeroDivisionError:
            said = "the ball comes to a point where its wall has no curvature, as at the apex of a cone"
            raise Diverged(f"{said}; start further off") from None
        if "sticking" in found and BallCapability.SLIPPING_START not in element.requires:
            first = onset(scene, float(times[-1]))
            found.attrs["onset"] = json.dumps(dataclasses.asdict(first))
            if first.verdict == "ill-posed":
                # Where the routes disagree too, they have said it, and from when on.
                found.attrs.setdefault("ill_posed", _ILL_POSED)
        return found

    @staticmethod
    def edge_between(element: Element, parameter: str, low: float, high: float, until: float) -> float | None:
        """A value of static friction at which the time of the first slip jumps, see :func:`proofroll.truth.onset`."""
        if parameter != "mu_static":
            raise InputError(parameter, "edge_between", "an edge can be found only for mu_static")
        return edge_between(Scene(element.name, "", (element,)), low, high, until)
