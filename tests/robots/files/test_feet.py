"""Shapes, floors and pairs of robot files: what MuJoCo's own search says becomes the scene, or is refused by name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from proofroll import load_scene, simulate
from proofroll.core.dataset import ENDED, ENDS
from proofroll.core.errors import InputError
from proofroll.core.scene import Scene
from proofroll.elements.mechanism import Tree
from proofroll.elements.mechanism.contact.start import touches
from proofroll.files.scene_sources import source_of, with_control
from proofroll.robots.protocol import lift

pytest.importorskip("mujoco")
pytestmark = pytest.mark.drill

# A trunk on three bent legs, each a hip and a foot; its home pose lies 3 cm below the floor that it stands on.
FOOT = '<geom name="{name}_foot" type="sphere" size=".02" pos="0 0 -.2" friction=".4" priority="1"/>'
BLOCK = 'type="box" size=".02 .015 .02"'
LEG = (
    '<body name="{name}" pos="{x} {y} 0"><joint name="{name}_hip" axis="0 1 0" damping=".1" frictionloss=".05" '
    'armature=".01"/><inertial mass=".3" pos="0 0 -.1" diaginertia="1e-3 1e-3 2e-4"/>{foot}</body>'
)
FEET = {"left_foot", "right_foot", "rear_foot"}
PLACES = {"left": (0.15, 0.1), "right": (0.15, -0.1), "rear": (-0.2, 0.0)}
CONTROL = "rate = 50\n[pose]\nleft_hip = 0.1\n[ground]\n"


def robot(foot: str = FOOT, trunk: str = "", after: str = "", z: float = 0.19) -> str:
    """MJCF of the robot."""
    legs = "".join(LEG.format(name=name, x=x, y=y, foot=foot.format(name=name)) for name, (x, y) in PLACES.items())
    servos = "".join(f'<position joint="{name}_hip" kp="20" kv=".5"/>' for name in PLACES)
    return (
        '<mujoco model="stool"><worldbody><geom name="floor" type="plane" size="0 0 1" friction="1"/>'
        f'<body name="trunk" pos="0 0 {z}"><freejoint name="root"/>'
        f'<inertial mass="3" pos="0 0 0" diaginertia=".02 .03 .04"/>{trunk}{legs}</body></worldbody>'
        f"<actuator>{servos}</actuator>{after}</mujoco>"
    )


@pytest.fixture
def stood(tmp_path: Path) -> Callable[..., Scene]:
    """Scene of a robot's text under a controller's."""

    def scene(text: str, control: str = CONTROL, ending: str = "xml", **parameters: float) -> Scene:
        path, controller = tmp_path / f"stool.{ending}", tmp_path / "stand.toml"
        path.write_text(text, encoding="utf-8")
        controller.write_text(control, encoding="utf-8")
        return load_scene(with_control(str(path), controller), **parameters)

    return scene


def _pairs(scene: Scene) -> dict[str, Any]:
    return {pair.name: pair for pair in scene.elements[0].mechanism.pairs}  # type: ignore[attr-defined]


def _height(scene: Scene) -> float:
    joints = scene.elements[0].mechanism.joints  # type: ignore[attr-defined]
    return next(float(joint.q0[2]) for joint in joints if joint.kind == "free")


def test_feet_stand_on_the_floor_of_the_file(stood: Callable[..., Scene]) -> None:
    """Friction is as MuJoCo combines it, by priority; the robot is lifted out of its floor, and words say so."""
    scene = stood(robot())
    pairs = _pairs(scene)
    assert {name: pair.friction for name, pair in pairs.items()} == dict.fromkeys(
        [f"{name}_foot on floor" for name in PLACES], 0.4
    )
    # the turned leg is shorter, so the others are the lowest: 3 cm below the floor, then 1 cm above it
    assert _height(scene) == pytest.approx(0.23, abs=1e-12)
    assert "3 shapes on a floor, friction 0.4; moved up by 40 mm" in scene.title
    assert "contacts" not in scene.omitted
    assert stood(robot(), ground=0).omitted[-1] == "contacts"


def test_a_drop_is_the_height_of_the_lowest_foot(stood: Callable[..., Scene]) -> None:
    """[start] drop puts the lowest shape there, from above or below."""
    for z in (0.1, 0.5):
        assert _height(stood(robot(z=z), CONTROL + "[start]\ndrop = 0.05\n")) == pytest.approx(0.27, abs=1e-12)


def test_a_drop_of_what_does_not_float_is_refused(stood: Callable[..., Scene]) -> None:
    """A trunk on a slide is where its coordinate says: a drop is one line of advice, and none is needed."""
    held = robot(z=0.25).replace('<freejoint name="root"/>', '<joint name="up" type="slide" axis="0 0 1"/>')
    with pytest.raises(InputError, match=r"start\.drop = 0\.05: nothing here floats over a floor"):
        stood(held, CONTROL + "[start]\ndrop = 0.05\n")
    assert "moved up" not in stood(held).title


def test_excluded_pairs_do_not_touch(stood: Callable[..., Scene]) -> None:
    """What the file excludes, or gives laws of its own, is as the file says."""
    after = (
        '<contact><exclude body1="rear" body2="world"/>'
        '<pair geom1="left_foot" geom2="floor" friction=".9 .9 .005 .0001 .0001"/></contact>'
    )
    pairs = _pairs(stood(robot(after=after)))
    assert {name: pair.friction for name, pair in pairs.items()} == {
        "left_foot on floor": 0.9, "right_foot on floor": 0.4,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("asked", "end"), [("", 0.02), ("feet = {left = 0.02}\n", None), ("[start]\ndrop = 0.08\n", 0.024)]
)
def test_a_motion_ends_where_shapes_touch_that_the_scene_has_no_pair_of(
    stood: Callable[..., Scene], tmp_path: Path, asked: str, end: float | None
) -> None:
    """A belly that the scout never saw near the floor ends a motion that sinks onto it; feet that sink end none."""
    belly = '<geom name="belly" type="box" size=".1 .1 .02" mass="0"/>'
    scene = stood(robot(trunk=belly), CONTROL + asked)
    assert {pair.partition(" on ")[0] for pair in _pairs(scene)} == ({"left"} if end is None else FEET)
    motion = simulate(scene, "mujoco", until=0.04, every=0.004, formulation="geoms")
    sinks = (0.05 * np.arange(11))[:, None, None] * [0.0, 0.0, 1.0]
    motion = motion.assign(p_WB=(motion["p_WB"].dims, motion["p_WB"].values[:1] - sinks))
    source, path = source_of(with_control(str(tmp_path / "stool.xml"), tmp_path / "stand.toml")) or (None, Path())
    cut = source.until_met(path, scene, motion)
    assert cut.attrs.get(ENDS) == (end and pytest.approx(end))
    if end is not None:
        assert cut.attrs[ENDED] == "floor and belly touch, a pair that the scene lacks"
        assert cut.sizes["time"] == round(end / 0.004)


@pytest.mark.one_in(2)
@pytest.mark.parametrize(("mesh", "radius"), [(False, 0.02), (True, 0.0)], ids=["balls", "meshes"])
def test_half_a_margin_is_a_larger_radius_and_half_a_higher_floor(
    stood: Callable[..., Scene], mesh: bool, radius: float
) -> None:
    """A contact that presses from a distance on does so in the middle, of balls and of the corners of a mesh."""
    text = robot(FOOT.replace("size", 'margin=".005" size'))
    if mesh:
        text = robot(HOOF.replace("mesh=", 'margin=".005" mesh='), after=hoof())
    shapes = stood(text).elements[0].mechanism.geometries  # type: ignore[attr-defined]
    assert {shape.radius for shape in shapes if shape.kind == "sphere"} == {radius + 0.0025}
    assert {shape.position[2] for shape in shapes if shape.kind == "plane"} == {0.0025}


@pytest.mark.one_in(3)
@pytest.mark.parametrize("shape", ['type="sphere" size=".02"', BLOCK, 'type="capsule" size=".02 .02"'])
def test_turning_friction_of_feet_is_taken(stood: Callable[..., Scene], shape: str) -> None:
    """Condim 4 adds friction against spin and 6 against rolling, with the file's lengths, in the cone of sliding."""
    foot = FOOT.replace('type="sphere" size=".02"', shape).replace(
        'friction=".4"', 'condim="6" friction=".4 .003 .0002"'
    )
    for text, rolling in ((foot, 0.0002), (foot.replace('condim="6"', 'condim="4"'), 0.0)):
        pair = _pairs(stood(robot(text)))["rear_foot on floor"]
        assert (pair.spinning_friction, pair.rolling_resistance, pair.cone) == (0.003, rolling, "shared")
    assert _pairs(stood(robot(foot), CONTROL + "friction = 0\n"))["rear_foot on floor"].cone == "separate"


