"""Diagnosis of a ball: wrong reports of a right motion, and wrong motions."""

from __future__ import annotations

from typing import Any

from proofroll.core.diagnosis.fitting import any_gravity
from proofroll.core.diagnosis.lines import built_otherwise
from proofroll.elements.ball_on_surface.diagnosis.contact_laws import CONTACT_LAWS
from proofroll.elements.ball_on_surface.diagnosis.equations import COVERED, GIVEN, falling, held_against
from proofroll.elements.ball_on_surface.diagnosis.numbers import NUMBERS
from proofroll.elements.ball_on_surface.diagnosis.said import SAID

GRAVITY = any_gravity(held_against, lambda element: element.rolling.gravity, falling)
BUILT = built_otherwise(GIVEN, COVERED)
HYPOTHESES: tuple[Any, ...] = (*SAID, BUILT, *NUMBERS, *CONTACT_LAWS, GRAVITY)
