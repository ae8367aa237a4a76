"""A mechanism as an element: what is observed, what a certificate notices, and what a run says of it."""

import dataclasses
import json
from itertools import combinations

import numpy as np
import pytest

from proofroll.core.dataset import scales
from proofroll.core.element import FirstMotion
from proofroll.core.engine import Regularised
from proofroll.core.errors import Diverged, InputError
from proofroll.core.observable import Role
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.contact.tree_contacts import ContactDynamics
from proofroll.elements.mechanism.report.drawing import mechanism_drawing
from proofroll.elements.mechanism.run.certificate import CAPS
from proofroll.elements.mechanism.run.dataset import UNDETERMINED, UNSAID
from proofroll.elements.mechanism.run.element import ENERGY_GAIN, OPENED, MechanismElement
from proofroll.elements.mechanism.run.sampling import MechanismBuilt, MechanismSample
from proofroll.elements.mechanism.scene.drives import Actuator
from proofroll.elements.mechanism.scene.signal import Formula
from proofroll.files.json_data import plain
from proofroll.files.scene_file import load_scene
from proofroll.report.kinds import kind_of
from proofroll.report.pen import Disc, Lettering
from proofroll.running.simulation import simulate
from proofroll.truth.truth_of_mechanism import truth_of

SCENES = ("pendulum", "slider_crank", "bricard", "heavy_top", "andrews_squeezer", "free_body", "gyroscope_cart")


def element_of(name: str, **parameters: float) -> MechanismElement:
    """The mechanism of a scene."""
    (element,) = load_scene(name, **parameters).elements
    assert isinstance(element, MechanismElement)
    return element


def right(element: MechanismElement) -> MechanismBuilt:
    """What an engine says that has built the scene exactly."""
    mechanism, start = element.mechanism, element.start
    first = element.first_motion
    assert isinstance(first, FirstMotion)
    axes = [
        start.R_WB[0, mechanism.body_index[j.parent]] @ j.parent_frame[:, 2] if j.kind == "revolute" else [np.nan] * 3
        for j in mechanism.joints
    ]
    return MechanismBuilt(
        mass=np.array([body.mass for body in mechanism.bodies]),
        com=np.array([body.com for body in mechanism.bodies]),
        inertia=np.array([body.inertia for body in mechanism.bodies]),
        joint_position=np.array([start.point(j.child, j.child_position)[0] for j in mechanism.joints]),
        joint_axis=np.array(axes),
        gravity=np.array(mechanism.gravity),
        mobility=element.analysis.mobility,
        acceleration=first.acceleration,
        angular_acceleration=first.angular_acceleration,
    )


def at_start(element: MechanismElement, **changed: object) -> MechanismSample:
    """The sample at time 0 that is the scene's."""
    start = element.start
    given = {"p_WB": start.p_WB[0], "v_WB": start.v_WB[0], "w_WB": start.w_WB[0], "q_WB": start.q_WB[0]}
    return MechanismSample(**(given | changed))


def noticed(element: MechanismElement, built: MechanismBuilt, **changed: object) -> set[str]:
    """Quantities whose line of the certificate fails."""
    lines = element.certify(built, at_start(element, **changed))
    return {line.quantity for line in lines if line.difference is not None and line.difference > line.tolerance}


@pytest.mark.parametrize("name", SCENES)
def test_observables_are_those_of_the_dataset(name: str) -> None:
    """Each observable is a variable of a run with the unit that it declares, and has a size."""
    element = element_of(name)
    run = element.variables(np.zeros(1), [at_start(element)]).dataset()
    for item in element.observables:
        assert run[item.name].attrs["units"] == item.unit
        assert item.floor is not None
        assert item.floor > 0
    assert sum(item.decides for item in element.observables) == 1


def test_reactions_are_observed_where_some_are_determinate() -> None:
    """An overconstrained ring has no determinate force, so that none can be asked for; a pendulum has all."""
    roles = {item.name for item in element_of("bricard").observables if item.role == Role.REACTION}
    assert "forces" not in roles
    assert {item.name for item in element_of("pendulum").observables if item.role == Role.REACTION} == {
        "forces",
        "torques",
    }


@pytest.mark.parametrize("name", ["pendulum", "slider_crank"])
def test_the_right_model_passes(name: str) -> None:
    """No line of the certificate fails for a model that is the scene's."""
    element = element_of(name)
    assert noticed(element, right(element)) == set()


