"""Scenes of another size, mass and time move as before, and a mechanism in other units is the same mechanism."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import cache

import numpy as np
import pytest
from mechanism_scenes import mechanism_named

from proofroll.core.errors import InputError, Refused
from proofroll.core.quantity import powers_of
from proofroll.core.validation import units_of_kind
from proofroll.elements.mechanism import Body, Force, Joint, Loop, Mechanism, Point, Spring
from proofroll.elements.mechanism.contact.tree_contacts import ContactDynamics
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.dynamics.record import record_of
from proofroll.elements.mechanism.reading.assembly import assemble, check_start
from proofroll.elements.mechanism.reading.reader import KINDS
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.bushing import Bushing
from proofroll.elements.mechanism.scene.drives import Actuator, Coupling
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.elements.mechanism.scene.signal import Formula, Table
from proofroll.elements.mechanism.scene.spring_law import SpringLaw
from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates
from proofroll.truth.error_bars import TwoRouteMotion
from proofroll.truth.natural_units import Units, natural_units
from proofroll.truth.tree.contact_tree import ContactTree
from proofroll.truth.truth_of_mechanism import truth_of

SAME = 1e-12  # of the size of the scene; 1e-14 is seen
SMALL, LARGE = (1e-5, 1.0, 1e-5**0.5), (1e4, 1.0, 1e2)
FAST, SLOW = (1.0, 1.0, 1e-6), (1.0, 1.0, 1e6)
SMALL_AND_HEAVY, LARGE_AND_LIGHT = (1e-5, 1e9, 1e6), (1e4, 1e-9, 1e-6)


def larger(mechanism: Mechanism, scale: tuple[float, float, float]) -> Mechanism:
    """A mechanism with lengths, masses and times multiplied."""
    return Units(*(1 / factor for factor in scale)).mechanism(mechanism)


@cache
def as_given(scene: str, until: float) -> TwoRouteMotion:
    """The truth of a scene in its own units."""
    return truth_of(mechanism_named(scene), np.array([0.0, until]))


DEAR = (("flick", 0.15), ("spinning_bounce", 0.4), ("sled", 0.65), ("spring_friction", 2.0))


@pytest.mark.one_in(3)
@pytest.mark.nightly_of("sled-0.65-scale7", "spring_friction-2.0-scale8")
# Under other kinds of arithmetic the dear ones are made smaller and heavier alone.
@pytest.mark.drill
@pytest.mark.parametrize(
    ("scene", "until", "scale"),
    [
        pytest.param("stop", 1.0, SMALL, marks=pytest.mark.arithmetic),
        *(
            pytest.param(*case, marks=[pytest.mark.drill, pytest.mark.arithmetic])
            for case in (
                ("saturated_servo", 1.0, SLOW),
                ("falling_rod", 0.9, FAST),
                ("falling_rod", 0.9, SLOW),
                ("spring_friction", 0.7, LARGE),
                *((*case, SMALL_AND_HEAVY) for case in DEAR),
            )
        ),
        *(pytest.param(*case, LARGE_AND_LIGHT, marks=pytest.mark.nightly) for case in DEAR[::2]),
    ],
)
def test_a_scene_of_another_size_has_the_same_events(
    scene: str, until: float, scale: tuple[float, float, float]
) -> None:
    """Lengths, masses and times that are multiplied change nothing but the units of the answer."""
    mechanism, (length, _, time) = mechanism_named(scene), scale
    one = as_given(scene, until)
    two = truth_of(larger(mechanism, scale), np.array([0.0, until * time]))
    assert [(event.kind, event.name) for event in two.events] == [(event.kind, event.name) for event in one.events]
    assert [event.time / time for event in two.events] == pytest.approx([event.time for event in one.events], rel=SAME)
    assert two.record.p_WB / length == pytest.approx(one.record.p_WB, abs=SAME)
    assert two.horizon / time == pytest.approx(one.horizon)


def everything() -> Mechanism:
    """A mechanism that has every quantity with a unit."""
    turn, slide = Formula("a*sin(3*t) + 0.2", (("a", 0.7),)), Table((0.0, 1.0), (0.3, 0.8))
    bodies = [
        Body("arm", 1.3, (0.1, 0.05, -0.2), ((0.02, 0.001, 0.0), (0.001, 0.03, 0.0), (0.0, 0.0, 0.04))),
        Body("slider", 0.6, (0.02, 0.0, 0.0), ((0.01, 0.0, 0.0), (0.0, 0.02, 0.0), (0.0, 0.0, 0.02))),
        Body("wheel", 0.4, (0.0, 0.01, 0.0), ((0.01, 0.0, 0.0), (0.0, 0.01, 0.0), (0.0, 0.0, 0.02))),
        Body("loose", 0.9, (0.0, 0.0, 0.03), ((0.03, 0.0, 0.0), (0.0, 0.02, 0.0), (0.0, 0.0, 0.02))),
    ]
    laws = {"damping": 0.3, "stiffness": 2.0, "rest": 0.1, "armature": 0.05}
    joints = [
        Joint("hinge", "revolute", "world", "arm", (0.1, 0.0, 0.4), axis=(0, 1, 0), q0=(0.4,), v0=(1.1,), **laws),  # type: ignore[arg-type]
        Joint("rail", "prismatic", "arm", "slider", (0.0, 0.1, 0.0), q0=(0.2,), v0=(-0.6,), torque=slide, **laws),  # type: ignore[arg-type]
        Joint("axle", "revolute", "slider", "wheel", child_position=(0.0, 0.02, 0.0), torque=turn),
        Joint("free", "free", "world", "loose", q0=(0.5, 0.1, 0.2, 1, 0, 0, 0), v0=(0.3, 0.2, 0.1, 1.0, 2.0, 3.0)),
    ]
    actuators = [
        Actuator("servo", "hinge", "position", turn, 3.0, 0.4, 2.0, 5.0),
        Actuator("drive", "rail", "velocity", slide, 0.0, 0.7),
        Actuator("push", "axle", "torque", 0.3),
    ]
    return Mechanism(
        tuple(bodies),
        tuple(joints),
        springs=(
            Spring(
                "rubber", "wheel", "loose", (0.0, 0.05, 0.0), (0.01, 0.0, 0.0), 4.0, 0.2, 0.3, SpringLaw("dL/L + 2")
            ),
        ),
        forces=(
            Force("blow", "arm", "force", (0.5, turn, slide), (0.1, 0.2, 0.3)),
            Force("twist", "loose", "moment", (0.1, turn, 0.0), reaction="arm"),
        ),
        points=(Point("tip", "arm", (0.3, 0.0, 0.0)),),
        actuators=tuple(actuators),
        couplings=(Coupling("rack", "axle", "rail", 0.05, 0.2),),
    )


def test_a_mechanism_in_other_units_has_the_same_equations() -> None:
    """Accelerations and forces that are computed in other units are those in SI units, of every law at once."""
    mechanism, units, time = everything(), Units(0.125, 8.0, 0.25), 0.3
    own = units.mechanism(mechanism)
    records = []
    for one, at in ((mechanism, time), (own, time / units.time)):
        sample = JointCoordinates(one).sample(*one.start(), (), at)
        records.append(record_of(np.array([at]), [sample]))
    found = units.record(mechanism, records[1])
    for name in ("time", "p_WB", "v_WB", "q_WB", "w_WB", "q", "v", "wrench", "named"):
        assert getattr(found, name) == pytest.approx(getattr(records[0], name), rel=1e-12, abs=1e-12, nan_ok=True), name
    energy = found.placed(mechanism).energy()
    assert energy == pytest.approx(records[0].placed(mechanism).energy(), rel=1e-12)


SIX = (1.0, 2.0, 3.0, 0.4, 0.5, 0.6)  # of a bushing
# Numbers whose unit is that of a joint elsewhere; equations of motion with all of them are compared above.
BY_JOINT = {"target", "kp", "kd", "limit", "ratio", "offset"}


def numbers_of(value: object) -> list[float]:
    """Numbers of a field, of a formula its value at one time."""
    if isinstance(value, tuple):
        return [number for part in value for number in numbers_of(part)]
    if isinstance(value, SpringLaw):  # at a length of 1 m, or the same in other units
        return [float(value.pull(1.0 / value.units[0], 0.5 / value.units[1]))]
    return [float(value)] if isinstance(value, float | int) and not isinstance(value, bool) else []


def test_every_field_of_every_table_is_scaled_by_its_own_unit() -> None:
    """A field that a table of the scene file has is in its natural unit, and one without a unit is known."""
    loop = Loop("pin", "revolute", "arm", "loose", (0.2, 0.0, 0.0), (0.0, 0.4, 0.0))
    strut = Loop("strut", "distance", "arm", "loose", length=0.7)
    moved = Joint("moved", "prismatic", "world", "carried", motion=0.4)
    stop = Joint("stop", "prismatic", "slider", "end", limits=(-0.3, 0.7), friction=0.6, torque=0.3, restitution=0.5)
    all_of_it, units = everything(), Units(0.125, 8.0, 0.25)
    shapes = (
        Geometry("ball", "arm", "sphere", (0.1, 0.0, 0.2), radius=0.3),
        Geometry("stone", "arm", "ellipsoid", axes=(0.3, 0.2, 0.1)),
        Geometry("brick", "loose", "box", size=(0.3, 0.2, 0.1)),
        Geometry("tyre", "arm", "torus", radius=0.1, ring_radius=0.4),
        Geometry("floor", "world", "plane"),
        Geometry("tank", "arm", "capsule", radius=0.1, length=0.4),
    )
    pairs = (Pair("grip", ("ball", "floor"), 0.4, rolling_resistance=0.1, spinning_friction=0.2),)
    mechanism = replace(
        all_of_it, loops=(loop, strut), joints=(*all_of_it.joints, stop, moved),
        bodies=(*all_of_it.bodies, Body("end", 0.3), Body("carried", 0.2)),
        bushings=(Bushing("mount", "arm", "loose", (0.1, 0.2, 0.3), (0.3, 0.1, 0.2), stiffness=SIX, damping=SIX),),
        geometries=shapes, pairs=pairs,
    )  # fmt: skip
    own, base, seen = (
        units.mechanism(mechanism),
        {"m": units.length, "kg": units.mass, "s": units.time},
        set[tuple[type, str]](),
    )
    for table, made in KINDS.items():
        for one, two in zip(getattr(mechanism, table), getattr(own, table), strict=True):
            stated = units_of_kind(made, getattr(one, "kind", None))
            for item in fields(one):
                given, found = (numbers_of(getattr(part, item.name)) for part in (one, two))
                if not given or (item.name in BY_JOINT and made in {Actuator, Coupling}):
                    continue
                unit = stated[item.name]
                assert unit or not any(given), f"{table}.{item.name} has no unit"
                for k, (before, after) in enumerate(zip(given, found, strict=True)):
                    sizes = powers_of(unit if isinstance(unit, str) else unit[k])
                    factor = float(np.prod([base[name] ** power for name, power in sizes.items()]))
                    assert after * factor == pytest.approx(before, rel=1e-14), f"{table}.{one.name}.{item.name}"
                    seen |= {(made, item.name)} if before else set()
    stated_units = [
        (made, item, item.metadata.get("unit", ""))
        for made in KINDS.values()
        for item in fields(made)
        if not (item.name in BY_JOINT and made in {Actuator, Coupling})
    ]
    assert {
        (made, item.name) for made, item, unit in stated_units if not isinstance(unit, str) or powers_of(unit)
    } <= seen


def test_loops_and_shapes_have_lengths_too() -> None:
    """Places of loops, and places, radii, axes and edges of shapes are in the unit of length."""
    loop = Loop("pin", "revolute", "arm", "loose", (0.2, 0.0, 0.0), (0.0, 0.4, 0.0))
    own = Units(0.5, 1.0, 1.0).mechanism(replace(everything(), loops=(loop,)))
    assert (own.loops[0].position_a, own.loops[0].position_b) == ((0.4, 0.0, 0.0), (0.0, 0.8, 0.0))
    sled = Units(0.5, 1.0, 1.0).mechanism(mechanism_named("sled"))
    assert sled.geometries[1].radius == 2 * 0.02
    assert own.joints[1].limits is None


@pytest.mark.one_in(3)
@pytest.mark.parametrize("turn", np.linspace(0.0, 0.4, 9))
def test_a_small_mechanism_far_from_the_origin_closes(turn: float) -> None:
    """Loops of 0.1 mm that close 10 m from the world's origin are accepted: round-off of such places is larger."""
    base, far = larger(mechanism_named("four_bar"), (1e-4, 1.0, 1e-2)), np.array([10.1, 3.3, 0.0])
    joints = [
        replace(
            joint, position=tuple(far + joint.position) if joint.parent == "world" else joint.position, dependent=k > 0
        )
        for k, joint in enumerate(base.joints)
    ]
    joints[0] = replace(joints[0], q0=(joints[0].q0[0] + turn,), dependent=False)
    check_start(assemble(replace(base, joints=tuple(joints))))


