"""Springs whose pull is a formula: their energy, their input, and the units of both routes."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from one_body_scenes import one_body, refusal

from proofroll.elements.mechanism import Body, Joint, Mechanism, Spring
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.spring_law import SpringLaw
from proofroll.truth.plug_in import MechanismTruth

STRUT = """q0 = 0.5
[[springs]]
name = "strut"
body_a = "world"
body_b = "b"
position_a = [0.2, 0, 0]
"""
CUBIC = """
[parameters.k3]
value = 400
unit = "N/m^3"
meaning = "cubic stiffness"
source = "s"
"""


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ('force = "= 3*x"', "springs.0.force = 'x': there is no such parameter; choose from"),
        ('force = "= 3*(L"', "springs.0.force"),
        ("force = 3", "give a formula of L and dL"),
        ('force = "= L > 1"', "springs.0.force"),
    ],
)
def test_a_wrong_formula_gets_one_line(tmp_path: Path, line: str, words: str) -> None:
    """A wrong formula of a spring is refused by one line that names its field."""
    assert words in refusal(tmp_path, "prismatic", STRUT + line)


def test_a_formula_takes_parameters_of_the_scene(tmp_path: Path) -> None:
    """A formula of a spring has the scene's parameters, and its other keys beside it."""
    law = 'stiffness = 20\nlength = 0.1\nforce = "= k3*(L - 0.1)^3 + 2*dL"'
    (spring,) = one_body(tmp_path, "prismatic", STRUT + law + CUBIC).springs
    assert spring.pull(0.3, 0.5) == pytest.approx(20 * 0.2 + 400 * 0.2**3 + 1.0)


def test_a_formula_of_length_keeps_energy() -> None:
    """A body on a gas spring with a cubic part keeps its energy with the integral of the pull, in both routes."""
    law = SpringLaw("k*(L - 0.4)^3 - 3/L^2", (("k", 50.0),))
    body = Body("b", 2.0, inertia=((0.1, 0, 0), (0, 0.2, 0), (0, 0, 0.3)))
    joint = Joint("j", "spherical", "world", "b", child_position=(0, 0, 0.5), v0=(1.0, -0.4, 2.0))
    spring = Spring("s", "world", "b", (0.3, 0.2, -0.6), (0.1, 0, 0), force=law)
    mechanism = Mechanism((body,), (joint,), springs=(spring,), gravity=(0, 0, 0))
    times = np.linspace(0.0, 1.0, 6)
    content: Any = MechanismTruth.truth(MechanismElement(mechanism), times, ())
    placed = Placed(mechanism, times, *(content[name].to_numpy() for name in ("p_WB", "v_WB", "w_WB", "q_WB")))
    length = np.linalg.norm(placed.point("b", (0.1, 0, 0)) - np.array(spring.position_a), axis=-1)
    energy = placed.energy() + 50.0 * (length - 0.4) ** 4 / 4 + 3 / length
    assert np.ptp(length) > 0.1
    assert np.max(np.abs(energy - energy[0])) < 1e-12
