"""Work of drives in the truth of a mechanism."""

import numpy as np

from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.elements.mechanism.scene.signal import Formula


def test_the_work_of_a_drive_has_no_value_from_an_impact_on() -> None:
    """An impact on a plate that is driven upward does work by its impulse, which no integral over samples has."""
    bodies = (Body("plate", 1.0, inertia=(0.1, 0.1, 0.1)), Body("ball", 1.0, inertia=(0.004, 0.004, 0.004)))
    joints = (
        Joint("shake", "prismatic", "world", "plate", axis=(0, 0, 1), motion=Formula("0.2*t")),
        Joint("fall", "prismatic", "world", "ball", axis=(0, 0, 1), q0=(0.2,)),
    )
    shapes = (Geometry("floor", "plate", "plane"), Geometry("skin", "ball", "sphere", radius=0.1))
    mechanism = Mechanism(bodies, joints, geometries=shapes, pairs=(Pair("touch", ("skin", "floor"), friction=0.0),))
    scene = Scene("plate", "", (MechanismElement(mechanism),))
    found = truth(scene, np.linspace(0.0, 0.4, 9), ())
    (struck, *_) = found["event_time"].to_numpy()
    work = found["work.drive.shake"].to_numpy()
    assert np.array_equal(np.isfinite(work), found["time"].to_numpy() < struck)
    assert 0.0 < struck < 0.4