@pytest.mark.parametrize(
    ("changed", "quantity"),
    [
        (lambda built: {"mass": 2 * built.mass}, "mass"),
        (lambda built: {"com": built.com + 1e-3}, "centre of mass"),
        (lambda built: {"inertia": 1.01 * built.inertia}, "inertia"),
        (lambda built: {"joint_axis": np.roll(built.joint_axis, 1, axis=1)}, "joint axes"),
        (lambda built: {"joint_position": built.joint_position + 1e-3}, "joint positions"),
        (lambda built: {"mobility": built.mobility + 1}, "mobility"),
        (lambda built: {"gravity": -built.gravity}, "gravity"),
        (lambda _: {"gravity": np.full(3, np.nan)}, "gravity"),
        (lambda built: {"mass": np.where(np.arange(len(built.mass)) == 1, np.nan, built.mass)}, "mass"),
        (lambda built: {"inertia": np.full(built.inertia.shape, np.nan)}, "inertia"),
        (lambda _: {"mass_matrix_error": 1e-3}, "error of the mass matrix"),
        (lambda built: {"acceleration": 1.01 * built.acceleration}, "acceleration"),
    ],
)
def test_a_wrong_model_is_noticed(changed, quantity: str) -> None:
    """A certificate notices what is wrong, and nothing else."""
    element = element_of("slider_crank")
    built = right(element)
    assert noticed(element, dataclasses.replace(built, **changed(built))) == {quantity}


def test_how_far_a_model_may_soften_says_why() -> None:
    """What an engine asks for is allowed up to a cap, whose reason stands beside the engine's own."""
    element = element_of("slider_crank")
    asked = {"acceleration": Regularised(0.8, "a stiff spring")}
    lines = element.certify(dataclasses.replace(right(element), regularised=asked), at_start(element))
    (line,) = (line for line in lines if line.quantity == "acceleration")
    assert line.tolerance == CAPS["acceleration"].tolerance < 0.8
    assert line.because.startswith("a stiff spring; of the 0.8 requested")
    assert line.because.endswith(CAPS["acceleration"].because)


@pytest.mark.one_in(4)
@pytest.mark.parametrize("wrong", [np.zeros((2, 5)), "heavy"], ids=["shape", "text"])
@pytest.mark.parametrize(
    "name",
    [item.name for item in dataclasses.fields(MechanismBuilt) if item.name not in {"regularised", "terms"}],
)
def test_what_is_built_of_another_shape_is_named(name: str, wrong: object) -> None:
    """Whatever an engine says that it built is of the shape that the protocol says, or the field is named."""
    element = element_of("slider_crank")
    with pytest.raises(Diverged, match=rf"^the engine's built\(\) gave {name}( with shape|, which is no array)"):
        noticed(element, dataclasses.replace(right(element), **{name: wrong}))


def test_a_wrong_delassus_matrix_is_noticed() -> None:
    """One entry off by a thousandth is noticed; across the normals of pairs without friction nothing is asked."""
    element = element_of("sled")
    mechanism = element.mechanism
    state = ContactDynamics(mechanism).at(*mechanism.start())
    response = np.einsum("kin,nm,ljm->kilj", state.J, state.W, state.J)
    assert not noticed(element, dataclasses.replace(right(element), contact_response=response))
    response[0, 0, 1, 0] *= 1.001
    wrong = dataclasses.replace(right(element), contact_response=response)
    assert noticed(element, wrong) == {"responses of contacts"}
    pairs = tuple(dataclasses.replace(pair, friction=0.0) for pair in mechanism.pairs)
    smooth = MechanismElement(dataclasses.replace(mechanism, pairs=pairs))
    built = dataclasses.replace(right(smooth), contact_response=response)
    assert not noticed(smooth, built)
    response[0, 2, 1, 2] *= 1.001
    assert noticed(smooth, built) == {"responses of contacts"}


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (np.zeros((3, 2)), r" with shape \(3, 2\) instead of \(2, 3\)"),
        (np.zeros((3, 3)), r" with shape \(3, 3\) instead of \(2, 3\)"),
        ("heavy", ", which is no array of numbers"),
    ],
)
@pytest.mark.parametrize("name", ["joint_force", "joint_torque"])
def test_reactions_of_another_shape_are_named(name: str, wrong: object, words: str) -> None:
    """A row for each joint: of the transposed array the numbers would go to other joints and axes without a word."""
    element = element_of("double_pendulum")
    zeros = np.zeros((2, 3))
    sample = at_start(element, **({"joint_force": zeros, "joint_torque": zeros} | {name: wrong}))
    for read in (
        lambda: element.certify(right(element), sample),
        lambda: element.variables(np.zeros(1), [sample]),
    ):
        with pytest.raises(Diverged, match=f"^the engine gave {name}{words}"):
            read()


