"""Capsules and cylinders on planes: their geometry, their closed forms, and what MuJoCo makes of the same shapes."""

from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from proofroll.core.errors import InputError
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.mechanism import Body, Joint, Mechanism, Tree
from proofroll.elements.mechanism.contact.start import touches
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair

RADIUS, LENGTH, MASS, GRAVITY = 0.1, 0.4, 2.0, 9.81
LEVEL = (0.0, 0.0, -GRAVITY)
AXIAL, ACROSS = MASS * RADIUS**2 / 2, MASS * (3 * RADIUS**2 + LENGTH**2) / 12  # moments of a solid cylinder
KINDS = ("capsule", "cylinder")


def on_plane(kind: Any, q0: tuple[float, ...], gravity: tuple[float, ...] = LEVEL, **law: float) -> Mechanism:
    """A free body with a long shape along its y axis, above the plane z = 0."""
    body = Body("b", MASS, inertia=(ACROSS, AXIAL, ACROSS))
    shapes = (
        Geometry("log", "b", kind, radius=RADIUS, length=LENGTH, axis=(0, 1, 0)),
        Geometry("floor", "world", "plane"),
    )
    pair = Pair("touch", ("log", "floor"), **({"friction": 0.5} | law))
    joint = Joint("j", "free", "world", "b", q0=q0)
    return Mechanism((body,), (joint,), gravity=gravity, geometries=shapes, pairs=(pair,))


def followed(mechanism: Mechanism, times: Any) -> Any:
    """Truth of a mechanism."""
    return truth(Scene("log", "", (MechanismElement(mechanism),)), times)


@pytest.mark.drill
@pytest.mark.parametrize("kind", KINDS)
@given(seed=st.integers(0, 1000))
@settings(max_examples=20)
def test_the_nearest_end_is_the_distance_of_the_whole_shape(kind: str, seed: int) -> None:
    """In any attitude the least gap of both ends is the distance that MuJoCo finds for its own capsule or cylinder."""
    x, y, z, w = Rotation.random(random_state=seed).as_quat().tolist()
    mechanism = on_plane(kind, (0.3, -0.2, 1.0, w, x, y, z))
    least = min(each.gap for each in touches(mechanism, Tree(mechanism).at(*mechanism.start())))
    spec = mujoco.MjSpec()
    plane, geom = mujoco.mjtGeom.mjGEOM_PLANE, getattr(mujoco.mjtGeom, f"mjGEOM_{kind.upper()}")
    spec.worldbody.add_geom(name="floor", type=plane, size=(0, 0, 1), margin=9.0)
    attitude = Rotation.from_quat([x, y, z, w]) * Rotation.from_euler("x", -90, degrees=True)  # MuJoCo's axis is z
    spec.worldbody.add_body(pos=(0.3, -0.2, 1.0), quat=attitude.as_quat(scalar_first=True)).add_geom(
        name="log", type=geom, size=(RADIUS, LENGTH / 2, 0), margin=9.0
    )
    spec.worldbody.bodies[0].add_freejoint()
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert least == pytest.approx(min(contact.dist for contact in data.contact), abs=1e-12)


@pytest.mark.nightly_of("capsule")
@pytest.mark.nightly
@pytest.mark.parametrize("kind", KINDS)
def test_a_long_body_rolls_down_a_slope(kind: str) -> None:
    """On its side it rolls with g sin α/(1 + I/(m r²)) and both ends bear half of its weight."""
    slope = 0.3
    rolling = followed(
        on_plane(kind, (0, 0, RADIUS, 1, 0, 0, 0), (GRAVITY * np.sin(slope), 0.0, -GRAVITY * np.cos(slope))),
        np.linspace(0.0, 0.2, 3),
    )
    way = 0.5 * GRAVITY * np.sin(slope) / (1 + AXIAL / (MASS * RADIUS**2)) * rolling.time.values**2
    np.testing.assert_allclose(rolling["p_WB"].values[:, 0, 0], way, rtol=0, atol=1e-14)
    np.testing.assert_allclose(rolling["w_WB"].values[-1, 0], [0, 2 * way[-1] / 0.2 / RADIUS, 0], atol=1e-12)
    ends = [rolling[f"force.touch.{end}.z"].values[-1] for end in (1, 2)]
    np.testing.assert_allclose(ends, MASS * GRAVITY * np.cos(slope) / 2, atol=1e-9)


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize("kind", KINDS)
def test_a_long_body_strikes_with_its_lower_end(kind: str) -> None:
    """Dropped with a tilt it strikes with the lower end, at the time and with the jumps of a body struck once."""
    tilt, height = 0.5, 0.6
    w, x = np.cos(tilt / 2), np.sin(tilt / 2)
    drop = followed(on_plane(kind, (0, 0, height, w, x, 0, 0), friction=0.0), np.linspace(0.0, 0.3, 4))
    if kind == "capsule":  # its end's sphere: the arm is level, and the sphere's radius has no part in it
        arm, depth = LENGTH / 2 * np.cos(tilt), LENGTH / 2 * np.sin(tilt) + RADIUS
    else:
        arm = LENGTH / 2 * np.cos(tilt) - RADIUS * np.sin(tilt)
        depth = LENGTH / 2 * np.sin(tilt) + RADIUS * np.cos(tilt)
    time = np.sqrt(2 * (height - depth) / GRAVITY)
    assert drop["event_time"].values[0] == pytest.approx(time, abs=1e-13)
    push = GRAVITY * time / (1 / MASS + arm**2 / ACROSS)  # ends the speed of the place that strikes
    assert abs(drop["w_WB"].values[-1, 0, 0]) == pytest.approx(push * arm / ACROSS, rel=1e-12)


