"""The law check in truths: a fault in shared code ends them, with all values before; without one a line tells."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from proofroll.core.columns import Columns
from proofroll.core.dataset import ENDED, ENDS, LAWS, truth_message
from proofroll.core.errors import Refused
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.contact.tree_contacts import ContactDynamics
from proofroll.elements.mechanism.dynamics.held_signals import Commands
from proofroll.elements.mechanism.dynamics.link_forces import working
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.control import Control
from proofroll.elements.mechanism.scene.drives import Actuator
from proofroll.elements.mechanism.scene.signal import Formula
from proofroll.truth.bodies.contact_bodies import ContactBodies
from proofroll.truth.bodies.contact_equations import ContactEquations
from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates
from proofroll.truth.plug_in import MechanismTruth
from proofroll.truth.smooth import smooth_truth
from proofroll.truth.switching.contact_taylor import CompiledStretch
from proofroll.truth.tree.contact_tree import ContactTree
from proofroll.truth.truth_of_mechanism import truth_of
from proofroll_drill.law_faults import FAULTS, SCENES, planted

_BY_WORDS = {fault.words: fault for fault in FAULTS}
DIGITS = 1e-11  # relative to the largest value of a record; 1e-13 is seen
IMPACT = 0.1428  # s, at which the thrown ball lands


@pytest.mark.drill
def test_a_contact_that_closes_early_ends_the_truth_there() -> None:
    """The truth keeps its values before the impact, has none after it, and names the law and its part."""
    ball, until = SCENES["grip"]
    with planted(_BY_WORDS["contact closes early"]):
        motion = truth_of(ball(), np.linspace(0.0, until, 21))
    assert motion.end == pytest.approx(IMPACT, abs=1e-3)
    assert len(motion.record.time) == 8  # 0 to 0.14 s
    assert motion.events == ()
    assert motion.ended.startswith('the motion that was followed breaks the law "')
    assert "for contact by 1e-06 of its natural size" in motion.ended
    assert motion.ended.endswith("an error of proofroll; please report it")
    assert not motion.laws


@pytest.mark.drill
def test_a_fault_from_the_start_is_refused() -> None:
    """A truth of which nothing is known has no values."""
    ball, until = SCENES["grip"]
    with planted(_BY_WORDS["gravity"]), pytest.raises(Refused, match="please report it"):
        MechanismTruth.truth(MechanismElement(ball()), np.linspace(0.0, until, 3), ())


@pytest.mark.drill
def test_a_truth_says_that_it_holds_all_laws() -> None:
    """The motion and the line of a run have the outcome."""
    ball, until = SCENES["grip"]
    laws = MechanismTruth.truth(MechanismElement(ball()), np.linspace(0.0, until, 3), ()).attrs[LAWS]
    assert laws.startswith("holds 5 laws on both sides of 2 events; ")
    assert laws.endswith("laws at 3 of 3 samples and in the middle of 3 stretches")
    line = truth_message(Columns({}, {"route": "one", "second_route": "two", LAWS: laws}))
    assert line == f"one, checked by two; {laws}"


def held_servo(held: str, delay: int) -> Mechanism:
    """A wheel on a servo whose controller reads its target, or sets its effort, fifty times a second."""
    wheel = Body("wheel", 1.0, inertia=(0.4, 0.4, 0.4))
    hinge = Joint("hinge", "revolute", "world", "wheel", q0=(0.2,), v0=(1.0,))
    servo = Actuator("servo", "hinge", "position", Formula("0.4*sin(9*t)"), kp=30.0, kd=1.5)
    control = Control(50.0, ("servo",), pose=(-0.3,), delay=delay, held=held)
    return Mechanism((wheel,), (hinge,), actuators=(servo,), control=control)


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize(("held", "delay"), [("target", 1), ("effort", 0)])
def test_what_a_controller_sets_follows_its_law(held: str, delay: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Values that are held between instants are those of the formula at the instant; a fault of a millionth is seen."""
    times, element = np.linspace(0.0, 0.11, 3), MechanismElement(held_servo(held, delay))
    assert LAWS in MechanismTruth.truth(element, times, ()).attrs
    commanded = Commands._commanded

    def faulty(self: Any, time: float, sample: Any) -> Any:
        return commanded(self, time, sample) * (1.0 + 1e-6 * (time > 0.05))

    monkeypatch.setattr(Commands, "_commanded", faulty)
    attributes = MechanismTruth.truth(element, times, ()).attrs
    assert attributes[ENDS] == pytest.approx(0.07, abs=1e-3)  # in the middle of the interval that begins at 0.06 s
    assert "effort = law of the actuator" in attributes[ENDED]


