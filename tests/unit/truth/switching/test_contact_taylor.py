"""Compiled modes of bodies that touch: their equations against those without compilation, and what falls back."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from mechanism_scenes import mechanism_named

from proofroll.core.errors import Diverged
from proofroll.elements.mechanism import Force, Mechanism, Spring
from proofroll.elements.mechanism.contact.tree_contacts import ContactDynamics
from proofroll.elements.mechanism.scene.drives import Actuator
from proofroll.elements.mechanism.scene.signal import Formula, Table
from proofroll.elements.mechanism.scene.spring_law import SpringLaw
from proofroll.truth.bodies.contact_bodies import ContactBodies
from proofroll.truth.bodies.contact_equations import ContactEquations
from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates
from proofroll.truth.natural_units import natural_units
from proofroll.truth.numerics import compiled_once
from proofroll.truth.switching import contact_taylor
from proofroll.truth.switching.contact_guards import guards_of
from proofroll.truth.switching.contact_stretches import ContactStretches
from proofroll.truth.switching.planar_slip import leading, led_by, with_heading
from proofroll.truth.tree.contact_tree import ContactTree
from proofroll.truth.truth_of_mechanism import truth_of

SCENES = ("sled", "eccentric_sphere", "falling_rod", "rattleback", "tilted_disc", "free_turntable", "ladder",
          "two_spheres", "rocking_block", "sled_on_slope")  # fmt: skip


def routes(scene: str) -> list[ContactStretches]:
    """Both routes of a scene, in natural units."""
    return routes_of(mechanism_named(scene))


def routes_of(si: Mechanism) -> list[ContactStretches]:
    """Both routes of a mechanism in SI units, in natural ones."""
    own = natural_units(si).mechanism(si)
    second = MaximalCoordinates(own)
    return [
        ContactTree(ContactDynamics(own), 1e-14, 1.0),
        ContactBodies(ContactEquations(own, second.lean), 1e-14, 1.0),
    ]


@pytest.mark.one_in(3)
@pytest.mark.parametrize("scene", SCENES)
def test_compiled_equations_are_those_of_the_route(scene: str) -> None:
    """Shortly after the start, rates and guards of each route's compiled mode are those that it solves for."""
    pytest.importorskip("heyoka")
    for route in routes(scene):
        begun = route.begin()
        assert begun.mode is not None
        compiled = route.by_symbols(begun.state, begun.mode)
        assert compiled is not None
        law, guards = route._law(begun.state, begun.mode), guards_of(route.contacts, begun.mode)
        state = law.corrected(begun.state + 0.01 * law.rates(begun.state))
        values, _, rates = compiled.values(state[None], begun.mode)
        assert values[0] == pytest.approx(route._guards(state, begun.mode, guards), abs=1e-12)
        assert rates[0] == pytest.approx(law.rates(state), abs=1e-12)


@pytest.mark.parametrize("number", [0, 1])
def test_compiled_values_of_a_slip_that_leads_are_those_of_the_route(number: int) -> None:
    """Rates, the contact's motion and guards are those that a route solves for, whatever friction acts against."""
    pytest.importorskip("heyoka")
    route = routes("eccentric_sphere")[number]
    begun = route.begin()
    assert begun.mode is not None
    touch = route._solved(begun.state, begun.mode).touching[0]
    mode = leading(begun.mode[0], touch.normal, np.cross(touch.normal, [0.3, -0.5, 0.8])), *begun.mode[1:]
    compiled = route.by_symbols(begun.state, mode)
    assert compiled is not None
    start = np.array(mode[0].heading)
    directions = np.array([start, 0.6 * start + 0.8 * np.cross(touch.normal, start)])
    law = route._law(begun.state, mode)
    states = np.array([begun.state, law.corrected(begun.state + 0.01 * law.rates(begun.state))])
    values = compiled.led(mode, 0.0)(states, directions)
    solved = led_by(mode, route._equations.rate, route._solved)(states, directions)
    for name in ("rates", "normals", "slides", "slide_rates"):
        assert getattr(values, name) == pytest.approx(getattr(solved, name), abs=1e-12), name
    guards = guards_of(route.contacts, mode)
    for row, state, direction in zip(values.guards, states, directions, strict=True):
        assert row == pytest.approx(route._guards(state, with_heading(mode, direction), guards), abs=1e-12)


