"""Bodies that touch in Exudyn: penalty contacts of spheres, pressed in from the start."""

import numpy as np
import pytest
from mechanism_scenes import mechanism_named

from proofroll.core.errors import Refused
from proofroll.core.plugins import load_engine
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.files.scene_file import load_scene

pytest.importorskip("exudyn")

EXUDYN = load_engine("exudyn")
MATCHED = EXUDYN.presets["spheres"]["matched"]
FLOOR = Geometry("floor", "world", "plane")
SLED = ((0.15, 0.10, -0.08), (0.15, -0.10, -0.08), (-0.20, 0.03, -0.08))
G = 9.81


def touching(*geometries, pairs, height, v0=(0,) * 6):
    """A free body of 2 kg at a height, with these geometries and pairs."""
    joint = Joint("j", "free", "world", "b", q0=(0, 0, height, 1, 0, 0, 0), v0=v0)
    return Mechanism((Body("b", mass=2.0, inertia=(0.02, 0.03, 0.04)),), (joint,), geometries=geometries, pairs=pairs)


def sled(*, turned=False, mu=0.3, v0=(1.5, 0.3, 0, 0, 0, 6)):
    """The body on three spheres of 2 cm; ``turned``: with the floor as the first geometry."""
    feet = tuple(Geometry(f"f{k}", "b", "sphere", place, radius=0.02) for k, place in enumerate(SLED))
    order = -1 if turned else 1
    pairs = tuple(Pair(f"p{k}", (f"f{k}", "floor")[::order], mu) for k in range(3))
    return touching(FLOOR, *feet, pairs=pairs, height=0.1, v0=v0)


@pytest.mark.parametrize("turned", [False, True])
def test_a_slipping_start_is_certified(turned):
    """Geometry, friction, first forces and accelerations of a sliding sled are the scene's, either way round."""
    mechanism = sled(turned=turned)
    element, run = MechanismElement(mechanism), EXUDYN.build(mechanism, MATCHED)
    lines = element.certify(run.built(), run.sample())
    assert [line.quantity for line in lines if not line.holds] == []
    told = {line.quantity for line in lines if line.difference is not None}
    assert {"gaps", "normals of contact", "places of contact", "friction of contacts", "acceleration"} <= told
    assert element._pressed is not None
    np.testing.assert_allclose(run.sample().contact_force, element._pressed.force, rtol=1e-6)


def test_two_spheres_press_apart():
    """A sphere that stands on another one is pressed up, and told so on the body of the first geometry."""
    geometries = (
        Geometry("low", "world", "sphere", radius=0.2),
        Geometry("high", "b", "sphere", radius=0.1),
    )
    for names, sign in ((("high", "low"), 1.0), (("low", "high"), -1.0)):
        run = EXUDYN.build(touching(*geometries, pairs=(Pair("p", names, 0.3),), height=0.3), MATCHED)
        np.testing.assert_allclose(run.sample().contact_force, [[0, 0, sign * 2 * G]], atol=1e-6)
        run.advance(0.01)
        np.testing.assert_allclose(run.sample().contact_force, [[0, 0, sign * 2 * G]], atol=1e-3)
        assert run.sample().p_WB[0, 2] == pytest.approx(0.3, abs=1e-6)


@pytest.mark.parametrize(
    ("geometry", "pair", "said"),
    [
        (
            Geometry("g", "b", "sphere", radius=0.0),
            {},
            r"ends of cables\), and Exudyn's contacts are of spheres with a radius",
        ),
        (
            Geometry("g", "b", "ellipsoid", axes=(0.1, 0.2, 0.3)),
            {},
            "contact of ellipsoids, and Exudyn's contacts are of spheres with a radius",
        ),
        (Geometry("g", "b", "sphere", radius=0.1), {"restitution": 0.5}, "restitution"),
    ],
)
def test_shapes_and_impacts_that_exudyn_lacks_are_refused(geometry, pair, said):
    """Corners, ellipsoids and restitution are refused, each with its reason."""
    with pytest.raises(Refused, match=said):
        EXUDYN.build(touching(FLOOR, geometry, pairs=(Pair("p", ("g", "floor"), 0.3, **pair),), height=1.0), MATCHED)


def test_a_capsule_touches_planes_with_its_ends_alone():
    """A capsule runs on a plane, of which its side is refused against a sphere."""
    capsule = Geometry("g", "b", "capsule", radius=0.1, length=0.2, axis=(1.0, 0.0, 0.0))
    run = EXUDYN.build(touching(FLOOR, capsule, pairs=(Pair("p", ("g", "floor"), 0.3),), height=0.1), MATCHED)
    assert run.sample().contact_force[:, 2].sum() == pytest.approx(2 * G, rel=1e-6)
    ball = Geometry("ball", "world", "sphere", radius=0.1)
    with pytest.raises(Refused, match="the side of a capsule touches in p"):
        EXUDYN.build(touching(ball, capsule, pairs=(Pair("p", ("g", "ball"), 0.3),), height=0.3), MATCHED)


def test_what_sinks_in_beyond_its_wall_is_refused():
    """A ball that its load at the start presses through the opposite side of its wall is refused, with the depth."""
    heavy = mechanism_named("sphere_in_cylinder", mass=6e3, mu_static=0.35)
    with pytest.raises(Refused, match=r"ball_on_wall starts 0\.48 m deep in a contact of 1e\+06 N/m, beyond its wall"):
        EXUDYN.build(heavy, MATCHED)


def test_friction_above_half_the_load_builds_up_unseen():
    """First forces of a slow ball, whose friction has yet to build up to nearly its normal force, prove nothing."""
    scene = load_scene("sphere_in_cylinder", speed=0.8, mu_static=5.0)
    (element,), run = scene.elements, EXUDYN.build(scene, MATCHED)
    lines = element.certify(run.built(), run.sample())
    assert [str(line) for line in lines if not line.holds] == []
    assert next(line for line in lines if line.quantity == "forces of contact").difference is None


def test_friction_beyond_the_coefficient_that_stands_for_unbounded_is_refused():
    """A ball that hardly presses needs 200 times its normal force, which that coefficient does not hold."""
    with pytest.raises(Refused, match=r"ball_on_wall needs a friction of .* a coefficient of 100 stands for unbounded"):
        EXUDYN.build(load_scene("sphere_in_cylinder", speed=0.05), MATCHED)


def test_a_run_that_begins_anew_is_at_its_time():
    """After an instant of a controller Exudyn's own clock, by which it says when it stops, goes on."""
    run = EXUDYN.build(sled(), MATCHED)
    run.advance(0.01)
    again = run.integration.again()
    assert (again.t, again.solver.it.currentTime) == (0.01, 0.01)
    run.integration = again
    run.advance(0.02)
    assert again.solver.it.currentTime == pytest.approx(0.02)


def test_a_contact_that_newton_does_not_solve_has_two_remedies():
    """A contact may be too sharp for any step: its friction zone is named, where there is one."""
    spheres = EXUDYN.build(sled(), MATCHED).integration
    smooth = EXUDYN.build(mechanism_named("double_pendulum"), EXUDYN.presets["tree"]["matched"]).integration
    for integration, named in ((spheres, True), (smooth, False)):
        integration.solver.conv.newtonConverged = False
        assert ("or a larger friction_zone" in integration._reason()) is named