@pytest.mark.one_in(2)
@pytest.mark.parametrize(
    ("foot", "says"),
    [
        (FOOT.replace("priority", 'solref=".02 .1" priority'), "rebounds"),
        (FOOT.replace('"sphere" size=".02"', '"box" size=".02 .02 .02" margin=".01"'), "a margin of 0.01 m around box"),
    ],
)
def test_what_no_scene_has_is_refused_by_name(stood: Callable[..., Scene], foot: str, says: str) -> None:
    """Shapes that touch without a rule are named with the reason, and with what can be done."""
    with pytest.raises(InputError) as caught:
        stood(robot(foot))
    for text in ("left_foot and floor", says, "2 other pairs", "[ground] feet"):
        assert text in str(caught.value)


def test_balls_may_stand_for_feet(stood: Callable[..., Scene]) -> None:
    """[ground] feet puts balls at the origins of links, on z = 0, and names a link that is not there."""
    control = CONTROL + "feet = {left = 0.03, rear = 0.04}\nfriction = 0.7\n"
    scene = stood(robot(), control)
    assert {name: pair.friction for name, pair in _pairs(scene).items()} == {"left": 0.7, "rear": 0.7}
    with pytest.raises(InputError, match=r"ground.feet = 'front': the robot has no such link; choose from \w"):
        stood(robot(), CONTROL + "feet = {front = 0.03}\n")


