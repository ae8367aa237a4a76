"""Three weights on a rope over a fixed and a movable pulley, as a double Atwood machine."""

from __future__ import annotations

from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.scene.drives import Coupling

MASSES = (4.0, 1.0, 2.0)
_MOMENTS = (0.01, 0.01, 0.01)


def one_rope() -> Mechanism:
    """The weights on slides of their own, whose coordinates one coupling of three joints relates."""
    bodies = tuple(Body(f"w{k}", mass, inertia=_MOMENTS) for k, mass in enumerate(MASSES))
    joints = tuple(Joint(f"x{k}", "prismatic", "world", body.name) for k, body in enumerate(bodies))
    return Mechanism(bodies, joints, couplings=(Coupling("rope", joints=("x0", "x1", "x2"), coefficients=(2, 1, 1)),))


def massless_pulley() -> Mechanism:
    """Two of the weights on slides of a pulley without mass, which hangs on the rope of the first."""
    first, *others = one_rope().bodies
    joints = (
        Joint("x0", "prismatic", "world", "w0"),
        Joint("p", "prismatic", "world", "pulley"),
        Joint("s1", "prismatic", "pulley", "w1"),
        Joint("s2", "prismatic", "pulley", "w2"),
    )
    ropes = (Coupling("upper", "x0", "p", -1.0), Coupling("lower", "s1", "s2", -1.0))
    return Mechanism((first, Body("pulley", 0.0), *others), joints, couplings=ropes)


def accelerations() -> tuple[float, float, float]:
    """Accelerations of the weights [m/s²], from their tensions T, T/2, T/2, upwards."""
    one, two, three = MASSES
    tension = 4 * 9.81 / (1 / two + 1 / three + 4 / one)
    return tension * 2 / one - 9.81, tension / two - 9.81, tension / three - 9.81