def test_natural_units_follow_the_scene() -> None:
    """They are powers of two near the extent, the mass, and the time of a fall by the extent or of the first motion."""
    rod = mechanism_named("falling_rod")
    units = natural_units(rod)
    assert units.length in {0.5, 1.0}
    assert units.time == pytest.approx(np.sqrt(units.length / 9.81), rel=0.5)
    spring = mechanism_named("spring_friction")
    slow = natural_units(larger(spring, (1.0, 1.0, 1024.0)))
    assert slow == natural_units(spring)._replace(time=1024.0 * natural_units(spring).time)
    for number in (*units, *slow):
        assert np.log2(number) == round(np.log2(number))


@pytest.mark.parametrize(("scene", "point"), [("servo", False), ("stop", False), ("stiff_damper", True)])
def test_a_mechanism_at_one_place_has_a_length_that_follows_it(scene: str, point: bool) -> None:
    """A body at the origin, above its stop, or a point with a speed has 100 times the length where it is as large."""
    mechanism = mechanism_named(scene)
    if point:
        mechanism = replace(mechanism, bodies=tuple(replace(body, inertia=(0, 0, 0)) for body in mechanism.bodies))
    one, other = (MechanismElement(item) for item in (mechanism, larger(mechanism, (100.0, 1.0, 10.0))))
    assert other.length == pytest.approx(100.0 * one.length)


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.arithmetic
@pytest.mark.parametrize("height", [1e-3, 1e-12])
def test_a_point_at_rest_falls_on_its_stop_from_any_height(height: float) -> None:
    """A body without size or speed has the way to its stop for a length: it strikes at sqrt(2 h/g), within its bars.

    A third impact is at the end, to the last digit, and so not among its events.
    """
    slide = Joint("slide", "prismatic", "world", "b", axis=(0, 0, 1), limits=(-height, height), restitution=0.5)
    mechanism = Mechanism((Body("b", 1.0),), (slide,))
    falls = float(np.sqrt(2 * height / 9.81))
    found = truth_of(mechanism, np.array([0.0, 0.5, 2.5]) * falls)
    assert [event.time / falls for event in found.events] == pytest.approx([1.0, 2.0], rel=SAME)
    assert found.record.p_WB[1, 0, 2] == pytest.approx(-height / 4, rel=SAME)
    assert found.bars["p_WB"][-1] < SAME * height