def test_a_wrong_start_is_noticed() -> None:
    """Other velocities of the bodies fail; a quaternion of the other sign is the same orientation."""
    element = element_of("slider_crank")
    assert noticed(element, right(element), v_WB=element.start.v_WB[0] + 0.1) == {"velocity"}
    assert noticed(element, right(element), q_WB=-element.start.q_WB[0]) == set()


def test_a_reaction_without_value_says_why() -> None:
    """What the equations do not determine, and what an engine does not give, have different reasons."""
    element = element_of("slider_crank")
    count = len(element.analysis.determinate)
    given = element.variables(np.zeros(1), [at_start(element, joint_force=np.ones((count, 3)))]).dataset()
    silent = element.variables(np.zeros(1), [at_start(element)]).dataset()
    assert given["force.pin.z"].attrs["absent"] == UNDETERMINED
    assert np.isnan(given["force.pin.z"]).all()
    assert "absent" not in given["force.pin.x"].attrs
    assert silent["force.pin.x"].attrs["absent"] == UNSAID
    assert silent["force.pin.z"].attrs["absent"] == UNDETERMINED


def test_reactions_in_part_are_not_observed() -> None:
    """An engine that gives no reactions is judged by its motion, and those of time 0 are the certificate's."""
    element = element_of("pendulum")
    silent = element.variables(np.arange(2.0), [at_start(element)] * 2).dataset()
    full = {"joint_force": np.ones((1, 3)), "joint_torque": np.ones((1, 3))}
    given = element.variables(np.arange(2.0), [at_start(element, **full)] * 2).dataset()
    assert "forces" not in element.observe(silent)
    assert element.observe(given)["forces"].shape == (1, 3)
    assert element.observe(given)["positions"].shape == (2, 1, 3)


def test_signs_of_failure() -> None:
    """A joint that opens shows, and so does energy from nowhere; the scene's own start shows neither."""
    element = element_of("pendulum")
    start = at_start(element)
    apart = at_start(element, p_WB=start.p_WB + 0.5)
    fast = at_start(element, w_WB=start.w_WB + 50.0)
    run = element.variables(np.arange(3.0), [start, apart, fast]).dataset()
    shown = {sign.name: sign.shown.tolist() for sign in element.signs(run, None)}
    assert shown[OPENED] == [False, True, False]
    assert shown[ENERGY_GAIN] == [False, True, True]
    assert set(shown) == set(element.failures)


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_is_drawn(name: str) -> None:
    """The drawing has a dot for each body and a circle for each joint that holds something, all of them in its box."""
    scene = load_scene(name)
    element = element_of(name)
    kind = kind_of(scene)
    assert kind is not None
    (drawing,), undrawn = kind.drawings([scene])
    x, y, width, height = drawing.box
    discs = [mark for mark in drawing.marks if isinstance(mark, Disc)]
    looks = [disc.look for disc in discs]
    assert undrawn == ""
    assert json.dumps(plain(drawing), allow_nan=False)
    assert looks.count("ball") == len(element.mechanism.bodies)
    assert looks.count("wall") == sum(joint.kind != "free" for joint in element.mechanism.joints)
    assert looks.count("ghost") == len(element.mechanism.loops)
    assert all(x <= disc.centre[0] <= x + width and y <= disc.centre[1] <= y + height for disc in discs)


def test_gravity_points_down_in_a_drawing() -> None:
    """The pendulum hangs below its pivot when it hangs in the scene."""
    scene = load_scene("pendulum", angle=0.0)
    kind = kind_of(scene)
    assert kind is not None
    discs = [mark for mark in kind.drawings([scene])[0][0].marks if isinstance(mark, Disc)]
    pivot, mass = (next(disc.centre for disc in discs if disc.look == look) for look in ("wall", "ball"))
    assert mass[1] > pivot[1] + 50
    assert mass[0] == pytest.approx(pivot[0], abs=0.2)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('parent = "world"', 'parent = "wall"', "there is no such body"),
        ('mass = "$mass"', "mass = -1.0", "mass"),
        ('kind = "revolute"', 'kind = "hinge"', "kind"),
    ],
)
def test_bad_input_is_one_line(tmp_path, old: str, new: str, said: str) -> None:
    """A file that holds no mechanism gives one line with the file and the place."""
    from proofroll.files.data_folders import data_folder

    text = (data_folder("models") / "pendulum" / "scene.toml").read_text()
    assert old in text
    (tmp_path / "scene.toml").write_text(text.replace(old, new))
    with pytest.raises(InputError) as caught:
        load_scene(str(tmp_path))
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.drill_of("oscillators-energy_change")
@pytest.mark.parametrize(("scene", "name"), [("pendulum", "energy_error"), ("oscillators", "energy_change")])
def test_a_change_of_energy_is_an_error_where_a_law_keeps_it(scene: str, name: str) -> None:
    """What is driven or damped changes its energy, and nothing calls that an error; the truth knows it with a bar."""
    run = simulate(scene, "projection", until=0.1)
    assert {"energy_error", "energy_change"} & set(map(str, run.data_vars)) == {name}
    assert simulate(scene, until=0.1)[name].attrs["error_bar"] > 0


