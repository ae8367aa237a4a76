"""The referee: that both routes start where it does, that truths hold against it, and that it notices a wrong one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.start import check_contacts
from proofroll.elements.mechanism.dynamics.analysis import analyse
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.dynamics.record import Record, record_of
from proofroll.elements.mechanism.reading.assembly import check_start
from proofroll.elements.mechanism.scene.joint_kinds import FACTS
from proofroll.truth.bodies import maximal_taylor
from proofroll.truth.bodies.maximal_bodies import Planar, made_bodies
from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates
from proofroll.truth.truth_of_mechanism import truth_of
from proofroll_drill.command import drill
from proofroll_drill.referee import holding
from proofroll_drill.referee.balls import BallReferee
from proofroll_drill.referee.holding import as_body, errors, hold, hold_ball, hold_contacts
from proofroll_drill.referee.random_balls import STYLES as STYLES_OF_BALLS
from proofroll_drill.referee.random_balls import WALLS, random_ball
from proofroll_drill.referee.random_contacts import TURNS, random_contacts
from proofroll_drill.referee.random_mechanisms import STYLES, random_mechanism

STARTS = range(40)


def starts(mechanism: Mechanism) -> list[Record]:
    """Both routes at time 0."""
    first = JointCoordinates(mechanism)
    return [record_of(np.zeros(1), [first.sample(*mechanism.start())]), MaximalCoordinates(mechanism).at_start()]


@pytest.mark.one_in(4)
@pytest.mark.parametrize("seed", STARTS)
def test_both_routes_start_where_the_joints_definition_says(seed: int) -> None:
    """Poses, velocities, energy and determinate reactions at t = 0, all frames turned, by formulas of its own."""
    _, mechanism = random_mechanism(seed)
    check_start(mechanism)
    for record in starts(mechanism):
        found = errors(mechanism, record, analyse(mechanism).determinate)
        assert max(found[name][0] for name in ("p_WB", "q_WB", "v_WB", "w_WB", "q")) < 1e-13
        assert max(found[name][0] for name in ("energy", "wrench")) < 1e-10


@pytest.mark.drill
def test_random_mechanisms_have_every_kind_of_joint_and_planar_bodies() -> None:
    """Kinds that start above leave none out; planar ones are planar to the second route, loops are loops."""
    found = {style: [random_mechanism(seed)[1] for seed in STARTS if seed % 4 == k] for k, style in enumerate(STYLES)}
    assert {joint.kind for each in found["tree"] for joint in each.joints} == FACTS.keys()
    assert len({each.loops[0].kind for each in found["loop"]}) >= 4
    for mechanism in found["planar tree"] + found["planar loop"]:
        turning = any(joint.kind in {"revolute", "planar"} for joint in mechanism.joints)
        assert not turning or {type(body) for body in made_bodies(mechanism, allow_planar=True)} == {Planar}


@pytest.mark.one_in(3)
@pytest.mark.drill
@pytest.mark.drill_of("5", "10")
@pytest.mark.parametrize("seed", [5, 10, 3060])
def test_no_error_of_a_truth_lies_beyond_its_bar(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A loop in space, a planar tree and a free body, every quantity; `proofroll_drill referee` has any number."""
    monkeypatch.setattr(maximal_taylor, "heyoka", None)
    held = hold(seed, until=0.02)
    assert held.sound, held.text
    assert set(held.worst) == {"p_WB", "q_WB", "v_WB", "w_WB", "q", "energy", "wrench"}