def test_a_plane_stands_under_a_file_without_a_floor(stood: Callable[..., Scene]) -> None:
    """Ground = 2 adds the plane; with the file's own floor alone there is none."""
    bare = robot().replace('<geom name="floor" type="plane" size="0 0 1" friction="1"/>', "")
    assert len(_pairs(stood(bare, ground=2))) == 3
    with pytest.raises(InputError, match="take --ground plane"):
        stood(bare, ground=1)


@pytest.mark.one_in(2)
@pytest.mark.parametrize("after", ["", '<contact><pair geom1="left_foot" geom2="floor"/></contact>'])
def test_a_plane_takes_the_place_of_the_floor_of_a_file(stood: Callable[..., Scene], after: str) -> None:
    """Ground = 2 lets each foot touch the plane z = 0 alone, wherever the file's floor is and whatever its name."""
    high = robot(after=after).replace('type="plane"', 'type="plane" pos="0 0 1"')
    scene = stood(high, ground=2)
    assert len(_pairs(scene)) == 3
    assert _height(scene) == pytest.approx(_height(stood(robot(), ground=2)))


def test_meshes_that_collide_are_told(stood: Callable[..., Scene]) -> None:
    """A mesh whose file is not there takes no part, and the answer says so."""
    trunk = '<geom name="shell" type="mesh" mesh="shell"/>'
    text = robot(trunk=trunk).replace("<worldbody>", '<asset><mesh name="shell" file="no.stl"/></asset><worldbody>')
    assert "collision meshes of trunk" in stood(text).omitted


# A foot of three corners and one above them, with points of no meaning: on a face, on an edge and within.
CORNERS = ((-0.02, -0.01, -0.2), (0.03, -0.01, -0.2), (0.0, 0.02, -0.2), (0.0, 0.0, -0.17))
WITHIN = ((0.0, 0.0, -0.2), (0.005, -0.01, -0.2), (0.0, 0.0, -0.19))
HOOF = FOOT.replace('type="sphere" size=".02" pos="0 0 -.2"', 'type="mesh" mesh="hoof"')