@pytest.mark.parametrize(("scene", "marks"), [("gear_pair", ["gear"]), ("arm_pd", ["servo1", "servo2"]), ("stop", [])])
def test_drives_and_stops_are_drawn(scene: str, marks: list[str]) -> None:
    """An actuator has a ring and a coupling a line, both with their name; a stop has a stroke at its place."""
    element = load_scene(scene).elements[0]
    without = dataclasses.replace(
        element.mechanism,
        joints=tuple(dataclasses.replace(joint, limits=None) for joint in element.mechanism.joints),
        actuators=(),
        couplings=(),
    )
    full, bare = mechanism_drawing(element), mechanism_drawing(dataclasses.replace(element, mechanism=without))
    letters = ["".join(part.text for part in mark.parts) for mark in full.marks if isinstance(mark, Lettering)]
    assert set(marks) <= set(letters)
    assert len(full.marks) > len(bare.marks)


@pytest.mark.parametrize(
    ("scene", "outlines", "names"),
    [
        ("sled", 5, ["left", "right", "back"]),
        ("falling_rod", 3, ["contact"]),
        ("rattleback", 2, ["contact"]),
        ("tilted_disc", 2, ["contact"]),
    ],
)
def test_shapes_that_may_touch_are_drawn(scene: str, outlines: int, names: list[str]) -> None:
    """An outline for each shape, each plane, also shared, and each body of several places; names of closed contacts."""
    element = load_scene(scene).elements[0]
    smooth = dataclasses.replace(element.mechanism, geometries=(), pairs=())
    full, bare = mechanism_drawing(element), mechanism_drawing(dataclasses.replace(element, mechanism=smooth))
    letters = ["".join(part.text for part in mark.parts) for mark in full.marks if isinstance(mark, Lettering)]
    assert set(names) <= set(letters)
    assert len(full.marks) - len(bare.marks) == outlines + len(names)


def test_names_of_a_drawing_stand_apart() -> None:
    """Six contacts and three joints close to each other: no name covers another."""
    words = [mark for mark in mechanism_drawing(element_of("dominoes")).marks if isinstance(mark, Lettering)]
    assert len(words) >= 9
    for one, other in combinations(words, 2):
        letters = sum(len(part.text) for mark in (one, other) for part in mark.parts)
        assert abs(one.y - other.y) >= 10 or abs(one.x - other.x) >= 3.5 * letters, (one, other)


def test_the_natural_time_knows_servos_and_what_they_move() -> None:
    """A stiff servo sets the pace, with the inertia that a coupling reflects; one of several joints free does not."""
    assert element_of("servo", kp=1e6).natural_time == pytest.approx(2 * np.pi * 1e-3)
    gears = element_of("gear_pair").mechanism
    servo = Actuator("servo", gears.joints[0].name, "position", kp=90.0, gear=2.0)
    geared = MechanismElement(dataclasses.replace(gears, actuators=(servo,)))
    first, second, ratio = (load_scene("gear_pair").parameters[key] for key in ("first", "second", "ratio"))
    assert geared.natural_time == pytest.approx(2 * np.pi * np.sqrt((first + ratio**2 * second) / (4 * 90.0)))
    pair = element_of("double_pendulum").mechanism
    servo = Actuator("servo", pair.joints[0].name, "position", kp=1e6)
    assert MechanismElement(dataclasses.replace(pair, actuators=(servo,))).natural_time > 1.0


