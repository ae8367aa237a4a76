"""Struts: loops that hold the distance of two points; what a file may say, a pendulum, every engine."""

from pathlib import Path
from typing import Any

import mechanism_runs as runs
import numpy as np
import pytest
from one_body_scenes import refusal
from scipy.integrate import solve_ivp

from proofroll.core.errors import Refused
from proofroll.elements.mechanism import Body, Joint, Loop, Mechanism, Tree
from proofroll.elements.mechanism.run.capabilities import required
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.truth.plug_in import MechanismTruth

ROUND = ((0.1, 0, 0), (0, 0.2, 0), (0, 0, 0.25))
STRUT = '[[loops]]\nname = "strut"\nkind = "distance"\nbody_a = "world"\nbody_b = "b"\nposition_a = [0, 0, 2]\n'


def hung() -> Mechanism:
    """A body of 2 kg whose centre of mass hangs on a strut of 1.25 m, displaced, while it tumbles."""
    joint = Joint("j", "free", "world", "b", q0=(0.75, 0, -1.0, 1, 0, 0, 0), v0=(0.4, 0, 0.3, 1, 2, 3))
    return Mechanism(
        (Body("b", 2.0, inertia=ROUND),), (joint,), (Loop("strut", "distance", "world", "b", length=1.25),)
    )


def braced() -> Mechanism:
    """Two arms on joints with skew axes whose ends a strut connects, off their centres of mass; it moves."""
    bodies = tuple(Body(name, 1.5, (0.2, 0.05, 0.1), ROUND) for name in "ab")
    joints = (
        Joint("ja", "revolute", "world", "a", axis=(0, 1, 0.2), q0=(0.3,), v0=(1.2,)),
        Joint("jb", "spherical", "world", "b", (1, 0.3, 0), q0=(0.9, 0.2, 0.1, 0.3), v0=(0, 0, 0)),
    )
    ends = (0.4, 0.1, 0.0), (-0.3, 0.1, 0.2)
    tree = Mechanism(bodies, joints)
    motion = Tree(tree).at(*tree.start())
    places = [motion.p_WB[k] + motion.R_WB[k] @ end for k, end in enumerate(ends)]
    length = float(np.linalg.norm(places[1] - places[0]))
    loop = Loop("strut", "distance", "a", "b", *ends, length=length)
    still = Mechanism(bodies, (joints[0], joints[1]), (loop,))
    rows = Tree(still).loop_rows(Tree(still).at(*still.start()))
    rates = -rows.C[0, 1:] * (rows.C[0, 0] * 1.2) / (rows.C[0, 1:] @ rows.C[0, 1:])
    moving = Joint("jb", "spherical", "world", "b", (1, 0.3, 0), q0=joints[1].q0, v0=tuple(rates))
    return Mechanism(bodies, (joints[0], moving), (loop,))


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ("", "loops.strut.length = 0.0: a distance loop needs one"),
        ("length = 1", "its points are 1 m farther apart than its length"),
        ("length = -1", "must be at least 0"),
    ],
)
def test_a_wrong_strut_gets_one_line(tmp_path: Path, lines: str, words: str) -> None:
    """A strut without a length, or that does not fit, is refused by one line."""
    assert words in refusal(tmp_path, "free", STRUT + lines)


def test_another_loop_has_no_length() -> None:
    """A length of a loop that holds no distance is refused."""
    with pytest.raises(Exception, match="a spherical loop has none"):
        Loop("l", "spherical", "world", "b", length=1.0)


@pytest.mark.drill
def test_a_body_on_a_strut_is_a_pendulum() -> None:
    """The centre of mass on a strut moves as a mathematical pendulum, with its tension, while the body tumbles."""
    mechanism, times = hung(), np.linspace(0.0, 1.0, 6)
    angle = np.arctan2(0.75, 1.0)
    solved = solve_ivp(lambda _, y: (y[1], -9.81 / 1.25 * np.sin(y[0])), (0, 1), (angle, 0.5 / 1.25), t_eval=times,
                       rtol=1e-12, atol=1e-12)  # fmt: skip
    content: Any = MechanismTruth.truth(MechanismElement(mechanism), times, ())
    swing, rate = solved.y
    places = 1.25 * np.stack([np.sin(swing), 0 * swing, -np.cos(swing)], axis=1)
    assert np.max(np.abs(content["p_WB"].to_numpy()[:, 0] - places)) < 1e-10
    tension = 2.0 * (9.81 * np.cos(swing) + 1.25 * rate**2)
    one, _ = runs.true(mechanism, 1.0)
    on_body = one.wrench[-1, 1, :3]
    assert on_body == pytest.approx(-tension[-1] * places[-1] / 1.25, abs=1e-8)


@pytest.mark.one_in(3)
@pytest.mark.parametrize("formulation", list(runs.FORMULATIONS))
def test_every_engine_holds_a_strut_or_refuses(formulation: str) -> None:
    """Motion and force of a strut in each engine are the truth's; or the engine refuses it."""
    mechanism = braced()
    engine, _ = runs.settings(formulation)
    if required(mechanism) - engine.provides[formulation]:
        with pytest.raises(Refused, match="loops closed by struts"):
            runs.build(formulation, mechanism)
        return
    truth, _ = runs.true(mechanism, 0.05)
    options = {"dt": 1e-4, "time_constant": 10.0} if formulation == "joints" else {}
    run = runs.build(formulation, mechanism, **options)
    assert run.built().mobility == 3
    run.advance(0.05)
    sample = run.sample()
    position, force = {"joints": (1e-7, 1e-4), "redundant": (1e-6, 1e-4)}.get(formulation, (1e-11, 1e-9))
    assert np.abs(sample.p_WB - truth.p_WB[-1]).max() < position
    assert np.abs(runs.wrench(sample)[2] - truth.wrench[-1, 2]).max() < force
