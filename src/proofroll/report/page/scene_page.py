"""Page of one scene: its start, its drawing and its parameters."""

from __future__ import annotations

from collections.abc import Sequence

from proofroll.report.page.scene_sheet import scene_sheet
from proofroll.report.pages import environment, rendered


def scene_page(scene: str, start: Sequence[str]) -> str:
    """The page of a scene with sentences on its start; everything from the scene's file is escaped."""
    return rendered(environment(), "scene_page.html", sheet=scene_sheet(scene, []), start=start)
