"""Plug-ins by which a kind of element adds to the report of a comparison."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

from proofroll.core.entry_points import loaded

if TYPE_CHECKING:
    import xarray as xr

    from proofroll.core.observable import Observable
    from proofroll.core.scene import Scene
    from proofroll.report.comparison.plots import PointCurves
    from proofroll.report.comparison.records import ReportedComparison
    from proofroll.report.page.records import ReportedTruth
    from proofroll.report.pen import Picture
    from proofroll.report.replay.records import ReplayKind
    from proofroll.studies.comparison.outcome import Run

GROUP = "proofroll.report_kinds"
# Group of scenes whose kind names none.
OTHER = "other scenes"


@dataclass(frozen=True)
class EquationMatrices:
    """Terms of M v̇ + h + g = τ at the start.

    Attributes:
        velocities: names of the velocities v.
        M: mass matrix, (nv, nv); None: the engine does not give it.
        h: terms of velocities, (nv); None: as M.
        g: minus the weights, (nv); None: as M.
        differences: of M, h and g from the truth's, relative to the largest entry; empty for the truth itself.
    """

    velocities: list[str]
    M: list[list[float]] | None
    h: list[float] | None
    g: list[float] | None
    differences: dict[str, float]


class ReportKind(Protocol):
    """Additions to the report for scenes of one kind of element, besides verdicts and curves.

    Attributes:
        template: in the folder ``templates`` beside the class's module, with the macro
            ``truth(comparison, truth)``: facts of a truth besides its route; empty: none.
        names: additional names for the template; they must differ from those of other kinds.
        caption: text below the drawings.
        replay_script: script in the folder ``templates`` that draws the kind's replays in a browser; empty: none. Its
            input and output are described in ``replay.js``.
        groups: name of a group of scenes -> its title for a reader, and what its scenes are, as a clause.
    """

    template: ClassVar[str] = ""
    names: ClassVar[Mapping[str, Any]] = {}
    caption: ClassVar[str] = ""
    replay_script: ClassVar[str] = ""
    groups: ClassVar[Mapping[str, tuple[str, str]]] = {}

    @staticmethod
    def covers(scene: Scene) -> bool:
        """True if the kind covers all elements of the scene."""

    @staticmethod
    def group(scene: Scene) -> str:  # noqa: ARG004 -- for those who tell several apart
        """Name of the scene's group in one or two words, for the head of a column."""
        return OTHER

    @staticmethod
    def drawings(scenes: Sequence[Scene]) -> tuple[list[Picture], str]:
        """Drawings of a comparison's scene for all its cases; and the reason if there are none."""

    @staticmethod
    def truth_facts(scene: Scene, dataset: xr.Dataset) -> Any:  # noqa: ARG004 -- for those who have any
        """Facts of a truth besides its route and error bars: a record, or None."""
        return None

    @staticmethod
    def run_facts(truths: Sequence[ReportedTruth], runs: Sequence[Run]) -> Sequence[Any]:  # noqa: ARG004 -- as above
        """Facts of each run of a comparison besides its verdicts, a record or None each."""
        return [None] * len(runs)

    @staticmethod
    def curves(scene: Scene, truth: xr.Dataset) -> Sequence[Observable]:  # noqa: ARG004 -- as above
        """Curves over time besides the scene's own observables; each is part of a judged observable."""
        return ()

    @staticmethod
    def sentences(truths: Sequence[ReportedTruth]) -> Sequence[str]:  # noqa: ARG004 -- as above
        """Sentences on the truths of a comparison."""
        return ()

    @staticmethod
    def mark(content: ReportedComparison, curves: Sequence[PointCurves]) -> Sequence[PointCurves]:  # noqa: ARG004 -- as above
        """Curves of a comparison with the kind's marks added."""
        return curves

    @staticmethod
    def matrices(scene: Scene, built: Any) -> EquationMatrices | None:  # noqa: ARG004 -- for those who have any
        """Matrices of the equations of motion at the start, the engine's if ``built`` is its model; None: no such."""
        return None

    @staticmethod
    def replay() -> ReplayKind:
        """Drawing of the kind's scenes in the replay."""


@cache
def report_kinds() -> Mapping[str, type[ReportKind]]:
    """Report kinds that installed packages announce, by name."""
    return {point.name: kind for point, kind in loaded(GROUP, like=ReportKind)}


def kind_name(scene: Scene) -> str:
    """Name of the kind that covers the scene; empty without one."""
    return next((name for name, kind in report_kinds().items() if kind.covers(scene)), "")


def kind_of(scene: Scene) -> type[ReportKind] | None:
    """Kind that covers the scene, or None."""
    return report_kinds().get(kind_name(scene))


def group_words(group: str) -> tuple[str, str]:
    """Title of a group of scenes for a reader, and what its scenes are, as a clause."""
    named = {name: words for kind in report_kinds().values() for name, words in kind.groups.items()}
    return named.get(group, (group[:1].upper() + group[1:], ""))


def group_of(scene: Scene) -> str:
    """Group of a scene: a column of the matrix of engines and scenes."""
    kind = kind_of(scene)
    return OTHER if kind is None else kind.group(scene)