@pytest.mark.parametrize("force", [1e-6, 1.0])
def test_a_point_at_rest_is_as_large_as_its_motion(force: float) -> None:
    """Sizes that tolerances refer to grow with the force that moves a point from rest: no metre of ours decides."""
    slide = Joint("slide", "prismatic", "world", "b", axis=(1, 0, 0), torque=Formula(f"{force}*sin(t)", ()))
    scene = Scene("shaken", "", (MechanismElement(Mechanism((Body("b", 1.0),), (slide,), gravity=(0, 0, 0))),))
    found = scales(scene, truth(scene, np.linspace(0.0, 2.0, 5)))
    way = force * (2.0 - np.sin(2.0))
    assert found["q.slide"] == found["positions"] == pytest.approx(way)
    assert found["drift"] == pytest.approx(way)
    assert found["v_WB"] == pytest.approx(force * (1 - np.cos(2.0)))
    assert 0 < found["torques"] < force * way


def test_a_first_motion_ends_at_a_stop_or_where_friction_turns() -> None:
    """A fall by h lasts sqrt(2 h/g), a swing against friction v over its deceleration; a free hinge has no such end."""
    fall = element_of("stop", height=0.01).first_motion
    assert fall.lasts == pytest.approx(np.sqrt(2 * 0.01 / 9.81), rel=1e-12)  # round-off of a root
    swing = element_of("pendulum_friction", speed=1.0).first_motion
    assert swing.lasts == pytest.approx(1.0 / np.max(np.abs(swing.angular_acceleration)), rel=1e-12)
    assert element_of("double_pendulum").first_motion.lasts == np.inf


@pytest.mark.parametrize("beside", [0.0, 1e-17, -1e-17, 1e-13, -1e-10])
@pytest.mark.parametrize(
    ("speed", "acceleration", "lasts"), [(0.0, 0, np.inf), (1.0, -9.81, 2 / 9.81), (-1.0, -9.81, 0)]
)
def test_a_joint_beside_its_stop_by_rounding_is_at_it(
    beside: float, speed: float, acceleration: float, lasts: float
) -> None:
    """It rests there, leaves and comes back, or strikes at once; its truth rests too, with no event."""
    mechanism = element_of("stop").mechanism
    (guide,) = mechanism.joints
    guide = dataclasses.replace(guide, q0=(beside,), v0=(speed,), limits=(0.0, 2.0))
    mechanism = dataclasses.replace(mechanism, joints=(guide,))
    first = MechanismElement(mechanism).first_motion
    assert first.acceleration[0, 2] == acceleration
    assert first.lasts == pytest.approx(lasts, rel=1e-9)
    if not speed:
        found = truth_of(mechanism, np.array([0.0, 0.05]))
        assert (found.horizon, found.events) == (np.inf, ())
        assert found.record.q[-1, 0] == beside


@pytest.mark.drill
def test_without_tracked_points_the_followed_places_move() -> None:
    """Centres of mass are followed, not origins, which may lie on the hinge; a wheel is followed by its attitude."""
    hinge = Joint("hinge", "revolute", "world", "rod", axis=(0, 1, 0), q0=(0.7,), v0=(3.0,))
    rod, wheel = Body("rod", 1.0, (0, 0, -0.5), inertia=(0.1, 0.1, 0.01)), Body("rod", 1.0, inertia=(0.1, 0.1, 0.01))
    deciding = {}
    for name, body in (("rod", rod), ("wheel", wheel)):
        scene = Scene(name, "", (MechanismElement(Mechanism((body,), (hinge,))),))
        run = simulate(scene, "projection", until=0.1, every=0.1)
        deciding[name] = scene.deciding
        assert np.ptp(run[scene.deciding].to_numpy(), axis=0).max() > 1e-2
    assert deciding == {"rod": "positions", "wheel": "attitudes"}
    (centre,) = MechanismElement(Mechanism((rod,), (hinge,))).start.points[0]
    np.testing.assert_allclose(centre, [-0.5 * np.sin(0.7), 0, -0.5 * np.cos(0.7)], atol=1e-15)


def test_a_freedom_that_friction_holds_twice_has_no_force_to_compare_at_the_start() -> None:
    """Two joints of a coupling that rub at rest share the load in more ways than one: accelerations alone are known."""
    made = element_of("gear_pair").mechanism
    joints = tuple(dataclasses.replace(joint, friction=1e3, v0=(0.0,) * joint.nv) for joint in made.joints)
    held = MechanismElement(dataclasses.replace(made, joints=joints, actuators=()))
    assert np.isnan(held.first_wrench).all()
    assert not held.first_motion.acceleration.any()
