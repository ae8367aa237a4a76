"""Why a ball's run is not the scene's: what an engine says otherwise, and by which other laws it moves."""

from __future__ import annotations

from typing import Any

from proofroll.elements.ball_on_surface.diagnosis.said import SAID
from proofroll.elements.ball_on_surface.diagnosis.scene import LAWS

HYPOTHESES: tuple[Any, ...] = (*SAID, *LAWS)
