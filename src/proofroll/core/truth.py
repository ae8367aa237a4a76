"""The truth of a scene: that of each of its elements, by the plug-in that covers it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from importlib.metadata import entry_points
from typing import TYPE_CHECKING, Protocol

from proofroll.core.arrays import FloatArray
from proofroll.core.dataset import joined
from proofroll.core.element import Element
from proofroll.core.errors import Refused
from proofroll.core.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

TRUTHS = "proofroll.truths"


class ElementTruth(Protocol):
    """Knows the truth of a kind of element by two independent routes."""

    @staticmethod
    def covers(element: Element) -> bool:
        """Whether it knows the truth of this element."""

    @staticmethod
    def truth(element: Element, times: FloatArray, asks: Sequence[str]) -> xr.Dataset:
        """The true run: the element's variables, each with the attribute ``error_bar`` in its own unit.

        The attributes ``route`` and ``second_route`` name the two ways to it; ``ill_posed``, where there is one, says
        in a sentence why the answer hangs on less than the parameters are known to.

        Args:
            element: one that it covers.
            times: of the samples [s], shape (time,).
            asks: what is wanted besides the motion.

        Raises:
            Refused: two routes do not cover this; the text says why.
            Diverged: the routes disagree.
        """


@cache
def load_truths() -> tuple[type[ElementTruth], ...]:
    """All that some installed package announces, by name."""
    return tuple(point.load() for point in sorted(entry_points(group=TRUTHS), key=lambda point: point.name))


def truth(scene: Scene, times: FloatArray) -> xr.Dataset:
    """The true run of a scene, see :class:`ElementTruth`. No force couples its elements, so each is solved alone.

    Raises:
        Refused: an element that nothing covers.
        Diverged: two routes disagree.
    """
    parts = {element.name: _of_element(element, times, scene.asks) for element in scene.elements}
    whole = joined(scene, parts)
    for name in ("route", "second_route", "ill_posed"):
        said = dict.fromkeys(str(part.attrs[name]) for part in parts.values() if part.attrs.get(name))
        if said:
            whole.attrs[name] = "; ".join(said)
    return whole


def _of_element(element: Element, times: FloatArray, asks: Sequence[str]) -> xr.Dataset:
    for known in load_truths():
        if known.covers(element):
            return known.truth(element, times, asks)
    raise Refused(f"no truth by two routes covers {element.name} ({type(element).__name__})")