@pytest.mark.drill
def test_a_falling_rod_slips_when_it_does_without_compilation(monkeypatch: pytest.MonkeyPatch) -> None:
    """A rod slips at the same time and place either way, and each route names the integrator that it used."""
    pytest.importorskip("heyoka")
    mechanism = mechanism_named("falling_rod")
    compiled = truth_of(mechanism, np.array([0.0, 0.3, 0.6]))
    assert [route.split(", ")[1] for route in compiled.routes] == ["collocation", "Taylor series"]
    monkeypatch.setattr(contact_taylor, "heyoka", None)
    plain = truth_of(mechanism, np.array([0.0, 0.3, 0.6]))
    assert [route.split(", ")[1] for route in plain.routes] == ["DOP853", "DOP853"]
    (one,), (two,) = compiled.events, plain.events
    assert (one.kind, one.name) == (two.kind, two.name) == ("slip", "contact")
    assert one.time_low <= two.time_high
    assert two.time_low <= one.time_high
    assert compiled.record.p_WB == pytest.approx(plain.record.p_WB, abs=1e-12)


@pytest.mark.drill
def test_a_sweep_compiles_once() -> None:
    """Scenes that differ in numbers alone share what is compiled, and move each in its own way."""
    pytest.importorskip("heyoka")
    ends, counts = [], []
    for friction in (0.31, 0.33, 0.35):
        mechanism = mechanism_named("falling_rod", friction=friction)
        ends.append(float(truth_of(mechanism, np.array([0.0, 0.7])).record.p_WB[-1, 0, 0]))
        counts.append(len(compiled_once._MODES))
    assert counts[0] == counts[1] == counts[2]
    assert len(set(ends)) == 3


def driven_turntable(target: Any, torque: Any) -> Mechanism:
    """A ball on a turntable with a motor, a drive and applied forces, held by a spring off its centre."""
    m = mechanism_named("free_turntable")
    motor = Actuator("motor", "axle", "position", target=target, kp=0.3, kd=0.01, gear=2.0)
    ends = ("world", "ball", (0.5, 0.1, 0.4), (0.01, 0.0, 0.03))
    spring = Spring("band", *ends, stiffness=0.7, damping=0.1, length=0.1, force=SpringLaw("0.2*L^3 + 0.1*dL"))
    disc = m.joints[0].child
    forces = (
        Force("push", "ball", "force", (0.01, -0.02, 0.01), (0.0, 0.01, 0.02), "body", reaction=disc),
        Force("twist", "ball", "moment", (1e-4, 0.0, 2e-4), frame="body", reaction=disc),
    )
    axle = replace(m.joints[0], torque=torque, damping=0.02, armature=0.0)
    return replace(m, joints=(axle, *m.joints[1:]), actuators=(motor,), springs=(spring,), forces=forces)


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize(
    ("target", "torque"),
    [
        (Formula("0.4*sin(3*t)"), Formula("0.01*t^2")),
        (Table((0.0, 0.1), (0.0, 0.2)), Table((0.0, 0.2), (0.1, 0.3), hold=True)),
    ],
)
def test_springs_forces_motors_and_drives_are_compiled(target: Any, torque: Any) -> None:
    """Loads of the joints and between bodies have rules in both routes, also as formulas of time and tables."""
    pytest.importorskip("heyoka")
    for route in routes_of(driven_turntable(target, torque)):
        begun = route.begin()
        assert begun.mode is not None
        compiled, law = route.by_symbols(begun.state, begun.mode), route._law(begun.state, begun.mode)
        assert compiled is not None
        state = law.corrected(begun.state + 0.01 * law.rates(begun.state))
        assert compiled.values(state[None], begun.mode)[2][0] == pytest.approx(law.rates(state), abs=1e-12)


@pytest.mark.drill
def test_another_table_compiles_nothing_anew() -> None:
    """Values and times of a table are parameters at run time: a motor that follows another one moves its own way."""
    pytest.importorskip("heyoka")
    ends, counts = [], []
    for value in (0.23, 0.37):
        table = Table((0.0, 0.013, 0.05), (0.0, value, -0.11))
        found = truth_of(driven_turntable(table, 0.0), np.array([0.0, 0.02]))
        assert [route.split(", ")[1] for route in found.routes] == ["collocation", "Taylor series"]
        ends.append(float(found.record.q[-1, 0]))
        counts.append(len(compiled_once._MODES))
    assert counts[0] == counts[1]
    assert ends[0] != ends[1]


