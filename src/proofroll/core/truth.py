"""The truth of a scene: that of each of its elements, by the plug-in that covers it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import numpy as np

from proofroll.core.announced import loaded
from proofroll.core.arrays import FloatArray, read_only
from proofroll.core.columns import Columns
from proofroll.core.dataset import joined, off_grid_apart
from proofroll.core.element import Element
from proofroll.core.errors import InputError, Refused
from proofroll.core.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

TRUTHS = "proofroll.truths"


class ElementTruth(Protocol):
    """Knows the truth of a kind of element by two independent routes."""

    @staticmethod
    def covers(element: Element) -> bool:
        """True if the truth of this element is known to it."""

    @staticmethod
    def truth(element: Element, times: FloatArray, asks: Sequence[str]) -> xr.Dataset:
        """The true run: the element's variables, each with the attribute ``error_bar`` in its own unit.

        The attributes ``route`` and ``second_route`` name the two ways to it; ``ill_posed``, where there is one, says
        in a sentence why the answer hangs on less than the parameters are known to.

        Args:
            element: one that it covers.
            times: of the samples [s], shape (time,).
            asks: results wanted besides the motion.

        Raises:
            Refused: two routes do not cover this; the text says why.
            Diverged: the routes disagree.
        """


@runtime_checkable
class FindsEdges(Protocol):
    """Ability of a truth to find where the time of an event jumps as a parameter of the scene changes."""

    @staticmethod
    def edge_between(element: Element, parameter: str, low: float, high: float, until: float) -> float | None:
        """A value of the parameter between ``low`` and ``high`` at which the time jumps; None: there is none.

        Args:
            element: one that it covers, with any value of the parameter.
            parameter: of the scene.
            low: one of the values, in the parameter's unit.
            high: the other.
            until: last time at which the event is looked for [s].

        Raises:
            InputError: it finds no edges of this parameter.
        """


@cache
def load_truths() -> tuple[type[ElementTruth], ...]:
    """All truths that installed packages announce, by name."""
    return tuple(kind for _, kind in loaded(TRUTHS, like=ElementTruth))


_NONE = np.zeros(0)


def truth(scene: Scene, asked: FloatArray, counting: FloatArray = _NONE, between: FloatArray = _NONE) -> xr.Dataset:
    """The true run of a scene, see :class:`ElementTruth`. No force couples its elements, so each is solved alone.

    Its arrays are read-only; ``copy(deep=True)`` gives others.

    It is given at the times that are ``asked`` [s], and off that grid at those ``between``
    (:func:`proofroll.core.dataset.off_grid_apart`); turns are counted at those for ``counting`` too
    (:func:`proofroll.core.turns.samples_between`).

    Raises:
        Refused: an element that nothing covers.
        Diverged: two routes disagree.
    """
    times = np.union1d(asked, np.concatenate([counting, between])) if len(counting) or len(between) else asked
    parts = {element.name: _of_element(element, times, scene.asks) for element in scene.elements}
    columns = joined(scene, {name: Columns.of(part) for name, part in parts.items()})
    whole = (columns if times is asked else off_grid_apart(scene, columns, asked, between)).dataset()
    for name in ("route", "second_route", "ill_posed"):
        said = dict.fromkeys(str(part.attrs[name]) for part in parts.values() if part.attrs.get(name))
        if said:
            whole.attrs[name] = "; ".join(said)
    read_only([variable.values for variable in whole.variables.values()])
    return whole


def edge_between(scene: Scene, parameter: str, low: float, high: float, until: float) -> float | None:
    """An edge of the first element whose truth finds edges, see :class:`FindsEdges`.

    Raises:
        InputError: no truth does, or not of this parameter.
    """
    for element in scene.elements:
        for known in load_truths():
            if known.covers(element) and isinstance(known, FindsEdges):
                return known.edge_between(element, parameter, low, high, until)
    raise InputError(parameter, "edge_between", f"no truth of {scene.name} finds edges; give a number")


def _of_element(element: Element, times: FloatArray, asks: Sequence[str]) -> xr.Dataset:
    for known in load_truths():
        if known.covers(element):
            return known.truth(element, times, asks)
    raise Refused(f"no truth by two routes covers {element.name} ({type(element).__name__})")
