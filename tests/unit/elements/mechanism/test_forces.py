"""Applied forces and moments: what a file may say, their closed forms, their reaction, and the loads in each route."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from one_body_scenes import one_body, refusal
from scipy.spatial.transform import Rotation

from proofroll.core.events import events_of
from proofroll.elements.mechanism import Body, Force, Joint, Mechanism
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.elements.mechanism.scene.signal import Formula
from proofroll.files.scene_file import load_scene
from proofroll.truth.plug_in import MechanismTruth

ROUND = ((0.1, 0, 0), (0, 0.1, 0), (0, 0, 0.1))
TIMES = np.linspace(0.0, 1.0, 11)
PUSH = '[[forces]]\nname = "push"\n'


def free(name: str, q0: tuple[float, ...] = (0, 0, 0, 1, 0, 0, 0), v0: tuple[float, ...] = (0,) * 6) -> tuple[Any, Any]:
    """A body of 2 kg that is free, and its joint."""
    return Body(name, 2.0, inertia=ROUND), Joint(f"of {name}", "free", "world", name, q0=q0, v0=v0)


def moved(mechanism: Mechanism, times: Array = TIMES) -> tuple[Placed, float]:
    """Motion of the truth at the times, and its error bar of places [m]."""
    content = MechanismTruth.truth(MechanismElement(mechanism), times, ())
    parts = (content[name].to_numpy() for name in ("p_WB", "v_WB", "w_WB", "q_WB"))
    return Placed(mechanism, times, *parts), float(content["p_WB"].attrs["error_bar"])


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ('body = "b"\nkind = "push"\nvalue = [1, 0, 0]', "forces.0.kind = 'push'"),
        ('body = "c"\nkind = "force"\nvalue = [1, 0, 0]', "forces.push.body = 'c': there is no such body"),
        ('body = "world"\nkind = "force"\nvalue = [1, 0, 0]', "a force on the world moves nothing"),
        ('body = "b"\nreaction = "b"\nkind = "force"\nvalue = [1, 0, 0]', "cancel; name another body"),
        ('body = "b"\nkind = "force"\nvalue = [1, 0]', "forces.0.value"),
        ('body = "b"\nkind = "force"\nvalue = [1, 0, "= z"]', "forces.0.value.2"),
        (
            'body = "b"\nkind = "force"\nvalue = {times = [0, 1], values = [[1, 0, 0], [1, 0]]}',
            "forces.0.value.values.1",
        ),
        ('body = "b"\nkind = "moment"\nposition = [1, 0, 0]\nvalue = [1, 0, 0]', "a moment has no place"),
        ('body = "b"\nkind = "force"\nframe = "joint"\nvalue = [1, 0, 0]', "forces.0.frame = 'joint'"),
        ('body = "b"\nkind = "force"', "forces.0.value"),
    ],
)
def test_a_wrong_force_gets_one_line(tmp_path: Path, lines: str, words: str) -> None:
    """A wrong applied force is refused by one line that names its field."""
    assert words in refusal(tmp_path, "free", PUSH + lines)


def test_a_table_of_vectors_is_three_tables(tmp_path: Path) -> None:
    """A table of vectors interpolates each component."""
    table = "{times = [0, 2], values = [[0, 1, 2], [4, 1, 0]]}"
    (force,) = one_body(tmp_path, "free", f'{PUSH}body = "b"\nkind = "force"\nvalue = {table}').forces
    assert force.at(0.5) == pytest.approx([1, 1, 1.5])


@pytest.mark.parametrize("frame", ["world", "body"])
def test_a_thrust_on_a_spinning_body_has_its_closed_form(frame: Any) -> None:
    """A thrust along a body that spins evenly turns its velocity on a circle; one along the world is a parabola."""
    w, thrust = 3.0, 5.0
    body, joint = free("b", v0=(0, 0, 0, 0, 0, w))
    placed, bar = moved(
        Mechanism((body,), (joint,), gravity=(0, 0, 0), forces=(Force("f", "b", "force", (thrust, 0, 0), frame=frame),))
    )
    a = thrust / body.mass
    if frame == "world":
        exact = np.stack([a * TIMES**2 / 2, 0 * TIMES], axis=1)
    else:
        exact = a / w**2 * np.stack([1 - np.cos(w * TIMES), w * TIMES - np.sin(w * TIMES)], axis=1)
    assert bar < 1e-12
    assert np.max(np.abs(placed.p_WB[:, 0, :2] - exact)) < max(bar, 1e-14)


def test_a_force_off_the_centre_turns_the_body() -> None:
    """A force at a place turns the body by its moment about the centre of mass."""
    body, joint = free("b")
    force = Force("f", "b", "force", (0, 0, 2.0), position=(0, 0.5, 0), frame="body")
    placed, _ = moved(Mechanism((body,), (joint,), gravity=(0, 0, 0), forces=(force,)))
    assert placed.w_WB[:, 0, 0] == pytest.approx(0.5 * 2.0 / 0.1 * TIMES, abs=1e-12)


@pytest.mark.one_in(3)
@pytest.mark.parametrize(("kind", "frame"), [("force", "world"), ("force", "body"), ("moment", "body")])
def test_a_reaction_keeps_momentum(kind: Any, frame: Any) -> None:
    """A force with its reaction changes neither momentum nor moment of momentum, whatever the bodies do."""
    bodies, joints = zip(
        free("a", v0=(0.1, 0, 0.2, 1, 0.5, -0.3)), free("b", q0=(1, 0.5, 0, 0.9, 0.1, 0.2, 0.3)), strict=True
    )
    at = (0.1, 0.2, -0.1) if kind == "force" else (0.0, 0.0, 0.0)
    value: Any = (0.3, Formula("2*cos(3*t)"), -1.0)
    forces = (Force("f", "a", kind, value, position=at, frame=frame, reaction="b"),)
    placed, _ = moved(Mechanism(bodies, joints, gravity=(0, 0, 0), forces=forces))
    for part in placed.momentum():
        assert np.max(np.abs(part - part[0])) < 1e-12


def sliding(push: tuple[Any, ...]) -> Mechanism:
    """A ball of 2 kg that slides, unable to turn for its huge inertia, pushed at its centre over a rough floor."""
    body = Body("b", 2.0, inertia=tuple(tuple(1e9 * x for x in row) for row in ROUND))  # type: ignore[arg-type]
    joint = Joint("j", "free", "world", "b", q0=(0, 0, 0.1, 1, 0, 0, 0), v0=(1, 0, 0, 0, 0, 0))
    shapes = (Geometry("floor", "world", "plane"), Geometry("ball", "b", "sphere", radius=0.1))
    pair = Pair("p", ("ball", "floor"), friction=0.25)
    return Mechanism((body,), (joint,), geometries=shapes, pairs=(pair,), forces=(Force("f", "b", "force", push),))


@pytest.mark.drill
def test_a_pushed_body_slides_with_friction_of_its_load() -> None:
    """A push down adds to the normal force and so to friction: both routes of contact apply the force."""
    placed, bar = moved(sliding((5.0, 0.0, -4.0)))
    a = (5.0 - 0.25 * (2.0 * 9.81 + 4.0)) / 2.0
    assert bar < 1e-9
    assert placed.p_WB[:, 0, 0] == pytest.approx(TIMES + a * TIMES**2 / 2, abs=1e-8)


@pytest.mark.drill
def test_a_push_that_grows_finds_static_and_then_kinetic_friction() -> None:
    """At rest a ball rolls until static friction is at its bound; from there kinetic friction acts against the push.

    Rolling, friction is less than the push by the share of the ball's inertia against turning, 2e-10.
    """
    mechanism, rise, static, kinetic = sliding((Formula("10*t"), 0.0, 0.0)), 10.0, 0.35, 0.25
    still = replace(mechanism.joints[0], v0=(0.0,) * 6)
    pair = replace(mechanism.pairs[0], friction=kinetic, static_friction=static)
    content = MechanismTruth.truth(
        MechanismElement(replace(mechanism, joints=(still,), pairs=(pair,))), np.append(TIMES, 1.2), ()
    )
    begins = static * 2.0 * 9.81 / rise * (1 + 2.0 * 0.1**2 / 1e8)
    (slip,) = [event for event in events_of(content) if event.kind == "slip"]
    assert slip.time == pytest.approx(begins, abs=1e-12)
    t = np.maximum(content["time"].to_numpy(), begins)
    place = (
        rise / 12 * (t**3 - begins**3) - rise / 4 * begins**2 * (t - begins) - kinetic * 9.81 / 2 * (t - begins) ** 2
    )
    assert content["p_WB"].to_numpy()[:, 0, 0] == pytest.approx(place, abs=1e-8)


@pytest.mark.drill
def test_a_turned_scene_moves_alike() -> None:
    """A scene whose forces along the world are turned with it, and those along bodies kept, moves as before, turned."""
    scene: Any = load_scene("slung_load").elements[0]
    R: Array = Rotation.from_euler("xyz", [0.3, 0.7, -1.1]).as_matrix()
    held = [replace(force, value=tuple(force.at(0.2))) for force in scene.mechanism.forces]
    still = replace(scene.mechanism, forces=tuple(held))
    angles = tuple(Rotation.from_matrix(R).as_euler("xyz"))
    turned = replace(
        still,
        joints=tuple(replace(j, orientation=angles) if j.parent == "world" else j for j in still.joints),
        gravity=tuple(R @ still.gravity),
        forces=tuple(replace(f, value=tuple(R @ f.at(0.0))) if f.frame == "world" else f for f in held),
    )
    (placed, bar), (other, _) = moved(still, TIMES[:3]), moved(turned, TIMES[:3])
    assert np.max(np.abs(placed.p_WB @ R.T - other.p_WB)) < 10 * max(bar, 1e-13)
