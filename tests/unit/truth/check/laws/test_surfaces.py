"""Distances of shapes and their gradients."""

from __future__ import annotations

import numpy as np
import pytest

from proofroll.elements.mechanism.scene.shapes.geometry import Geometry
from proofroll.truth.check.laws.surfaces import near, shape_of


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(("kind", "sign"), [("sphere", 1.0), ("bowl", -1.0)])
def test_the_centre_of_a_sphere_has_no_normal(kind: str, sign: float) -> None:
    """A place at the centre has its distance and no gradient, without a warning."""
    shape = shape_of(Geometry(name="ball", body="ball", kind=kind, radius=0.5))
    distance, gradient = near(shape, np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 2.0]]))
    assert distance == pytest.approx([-sign * 0.5, sign * 1.5])
    assert np.all(np.isnan(gradient[0]))
    assert gradient[1] == pytest.approx([0.0, 0.0, sign])