@pytest.mark.parametrize("options", [(), ("--json",)])
def test_an_interrupted_referee_has_told_what_it_held(
    options: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each row is printed as soon as it is held; beside JSON on standard error."""

    def held(seed: int) -> holding.Held:
        if seed == 7:
            raise KeyboardInterrupt
        return holding.Held(seed, "tree", "revolute", "", {"q": 0.5}, 3)

    monkeypatch.setattr(holding, "hold", held)
    done = CliRunner().invoke(drill, ["referee", "--first", "5", "--count", "3", *options])
    lines = (done.stderr if options else done.stdout).splitlines()
    assert [line.removeprefix("proofroll: ") for line in lines] == [
        f"{seed} tree (revolute): largest error 0.5 of its bar, q" for seed in (5, 6)
    ]


def test_the_referee_notices_what_is_wrong() -> None:
    """A mass that is a millionth too large shows in the reactions, a turned frame in the poses."""
    _, mechanism = random_mechanism(10)
    heavier = replace(mechanism.bodies[0], mass=mechanism.bodies[0].mass * (1 + 1e-6))
    turned = replace(mechanism.joints[0], orientation=(0.1, 0.2, 0.3))
    wrong = [
        replace(mechanism, bodies=(heavier, *mechanism.bodies[1:])),
        replace(mechanism, joints=(turned, *mechanism.joints[1:])),
    ]
    record = [starts(each)[0] for each in wrong]
    known = analyse(mechanism).determinate
    assert errors(mechanism, record[0], known)["wrench"][0] > 1e-8
    assert errors(mechanism, record[1], known)["p_WB"][0] > 1e-2


@pytest.mark.parametrize("seed", range(5))
def test_a_ball_starts_where_the_coordinates_of_its_wall_say(seed: int) -> None:
    """Centre, velocity and spin of a rolling ball on each wall, by formulas of its own; it lies on the wall."""
    style, element = random_ball(seed)
    referee, body = BallReferee(element), as_body(element).elements[0].on_wall  # type: ignore[attr-defined]
    state = np.asarray(referee.start(), dtype=np.float64)
    assert style == f"{WALLS[seed]} rolls"
    np.testing.assert_allclose(
        state[:9], np.concatenate([body.surface.position(body.u0), body.v0, body.w0]), rtol=1e-13, atol=1e-14
    )
    assert abs(referee.run(np.zeros(1, np.longdouble)).seen[0]["gap"]) < 1e-17


@pytest.mark.one_in(3)
@pytest.mark.nightly_of("7017", "17", "7092")
# A bowl on which the ball slips until it sticks, a torus with resistance, a plane on which it bounces, two tori on
# which it slips at first (it was taken to leave them), a plane whose gap has the round-off of the place, two bowls on
# which the direction of a slip still turns at its end.
@pytest.mark.drill_of("9")
@pytest.mark.parametrize(
    "seed", [9, 60, *(pytest.param(seed, marks=pytest.mark.drill) for seed in (17, 45, 119, 144, 7017, 7092))]
)
def test_no_error_of_the_truth_of_a_ball_lies_beyond_its_bar(seed: int) -> None:
    """States, forces and events of short motions; `python -m proofroll_drill referee --balls` has any number."""
    held = hold_ball(seed)
    assert held.sound, held.text
    assert {"p_WB", "v_WB", "w_WB", "N"} <= set(held.worst)


def test_random_balls_have_every_wall_and_every_law() -> None:
    """Random balls roll, are resisted, slip from the start or later, fall, bounce and stay where they land."""
    styles = {random_ball(seed)[0] for seed in range(25)}
    assert len(styles) == len(WALLS) * len(STYLES_OF_BALLS)


@pytest.mark.nightly
def test_the_referee_of_balls_notices_what_is_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    """An inertia that is a millionth too large shows in the motion."""
    element = random_ball(17)[1]
    ball = replace(element.ball, inertia_ratio=element.ball.inertia_ratio * (1 + 1e-6))
    monkeypatch.setattr(holding, "as_body", lambda _: as_body(replace(element, ball=ball)))
    assert not hold_ball(17).sound


@pytest.mark.nightly_of("41")
@pytest.mark.nightly
# An ellipsoid that lands, spheres that pass each other, a rod that lands and whose slip stops.
@pytest.mark.parametrize("seed", [41, 52, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in (27, 20018))])
def test_no_error_of_the_truth_of_contacts_lies_beyond_its_bar(seed: int) -> None:
    """States, contact forces and events of short motions; `proofroll_drill referee --contacts` has any number."""
    held = hold_contacts(seed)
    assert held.sound, held.text
    assert {"p_WB", "v_WB", "w_WB", "q_WB", "pressed", "event"} <= set(held.worst)


@pytest.mark.nightly
def test_the_referee_of_contacts_notices_what_is_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    """An ellipsoid with an axis that is a millionth too long lands at another time."""
    style, mechanism, until = random_contacts(41)
    shape, floor = mechanism.geometries
    longer = replace(shape, axes=(shape.axes[0] * (1 + 1e-6), *shape.axes[1:]))
    larger = replace(mechanism, geometries=(longer, floor))
    monkeypatch.setattr(holding, "random_contacts", lambda _: (style, mechanism, until))
    monkeypatch.setattr(holding, "truth_of", lambda _, times: truth_of(larger, times))
    held = hold_contacts(41)
    assert not held.refused
    assert held.worst["event"] > 1


@pytest.mark.parametrize("seed", range(4 * len(TURNS)))
def test_random_bodies_touch_or_are_apart_at_the_start(seed: int) -> None:
    """No random bodies overlap or strike at time 0, and each style has its turn."""
    style, mechanism, _ = random_contacts(seed)
    assert style == TURNS[seed % len(TURNS)]
    check_contacts(mechanism)
