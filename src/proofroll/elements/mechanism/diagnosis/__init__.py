"""Why the run of a mechanism is not the scene's: what an engine says otherwise, and what it moves instead."""

from __future__ import annotations

from typing import Any

from proofroll.elements.mechanism.diagnosis.laws import LAWS
from proofroll.elements.mechanism.diagnosis.said import SAID

HYPOTHESES: tuple[Any, ...] = (*SAID, *LAWS)
