"""Mechanisms in the report of a comparison."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

from proofroll.core.scene import Scene
from proofroll.elements.mechanism.element import MechanismElement
from proofroll.report.kinds import ReportKind

if TYPE_CHECKING:
    import xarray as xr

    from proofroll.core.observable import Observable
    from proofroll.report.pen import Picture
    from proofroll.report.replay_records import ReplayKind


class MechanismReport(ReportKind):
    """See :class:`proofroll.report.kinds.ReportKind`."""

    replay_script: ClassVar[str] = "replay_mechanism.js"
    caption: ClassVar[str] = (
        "At the start, to scale. Filled dots are centres of mass, with a line to all that is fastened to the body; "
        "circles are joints, dashed circles the loops that close the tree, zigzags springs, coloured circles the "
        "tracked points."
    )

    @staticmethod
    def covers(scene: Scene) -> bool:
        """One mechanism alone."""
        return len(scene.elements) == 1 and isinstance(scene.elements[0], MechanismElement)

    @staticmethod
    def drawings(scenes: Sequence[Scene]) -> tuple[list[Picture], str]:
        """The first case at its start."""
        from proofroll.elements.mechanism.report.drawing import drawn

        element = scenes[0].elements[0]
        assert isinstance(element, MechanismElement)  # it covers no other
        return [drawn(element).picture("at the start")], ""

    @staticmethod
    def curves(scene: Scene, truth: xr.Dataset) -> Sequence[Observable]:
        """Forces and torques of joints and loops; their arrays are judged as a whole."""
        from proofroll.elements.mechanism.report.reactions import reactions

        element = scene.elements[0]
        assert isinstance(element, MechanismElement)  # it covers no other
        return reactions(element, truth)

    @staticmethod
    def replay() -> ReplayKind:
        """Bodies and joints in motion."""
        from proofroll.elements.mechanism.report.replay import drawn, seen
        from proofroll.report.replay_records import ReplayKind

        return ReplayKind("mechanism", seen, drawn)
