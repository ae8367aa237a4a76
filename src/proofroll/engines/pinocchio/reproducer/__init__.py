"""Writes the program that shows what Pinocchio does with a ball on a wall, without proofroll.

A program is put together from the text of a formulation (:mod:`contact`, :mod:`rows`) and, for those with rows, of an
integrator (:mod:`stepping`); numbers come from the adapter's own model.
"""

from __future__ import annotations

import math

from proofroll.core.errors import Refused
from proofroll.core.program_text import assigned
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.reproducer_source import ball_numbers, normal_rate_source, wall_source
from proofroll.engines.pinocchio.reproducer import contact, rows, stepping
from proofroll.engines.pinocchio.rows_run import RowsRun
from proofroll.engines.pinocchio.settings import PinocchioSettings

_ADAPTIVE = """from collections.abc import Callable, Iterable, Iterator
from typing import Any
from scipy.integrate import DOP853
"""


def source(body: RollingBall, settings: PinocchioSettings) -> str:
    """See :class:`proofroll.core.engine_abilities.Reproduces`; the settings say whether the orientation is integrated.

    Raises:
        Refused: the scene or the settings have something that the program has not.
    """
    if settings.formulation == "contact":
        numbers, parts = contact.numbers(body, settings), [contact.SOURCE]
        imports = "import numpy as np\nimport pinocchio as pin\n\n"
    else:
        if math.isfinite(body.contact.mu_static):
            raise Refused("the loop that switches between stick and slip around Pinocchio's terms is proofroll's")
        mechanism = RowsRun(body, settings).mechanism
        numbers, program = stepping.numbers(mechanism, settings), rows.FREE_FLYER
        if settings.formulation == "composite":
            numbers, program = numbers + rows.carriage(body), rows.COMPOSITE
        parts = [program, stepping.source(settings)]
        imports = "import numpy as np\nimport pinocchio as pin\n"
        imports += (_ADAPTIVE if settings.integrator == "dop853" else "") + "\n"
    return "".join(
        [
            imports,
            assigned(**ball_numbers(body), LEVER=body.contact.rolling_resistance),
            numbers,
            wall_source(body),
            normal_rate_source(body),
            *parts,
        ]
    )