@pytest.mark.drill
def test_the_bars_hold_what_a_closed_form_misses(monkeypatch: pytest.MonkeyPatch) -> None:
    """Velocities of a closed form that are a millionth off are a millionth from both routes, and so are their bars."""
    bob = Body("bob", 1.0, com=(0.0, 0.0, -0.5), inertia=(0.1, 0.1, 0.01))
    pendulum = Mechanism((bob,), (Joint("pivot", "revolute", "world", "bob", axis=(0.0, 1.0, 0.0), q0=(1.0,)),))
    times = np.linspace(0.0, 0.5, 3)
    assert not truth_of(pendulum, times).ended
    form = smooth_truth.closed_form(pendulum)
    assert form is not None
    assert form.motion is not None
    motion = form.motion

    def faulty(moments: Any) -> Any:
        q, v = motion(moments)
        return q, v * (1.0 + 1e-6)

    monkeypatch.setattr(smooth_truth, "closed_form", lambda _: replace(form, motion=faulty))
    found = truth_of(pendulum, times)
    assert found.bars["v_WB"].max() + found.bars["w_WB"].max() > 1e-6 * np.abs(found.record.w_WB).max()


@pytest.mark.one_in(3)
@pytest.mark.drill_of("links")
@pytest.mark.parametrize("make", [SCENES[name][0] for name in ("slide", "rod", "links")], ids=["slide", "rod", "links"])
def test_compiled_records_are_those_in_numbers(make: object) -> None:
    """Poses, efforts and drives of both routes at the start, and the forces that their contacts bear."""
    mechanism: Mechanism = make()  # type: ignore[operator]
    dynamics, second = ContactDynamics(mechanism), MaximalCoordinates(mechanism)
    tree = ContactTree(dynamics, 1e-14, 1.0)
    bodies = ContactBodies(ContactEquations(mechanism, second.lean), 1e-14, 1.0)
    drives, records, borne = [number for number, _ in working(mechanism)], [], []
    for route in (tree, bodies):
        begun = route.begin()
        assert begun.mode is not None
        mode, state = begun.mode, begun.state
        p, v, _, w = route.bodies(state)
        stretch = route.walk(0.0, state, mode, 1e-3)
        assert isinstance(stretch, CompiledStretch)
        assert stretch.by is not None
        record, pace = stretch.by.record_of(mode, 0.0)(state[:, None])
        assert pace > 0
        moving = record[: 18 * len(p), 0].reshape(len(p), 18)
        for values, part in ((p, moving[:, :3]), (v, moving[:, 12:15]), (w, moving[:, 15:])):
            assert part == pytest.approx(values, abs=DIGITS)
        assert len(record) == 18 * len(p) + len(drives)
        named = dynamics.sample(*mechanism.start(), mode)[0]["named"]
        assert record[18 * len(p) :, 0] == pytest.approx(named[drives], abs=DIGITS * np.abs(named).max(initial=1.0))
        records.append(record[:, 0])
        borne.append(route.borne(state, mode)[1])
    assert records[0] == pytest.approx(records[1], abs=DIGITS * np.abs(records[0]).max())
    assert borne[0] == pytest.approx(borne[1], abs=DIGITS * np.abs(borne[0]).max())