def test_messages_of_routes_have_seconds() -> None:
    """A time in a message of a route in natural units is said in seconds."""
    with (
        pytest.raises(Refused, match=r"^stopped at t = 0\.75 s: step 3 of 4 s$"),
        Units(1.0, 1.0, 0.25).errors_in_seconds(),
    ):
        raise Refused("stopped at t = 3 s: step 3 of 4 s")


def test_an_effort_that_starts_at_its_limit_passes_it() -> None:
    """A stretch that begins with an effort exactly at its limit ends where the effort passes it."""
    flick = mechanism_named("flick")
    servo = replace(flick.actuators[0], kind="torque", target=Formula("0.5 + t^3"), kp=0.0, kd=0.0, limit=0.5)
    mechanism = replace(flick, actuators=(servo,))
    tree = ContactTree(ContactDynamics(mechanism), 1e-14, 1.0)
    begun = tree.begin()
    law = tree._law(begun.state, begun.mode)
    assert law.guards(begun.state)[-1] <= 0.0
    assert law.guards(begun.state + np.append(np.zeros(len(begun.state) - 1), 0.1))[-1] > 0.0


def test_a_closed_form_without_finite_numbers_is_no_truth() -> None:
    """A mass whose products are not finite is refused in words, not by an eigenvalue that does not converge."""
    mechanism = mechanism_named("pendulum")
    heavy = replace(mechanism, bodies=tuple(replace(body, mass=1e308) for body in mechanism.bodies))
    with np.errstate(all="ignore"), pytest.raises(Refused, match="too large or too small"):
        truth_of(heavy, np.array([0.0, 0.01]))


