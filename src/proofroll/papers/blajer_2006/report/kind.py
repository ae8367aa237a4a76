"""Balls on surfaces in the report of a comparison."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

from proofroll.core.scene import Scene
from proofroll.elements.mechanism.report.kind import MechanismReport
from proofroll.papers.blajer_2006.ball.as_body import ball_of, rolling_ball
from proofroll.papers.blajer_2006.report import onsets
from proofroll.report.kinds import ReportKind

if TYPE_CHECKING:
    from proofroll.report.pen import Picture
    from proofroll.report.replay.records import ReplayKind


class BallReport(ReportKind):
    """See :class:`proofroll.report.kinds.ReportKind`."""

    template: ClassVar[str] = "slips.html"
    names: ClassVar[Mapping[str, Any]] = {"onsets": onsets}
    replay_script: ClassVar[str] = "replay_ball.js"
    caption: ClassVar[str] = (
        "First the whole, to scale; then the ball enlarged, with its local frame at the contact: e₁ into the wall, e₂ "
        "and e₃ along its coordinates. N, F₂, F₃ are drawn as forces on the ball, in their positive sense."
    )

    @staticmethod
    def covers(scene: Scene) -> bool:
        """True if one ball in an upright cylinder is the scene's only element."""
        (element,) = scene.elements if len(scene.elements) == 1 else (None,)
        return element is not None and ball_of(element) is not None

    group = staticmethod(MechanismReport.group)

    @staticmethod
    def drawings(scenes: Sequence[Scene]) -> tuple[list[Picture], str]:
        """Drawings that serve all cases; they show rolling resistance if some case has it."""
        from proofroll.papers.blajer_2006.report.drawings import overview

        shown = max((rolling_ball(scene) for scene in scenes), key=lambda body: body.contact.rolling_resistance)
        labels = ("as a whole", "where the ball touches the wall")
        pictures = [item.picture(label) for item, label in zip(overview(shown.wall, shown), labels, strict=False)]
        return pictures, ""

    truth_facts = staticmethod(onsets.truth_facts)
    run_facts = staticmethod(onsets.run_facts)
    sentences = staticmethod(onsets.ill_posed)
    mark = staticmethod(onsets.mark)

    @staticmethod
    def replay() -> ReplayKind:
        """Drawing of balls on their wall in the replay."""
        from proofroll.papers.blajer_2006.report.replay import draw_ball, readings, seen
        from proofroll.report.replay.records import ReplayKind

        return ReplayKind(name="ball", seen=seen, draw=draw_ball, readings=readings)
