"""Truth of a scene: the true motion of each of its elements, from the plug-in that covers it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import numpy as np

from proofroll.core.arrays import FloatArray, read_only
from proofroll.core.columns import Columns
from proofroll.core.dataset import BORDERS, ENDED, ENDS, LAWS, ended_early, joined, off_grid_apart
from proofroll.core.element import Element
from proofroll.core.entry_points import loaded
from proofroll.core.errors import InputError, Refused
from proofroll.core.pace import PACE
from proofroll.core.plugins import installed_steps
from proofroll.core.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

TRUTHS = "proofroll.truths"


class ElementTruth(Protocol):
    """Truth of a kind of element, found by two independent routes."""

    @staticmethod
    def covers(element: Element) -> bool:
        """True if this plug-in has the truth of the element."""

    @staticmethod
    def truth(element: Element, times: FloatArray, asks: Sequence[str]) -> xr.Dataset:
        """True run of an element: its variables, each with the attribute ``error_bar`` in its own unit.

        The attributes ``route`` and ``second_route`` name the two methods; ``ill_posed``, if present, says in a
        sentence why the motion depends on less than the accuracy of the parameters. A truth that is not known to the
        last time has the samples before its end alone, and says when and why it ends in the attributes
        :data:`proofroll.core.dataset.ENDS` [s] and :data:`proofroll.core.dataset.ENDED`. If the routes were held to
        the laws of mechanics, :data:`proofroll.core.dataset.LAWS` has the outcome.

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
    """Ability of a truth to find the parameter value at which the time of an event jumps."""

    @staticmethod
    def edge_between(element: Element, parameter: str, low: float, high: float, until: float) -> float | None:
        """Value of the parameter between ``low`` and ``high`` at which the time of an event jumps; None: there is none.

        Args:
            element: one that it covers, with any value of the parameter.
            parameter: name of the parameter in the scene.
            low: lower end of the search, in the parameter's unit.
            high: upper end of the search.
            until: last time at which the event is looked for [s].

        Raises:
            InputError: the truth finds no edges of this parameter.
        """


@runtime_checkable
class TakesSteps(Protocol):
    """Ability of a truth that has a reference by steps of engines for elements that its routes do not follow."""

    @staticmethod
    def by_steps(element: Element) -> bool:
        """True if no route follows an element, but runs of an engine with ever shorter steps may."""

    @staticmethod
    def reference(element: Element, times: FloatArray, engines: Sequence[str]) -> xr.Dataset:
        """Reference of an element, as a truth with an error bar.

        Args:
            element: one for which :meth:`by_steps` is true.
            times: of the samples [s], shape (time,).
            engines: ``name[formulation=…]`` of the reference and of its witness, or fewer.

        Raises:
            Refused: there is no engine for it; the text says why.
            Diverged: a run ends early.
        """


@cache
def load_truths() -> tuple[type[ElementTruth], ...]:
    """All truths that installed packages announce, by name."""
    return tuple(kind for _, kind in loaded(TRUTHS, like=ElementTruth))


_NONE = np.zeros(0)


def needs_steps(scene: Scene) -> bool:
    """True if the truth of a scene is a reference by steps of engines."""
    return any(_stepped(element) for element in scene.elements)


def truth(
    scene: Scene,
    asked: FloatArray,
    counting: FloatArray = _NONE,
    between: FloatArray = _NONE,
    engines: Sequence[str] = (),
) -> xr.Dataset:
    """True run of a scene, see :class:`ElementTruth`, with read-only arrays.

    No force couples the elements, so each is solved alone.

    Args:
        scene: the scene.
        asked: times of the samples [s].
        counting: further times at which turns are counted [s] (:func:`proofroll.core.whole_turns.samples_between`).
        between: times of samples off the grid [s] (:func:`proofroll.core.dataset.off_grid_apart`).
        engines: of a reference by steps, see :class:`TakesSteps`; empty: the installed ones that declare it.

    Raises:
        Refused: no truth covers an element.
        Diverged: two routes disagree.
    """
    times = np.union1d(asked, np.concatenate([counting, between])) if len(counting) or len(between) else asked
    PACE.until, PACE.over = float(times[-1]), False
    parts = {element.name: _of_element(element, times, scene, engines) for element in scene.elements}
    columns = joined(scene, _to_common_end({name: Columns.of(part) for name, part in parts.items()}))
    whole = (columns if times is asked else off_grid_apart(scene, columns, asked, between)).dataset()
    for name in ("route", "second_route", "ill_posed", LAWS):
        texts = dict.fromkeys(str(part.attrs[name]) for part in parts.values() if part.attrs.get(name))
        if texts:
            whole.attrs[name] = "; ".join(texts)
    if borders := [part.attrs[BORDERS] for part in parts.values() if BORDERS in part.attrs]:
        whole.attrs[BORDERS] = np.unique(np.concatenate(borders))
    read_only([variable.values for variable in whole.variables.values()])
    return whole


def _to_common_end(parts: dict[str, Columns]) -> dict[str, Columns]:
    """Parts cut to the end of the one that ends first, with when and why it ends."""
    early = [part for part in parts.values() if ended_early(part)]
    if not early or len(parts) == 1:
        return parts
    earliest = min(early, key=lambda part: float(part.attrs[ENDS]))
    end = {name: earliest.attrs[name] for name in (ENDS, ENDED)}
    cut = {}
    for name, part in parts.items():
        within = part.at("time", part["time"].values <= earliest["time"].values[-1]).assign(**end)
        if "event_time" in within:
            within = within.at("event", within["event_time"].values < float(earliest.attrs[ENDS]))
        cut[name] = within
    return cut


def edge_between(scene: Scene, parameter: str, low: float, high: float, until: float) -> float | None:
    """Parameter value of an edge for the first element whose truth finds edges, see :class:`FindsEdges`.

    Raises:
        InputError: no truth finds edges, or not of this parameter.
    """
    for element in scene.elements:
        for plug_in in load_truths():
            if plug_in.covers(element) and isinstance(plug_in, FindsEdges):
                return plug_in.edge_between(element, parameter, low, high, until)
    raise InputError(parameter, "edge_between", f"no truth of {scene.name} finds edges; give a number")


def _stepped(element: Element) -> bool:
    """True if the truth of an element is a reference by steps."""
    plug_in = next((item for item in load_truths() if item.covers(element)), None)
    return isinstance(plug_in, TakesSteps) and plug_in.by_steps(element)


def _of_element(element: Element, times: FloatArray, scene: Scene, engines: Sequence[str]) -> xr.Dataset:
    for plug_in in load_truths():
        if plug_in.covers(element):
            if isinstance(plug_in, TakesSteps) and plug_in.by_steps(element):
                return plug_in.reference(element, times, engines or installed_steps(scene.requires))
            return plug_in.truth(element, times, scene.asks)
    raise Refused(f"no truth by two routes covers {element.name} ({type(element).__name__})")