@pytest.mark.parametrize("size", [1e-7, 1.0, 1e7])
def test_a_loop_closes_by_the_size_of_its_mechanism(size: float) -> None:
    """Round-off of a large loop does not open it, and a gap of a billionth of a tiny one does."""
    mechanism = larger(mechanism_named("four_bar"), (size, 1.0, 1.0))
    check_start(mechanism)
    loop, *others = mechanism.loops
    apart = replace(loop, position_a=tuple(x + 1e-9 * size for x in loop.position_a))
    with pytest.raises(InputError, match="does not close"):
        check_start(replace(mechanism, loops=(apart, *others)))


@pytest.mark.parametrize("units", [Units(1.0, 1.0, 1.0), Units(0.25, 1.0, 1.0), Units(2.0, 2.0, 1.0)])
def test_reactions_beside_a_light_rotor_keep_their_digits_in_any_unit(units: Units) -> None:
    """At the start of a geared arm, bodies in any units have the reactions of the tree up to round-off."""
    mechanism = mechanism_named("arm_rotor")
    tree, start = JointCoordinates(mechanism), np.concatenate(mechanism.start())
    by_tree = tree.recorded(np.zeros(1), start[None]).wrench
    by_bodies = units.record(mechanism, MaximalCoordinates(units.mechanism(mechanism)).at_start()).wrench
    assert np.abs(by_bodies - by_tree).max() < 2e-14 * np.abs(by_tree).max()
