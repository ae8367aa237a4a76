"""Diagnosis of a ball: hypotheses of wrongly reported motion, and of wrong motion."""

from typing import Any

from proofroll.core.diagnosis.fitting import any_gravity
from proofroll.core.diagnosis.lines import built_otherwise
from proofroll.elements.ball_on_surface.diagnosis.contact_laws import CONTACT_LAWS
from proofroll.elements.ball_on_surface.diagnosis.equations import COVERED, GIVEN, falling, residuals_of
from proofroll.elements.ball_on_surface.diagnosis.numbers import NUMBERS
from proofroll.elements.ball_on_surface.diagnosis.reporting_errors import REPORTING_ERRORS

GRAVITY = any_gravity(residuals_of, lambda element: element.rolling.gravity, falling)
BUILT = built_otherwise(GIVEN, COVERED)
HYPOTHESES: tuple[Any, ...] = (*REPORTING_ERRORS, BUILT, *NUMBERS, *CONTACT_LAWS, GRAVITY)