@pytest.mark.parametrize("law", [{"friction": 0.003}, {"limits": (-1.0, 0.5), "restitution": 0.5}])
def test_stops_and_dry_friction_of_joints_are_compiled(law: dict[str, Any]) -> None:
    """Laws of a joint beside a contact of bodies are rows of both routes' compiled modes, and guards of them."""
    pytest.importorskip("heyoka")
    m = mechanism_named("free_turntable")
    for route in routes_of(replace(m, joints=(replace(m.joints[0], **law), *m.joints[1:]))):
        begun = route.begin()
        assert begun.mode is not None
        compiled, stretch = route.by_symbols(begun.state, begun.mode), route._law(begun.state, begun.mode)
        assert compiled is not None
        state = stretch.corrected(begun.state + 0.01 * stretch.rates(begun.state))
        guards, _, rates = compiled.values(state[None], begun.mode)
        assert rates[0] == pytest.approx(stretch.rates(state), abs=1e-12)
        assert guards[0] == pytest.approx(
            route._guards(state, begun.mode, guards_of(route.contacts, begun.mode)), abs=1e-12
        )


@pytest.mark.nightly
def test_an_effort_at_its_limit_is_compiled() -> None:
    """A motor reaches its limit and comes back: both routes stay compiled, with the limit as a guard."""
    pytest.importorskip("heyoka")
    found = truth_of(mechanism_named("flick"), np.array([0.0, 0.08]))
    assert [route.split(", ")[1] for route in found.routes] == ["collocation", "Taylor series"]
    assert [(event.kind, event.name) for event in found.events] == [("slip", "push")]
    assert found.events[0].time == pytest.approx(0.060258231738, abs=1e-11)


@pytest.mark.drill
def test_a_load_that_contacts_share_compiles_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """A box that slides on its four corners has no compiled mode: it takes seconds for many contacts."""
    compiled: list[object] = []
    monkeypatch.setattr(contact_taylor.CompiledModes, "of", lambda *given: compiled.append(given))
    four = [replace(mechanism_named("sled").geometries[1], name=f"foot{k}", position=(x, y, -0.08))
            for k, (x, y) in enumerate([(0.2, 0.1), (0.2, -0.1), (-0.2, 0.1), (-0.2, -0.1)])]  # fmt: skip
    sled = mechanism_named("sled", spin=0.0)
    pairs = [replace(sled.pairs[0], name=each.name, geometries=(each.name, "floor")) for each in four]
    truth_of(replace(sled, geometries=(sled.geometries[0], *four), pairs=tuple(pairs)), np.array([0.0, 0.01]))
    assert not compiled


@pytest.mark.drill
def test_a_slip_lands_on_the_end_of_its_stretch_but_for_round_off(monkeypatch: pytest.MonkeyPatch) -> None:
    """A last step that round-off leaves one digit before its time is the last one all the same."""
    places_at = contact_taylor.CompiledMode._places

    def places(self: Any, pars: Any, start: float, end: float, inside: Any, times: Any) -> Any:
        found = places_at(self, pars, start, end, inside, times)
        return np.nextafter(found, start) if len(times) == 1 else found

    monkeypatch.setattr(contact_taylor.CompiledMode, "_places", places)
    sled = mechanism_named("sled")
    assert not any("DOP853" in route for route in truth_of(sled, np.array([0.0, 0.05])).routes)


@pytest.mark.drill
def test_a_route_names_the_compiled_integrator_that_failed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A stretch that its compiled integrator gives up is followed by DOP853, and the name of the route says so."""
    pytest.importorskip("heyoka")

    def fails(*_: object) -> None:
        raise Diverged("its steps became too short")

    monkeypatch.setattr(contact_taylor.CompiledMode, "walk", fails)
    mechanism = mechanism_named("falling_rod")
    names = [route.split(", ")[1] for route in truth_of(mechanism, np.array([0.0, 0.1])).routes]
    assert names == ["DOP853 where collocation failed", "DOP853 where Taylor series failed"]