def hoof(points: Any = CORNERS + WITHIN) -> str:
    """Asset of a mesh of these points."""
    return f'<asset><mesh name="hoof" vertex="{" ".join(str(x) for point in points for x in point)}"/></asset>'


def test_a_mesh_stands_on_the_corners_of_its_hull(stood: Callable[..., Scene]) -> None:
    """Each corner is a vertex on the link, and what lies within the hull or on its faces is none."""
    scene = stood(robot(HOOF, after=hoof()))
    assert "3 shapes on a floor, friction 0.4" in scene.title
    assert "mesh" not in scene.omitted
    assert set(_pairs(scene)) == {f"{name}_foot corner {k} on floor" for name in PLACES for k in range(1, 5)}
    mechanism = scene.elements[0].mechanism  # type: ignore[attr-defined]
    for name in PLACES:
        places = [shape.position for shape in mechanism.geometries if shape.name.startswith(name)]
        apart = np.linalg.norm(np.array(places)[:, None] - np.array(CORNERS), axis=-1)
        assert apart.min(axis=0).max() < 1e-8  # MuJoCo's are of 32 bits
    assert {shape.radius for shape in mechanism.geometries if shape.kind == "sphere"} == {0.0}


@pytest.mark.nightly
def test_a_mesh_in_a_file_stands_as_one_in_the_text(stood: Callable[..., Scene], tmp_path: Path) -> None:
    """Its file is read from the folder that the compiler names, where it collides."""
    (tmp_path / "parts").mkdir()
    points = "".join(f"v {x} {y} {z}\n" for x, y, z in CORNERS)
    (tmp_path / "parts" / "hoof.obj").write_text(points + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    named = '<compiler meshdir="parts"/><asset><mesh name="hoof" file="hoof.obj"/></asset>'
    assert set(_pairs(stood(robot(HOOF, after=named)))) == set(_pairs(stood(robot(HOOF, after=hoof()))))
    looks = stood(robot(FOOT + HOOF.replace('name="{name}_foot"', 'contype="0" conaffinity="0"'), after=named))
    assert len(_pairs(looks)) == 3
    assert "mesh" not in looks.omitted


def test_a_mesh_of_very_many_corners_is_refused_by_its_number(stood: Callable[..., Scene]) -> None:
    """A hull of more corners than the bound is named, with the number and with balls in its place."""
    turn = np.linspace(0, 2 * np.pi, 66, endpoint=False)
    wide = [*np.stack([0.03 * np.cos(turn), 0.03 * np.sin(turn), 0 * turn - 0.2], axis=1).tolist(), CORNERS[-1]]
    with pytest.raises(InputError) as caught:
        stood(robot(HOOF, after=hoof(wide)))
    for text in ("left_foot and floor", "a mesh whose convex hull has 67 corners; at most 64", "[ground] feet"):
        assert text in str(caught.value)


@pytest.mark.one_in(2)
@pytest.mark.parametrize(("gap", "touches"), [(0.01, False), (-0.01, True)])
def test_a_mesh_on_another_shape_has_no_contact(stood: Callable[..., Scene], gap: float, touches: bool) -> None:
    """Where it touches one that is no plane, both are named with the pair; where it comes near, they are left out."""
    wall = f'<geom name="wall" type="sphere" size=".1" pos="{0.15 + 0.03 + 0.1 + gap} .1 0"/>'
    text = robot(HOOF, after=hoof(), trunk=FOOT.format(name="trunk")).replace("</worldbody>", f"{wall}</worldbody>")
    control = CONTROL.replace("left_hip = 0.1", "left_hip = 0")
    if touches:
        with pytest.raises(InputError, match=r"no contact of left_foot and wall \(mesh on sphere\);"):
            stood(text, control)
        return
    assert any(
        "left_foot and wall, " in words and "(mesh on sphere)" in words for words in stood(text, control).omitted
    )


URDF = """<robot name="stool"><link name="trunk"><inertial><mass value="3"/>
<inertia ixx=".02" iyy=".03" izz=".04" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><origin xyz="0 0 -.1"/><geometry><box size=".4 .2 .1"/></geometry></collision>
<collision><geometry><mesh filename="package://a/b.stl"/></geometry></collision></link>{links}</robot>"""


def test_a_urdf_stands_on_a_plane(stood: Callable[..., Scene]) -> None:
    """Its collision shapes that come near the plane z = 0 touch it, with friction 1 unless the controller says."""
    scene = stood(URDF.format(links=""), "rate = 50\n[ground]\n", "urdf")
    (pair,) = _pairs(scene).values()
    assert pair.friction == 1
    assert _height(scene) == pytest.approx(0.16, abs=1e-12)
    assert "collision meshes of trunk" in scene.omitted
    rough = stood(URDF.format(links=""), "rate = 50\n[ground]\nfriction = 0.3\n", "urdf")
    assert [pair.friction for pair in _pairs(rough).values()] == [0.3]


# Solids that fall on a table, which is a box, turned about the vertical; of the mesh see above.
TIN = '<geom name="tin" {shape} friction=".4"/>'
SHAPES = {
    "box": 'type="box" size=".04 .05 .06"',
    "cylinder": 'type="cylinder" size=".04 .06"',
    "ellipsoid": 'type="ellipsoid" size=".04 .05 .06"',
    "mesh": 'type="mesh" mesh="hoof"',
}


def table(kind: str, place: str = ".1 .2", turn: str = "0.9659258 0.258819 0.1 0") -> str:
    """MJCF of a solid 9 cm above a table."""
    return (
        (
            f'<mujoco model="table">{hoof()}<worldbody><geom name="table" type="box" size=".5 .4 .1" pos="0 0 -.1" '
            f'euler="0 0 20"/><body name="can" pos="{place} .09" quat="{turn}"><freejoint name="root"/>'
            f'<inertial mass=".5" pos="0 0 0" diaginertia="8e-4 8e-4 4e-4"/>{TIN.format(shape=SHAPES[kind])}</body>'
            "</worldbody></mujoco>"
        )
        .replace("-0.2 ", "-0.02 ")
        .replace('-0.2"', '-0.02"')
        .replace("-0.17", "0.05")
        .replace("-0.19", "0.0")
    )


BARE = "rate = 50\n[ground]\n"


@pytest.mark.one_in(3)
@pytest.mark.parametrize("kind", [kind for kind in SHAPES if kind != "box"])
def test_solids_on_a_box_are_as_far_from_its_face_as_from_the_box(stood: Callable[..., Scene], kind: str) -> None:
    """In any attitude above the face the least gap is the distance of both convex bodies, with the face's normal."""
    import mujoco

    scene = stood(table(kind), BARE)
    (element,) = scene.elements
    mechanism = element.mechanism  # type: ignore[attr-defined]
    assert "edges of table face +z, which is endless for tin" in scene.omitted
    assert "no floor" in scene.title
    model = mujoco.MjModel.from_xml_string(table(kind))
    model.opt.ccd_tolerance, model.opt.ccd_iterations = 1e-12, 500
    data, ends = mujoco.MjData(model), np.zeros(6)
    rng, (joint,) = np.random.default_rng(3), mechanism.joints
    for _ in range(20):
        turn = rng.normal(size=4)
        q = [*rng.uniform(-0.1, 0.1, 2), rng.uniform(0.08, 0.2), *(turn / np.linalg.norm(turn))]
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        apart = mujoco.mj_geomDistance(model, data, 0, 1, 1.0, ends)
        placed = replace(mechanism, joints=(replace(joint, q0=tuple(q)),))
        nearest = min(touches(placed, Tree(placed).at(*placed.start())), key=lambda touch: touch.gap)
        assert nearest.gap == pytest.approx(apart, abs=1e-8)
        assert nearest.normal == pytest.approx((ends[3:] - ends[:3]) / apart, abs=1e-5)


def test_a_solid_at_the_edge_of_a_box_is_refused_by_name(stood: Callable[..., Scene]) -> None:
    """Where it meets an edge no face stands for the box; a box that moves has none either."""
    beyond = table("cylinder", place=".5 .15", turn="1 0 0 0")
    moving = table("cylinder").replace(
        '<geom name="table"', '<body name="lift"><joint type="slide" axis="1 0 0"/><geom name="table"'
    )
    moving = moving.replace('euler="0 0 20"/>', 'euler="0 0 20"/></body>')
    for text in (beyond, moving):
        with pytest.raises(InputError, match=r"no contact of (tin and table|table and tin) \((cylinder|box) on "):
            stood(text, BARE)


def test_no_body_is_lifted_out_of_a_face_that_looks_down(stood: Callable[..., Scene]) -> None:
    """A body that begins within a plate and leaves it downwards is refused by the overlap, and is not lifted."""
    plate = '<geom name="plate" type="box" size=".5 .4 .1" pos="0 0 .16"/>'
    within = table("cylinder", turn="1 0 0 0").replace(' .09"', ' .061"').replace("<worldbody>", f"<worldbody>{plate}")
    with pytest.raises(InputError, match=r"tin and plate face -z \(they overlap by 61 mm at the start"):
        stood(within, BARE)


def test_a_solid_beside_a_wall_is_not_lifted_by_it(stood: Callable[..., Scene]) -> None:
    """Planes that stand upright are no floors, and the solid starts where its file says."""
    wall = '<geom name="wall" type="plane" size="0 0 1" pos="-.25 0 0" zaxis="1 0 0"/>'
    scene = stood(table("cylinder", place="-.19 0").replace("<worldbody>", f"<worldbody>{wall}"), BARE)
    assert _height(scene) == 0.09
    assert "tin on wall" in _pairs(scene)


def test_shapes_that_come_near_without_a_rule_are_told(stood: Callable[..., Scene]) -> None:
    """A file whose only near shapes have no contact says so, and not that none comes near."""
    held = table("cylinder", turn="1 0 0 0").replace('<freejoint name="root"/>', '<joint type="slide" axis="1 0 0"/>')
    with pytest.raises(InputError, match=r"have a rule or touch: contact of tin and table, \d+ mm apart \(cylinder on"):
        stood(held.replace(' .09"', ' .065"'), BARE)


@pytest.mark.one_in(2)
@pytest.mark.parametrize("kind", ["cylinder", "box"])
def test_an_overlap_is_lifted_out_or_told(stood: Callable[..., Scene], kind: str) -> None:
    """A body that floats starts 1 cm above its table; of one that does not the overlap is named, with what helps."""
    sunk = table(kind, turn="1 0 0 0").replace(' .09"', ' .055"')
    scene = stood(sunk, BARE)
    assert _height(scene) == pytest.approx(0.07, abs=1e-9)
    assert "edges of table face +z, which is endless for tin" in scene.omitted
    assert "no floor; 1 other pair; moved up by 15 mm, as its start overlaps what it stands on" in scene.title
    held = sunk.replace('<freejoint name="root"/>', '<joint type="slide" axis="1 0 0"/>')
    with pytest.raises(InputError, match=r"\(they overlap by 5 mm at the start: begin elsewhere by \[start\], or excl"):
        stood(held, BARE)


def test_the_first_of_two_bodies_that_float_is_lifted_by_its_own_shapes(stood: Callable[..., Scene]) -> None:
    """The second one starts where the file says, and the first one no higher for it."""
    ball = '<body name="{0}" pos="{1} 0 {2}"><freejoint/><geom type="sphere" size=".1"/></body>'
    balls = ball.format("one", 0, 0.09) + ball.format("two", 1, 0.15)
    floor = '<geom name="floor" type="plane" size="0 0 1"/>'
    scene = stood(f"<mujoco><worldbody>{floor}{balls}</worldbody></mujoco>", BARE)
    heights = [joint.q0[2] for joint in scene.elements[0].mechanism.joints]  # type: ignore[attr-defined]
    assert heights == pytest.approx([0.11, 0.15], abs=1e-9)


FLOORED = robot(HOOF, after=hoof())
TURNING = 'condim="4" friction=".3 .004"'


@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("text", "control", "bound"),
    [
        pytest.param(robot(), CONTROL, 1e-9, id="balls"),
        pytest.param(FLOORED, CONTROL, 1e-9, id="meshes"),
        pytest.param(robot(FOOT.replace("size", 'margin=".005" size')), CONTROL, 1e-9, id="balls with a margin"),
        pytest.param(
            robot(HOOF.replace("mesh=", 'margin=".005" mesh='), after=hoof()), CONTROL, 1e-9,
            id="meshes with a margin",
        ),
        pytest.param(table("cylinder"), BARE, 1e-6, id="cylinder on a box"),
        pytest.param(table("mesh"), BARE, 1e-7, id="mesh on a box"),
        pytest.param(table("box").replace(' .09"', ' .03"'), BARE, 1e-7, id="box lifted out of a box"),
        pytest.param(
            robot(FOOT.replace('type="sphere" size=".02"', BLOCK).replace('friction=".4"', TURNING)), CONTROL, 1e-9,
            id="boxes of condim 4",
        ),
        pytest.param(
            robot(FOOT.replace('friction=".4"', 'condim="6" friction=".4 .003 .0002"')), CONTROL, 1e-9,
            id="balls of condim 6",
        ),
        pytest.param(
            table("cylinder").replace('friction=".4"', TURNING), BARE, 1e-6, id="cylinder of condim 4 on a box",
        ),
    ],
)  # fmt: skip
def test_a_scene_moves_as_the_file_in_plain_mujoco(
    stood: Callable[..., Scene], text: str, control: str, bound: float
) -> None:
    """The file itself in MuJoCo, with the settings of matched, lands and stands as its scene does there."""
    import mujoco

    tilted = "[start]\nbase = [0, 0, 0.24, 0.9998, 0.015, 0.0132287566, 0]\n"
    scene = stood(text, control + (tilted if control == CONTROL else ""))
    step, until = 1e-3, 0.3
    ours = simulate(scene, "mujoco[formulation=geoms,preset=matched,damping_armature=false]", dt=step, until=until)
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.timestep, model.opt.cone, model.opt.integrator = step, 1, 0
    for name in ("geom_solref", "dof_solref", "pair_solref"):
        getattr(model, name)[:] = 2 * step, 1
    for name in ("geom_solimp", "dof_solimp", "pair_solimp"):
        getattr(model, name)[:] = 0.9999, 0.9999, 1e-3, 0.5, 2
    model.opt.ccd_tolerance, model.opt.ccd_iterations = 1e-13, 500  # its own 1e-6 are 0.7 mm of the cylinder's motion
    model.geom_margin[0] += 1e-9  # of the floor or table, as the adapter gives each pair
    data = mujoco.MjData(model)
    for joint in scene.elements[0].mechanism.joints:  # type: ignore[attr-defined]
        place = int(model.joint(joint.name).qposadr[0])
        data.qpos[place : place + len(joint.q0)] = joint.q0
    data.ctrl[:1] = 0.1
    places = [data.qpos[:3].copy()]
    for _ in range(round(until / 0.01)):
        for _ in range(10):
            mujoco.mj_step(model, data)
        places.append(data.qpos[:3].copy())
    moved = float(np.abs(np.diff(places, axis=0)).max())
    assert moved > 1e-3
    assert np.abs(ours["p_WB"].values[:, 0] - places).max() < bound


@pytest.mark.parametrize(
    ("lowest", "drop", "way"),
    [(-0.02, None, 0.03), (-1e-13, None, 1e-13), (-5e-7, None, 5e-7), (0.02, None, 0.0), (0.02, 0.01, -0.01)],
)
def test_a_robot_is_lifted_out_of_its_floor_alone(lowest: float, drop: float | None, way: float) -> None:
    """Above the floor it stays where it is, unless a height is asked for; digits of its file leave it on the floor."""
    assert lift(lowest, drop) == pytest.approx(way)