@pytest.mark.drill
def test_a_cylinder_lands_on_its_end_and_stands() -> None:
    """A face that lands on its whole rim stays there, and bears the weight."""
    q0 = (0, 0, LENGTH / 2 + 0.05, np.sqrt(0.5), np.sqrt(0.5), 0, 0)
    found = followed(on_plane("cylinder", q0), np.linspace(0.0, 0.2, 5))
    assert "ended" not in found.attrs
    assert found["event_time"].values[0] == pytest.approx(np.sqrt(0.1 / GRAVITY), abs=1e-12)
    heights = found["p_WB"].values[:, 0, 2]
    fall = LENGTH / 2 + 0.05 - GRAVITY / 2 * np.array([0, 0.05, 0.1]) ** 2
    np.testing.assert_allclose(heights, [*fall, LENGTH / 2, LENGTH / 2], atol=1e-13)
    ends = [found[f"force.touch.{end}.z"].values[-1] for end in (1, 2)]
    np.testing.assert_allclose(sorted(ends), [0, MASS * GRAVITY], atol=1e-11)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"length": None}, "geometries.log.length is missing: a capsule needs it; add it"),
        ({"length": 0.0}, "geometries.log.length = 0.0: give one above 0; without it this is a sphere or a circle"),
        ({"length": -1.0}, "geometries.log.length = -1.0: must be at least 0"),
        ({"length": float("nan")}, "geometries.log.length = nan: must be finite"),
        ({"radius": 0.0}, "geometries.log.radius = 0.0: a capsule has a radius above 0"),
        ({"axis": (0, 0, 0)}, "geometries.log.axis"),
        ({"size": (1, 1, 1)}, "geometries.log.size = (1, 1, 1): a capsule has none; it has radius and length and axis"),
    ],
)
def test_a_long_body_that_is_none_is_one_line(changes: dict[str, Any], said: str) -> None:
    """Each number that no such shape has names its field, its value and what to do."""
    with pytest.raises(InputError) as error:
        Geometry(**({"name": "log", "body": "b", "kind": "capsule", "radius": 0.1, "length": 0.3} | changes))
    assert str(error.value).startswith(said)


@pytest.mark.parametrize("key", ["rolling_resistance", "spinning_friction"])
def test_resistance_at_two_ends_is_refused(key: str) -> None:
    """Friction against turning at both ends of one body is one line, as no route of the truth follows it."""
    with pytest.raises(InputError, match=rf"pairs\.touch\.{key} = 0\.001: a capsule touches at two ends"):
        on_plane("capsule", (0, 0, 1, 1, 0, 0, 0), **{key: 1e-3})


def test_a_capsule_and_a_cylinder_have_no_rule() -> None:
    """Such a pair is refused with those that there are."""
    body = on_plane("capsule", (0, 0, 1, 1, 0, 0, 0))
    shapes = (body.geometries[0], Geometry("post", "world", "cylinder", radius=0.1, length=1.0))
    with pytest.raises(InputError, match="only a plane with a sphere, ellipsoid, circle, box, capsule or cylinder"):
        Mechanism(body.bodies, body.joints, geometries=shapes, pairs=(Pair("hit", ("log", "post"), 0.1),))
