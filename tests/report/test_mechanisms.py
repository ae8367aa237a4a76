"""A comparison of a mechanism in the report."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np
import pytest
from browsing import Visit
from scipy.spatial.transform import Rotation

from proofroll.core.errors import Refused
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.report.drawing import mechanism_drawing
from proofroll.elements.mechanism.report.replay import _orientations, draw_mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, GeometryKind, Pair
from proofroll.files.comparison_file import load_comparison
from proofroll.files.scene_file import load_scene
from proofroll.report.comparison.plots import point_curves
from proofroll.report.kinds import group_of
from proofroll.report.page.growing import begun
from proofroll.report.replay.records import Replayed
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll.studies.comparison.compare import compare
from proofroll.studies.comparison.outcome import Outcome


@pytest.fixture(scope="module")
def compared(tmp_path_factory: pytest.TempPathFactory) -> tuple[Outcome, Store, Path]:
    """A short slider-crank in one engine, its store, and a folder for its report."""
    whole = load_comparison("slider_crank")
    rows = [row for row in whole.rows if row.engine == "mujoco[formulation=joints,preset=tuned]"]
    folder = tmp_path_factory.mktemp("mechanism")
    store = Store(folder / "cases")
    outcome = compare(dataclasses.replace(whole, rows=rows, until=0.04), Runner(store, jobs=1))
    return outcome, store, folder


@pytest.fixture(scope="module")
def report(compared: tuple[Outcome, Store, Path]) -> Path:
    """The folder of its report."""
    outcome, _, folder = compared
    begun([outcome], "proofroll report slider_crank").write(folder)
    return folder


@pytest.mark.drill
@pytest.mark.slow
def test_only_single_curves_are_drawn(compared: tuple[Outcome, Store, Path]) -> None:
    """Coordinates of points and joints and determinate reactions have curves; an array of many components has none."""
    outcome, _, _ = compared
    (entry,) = point_curves(outcome)
    drawn = {item.name: item for item in entry.observables}
    assert {"slider.x", "q.shaft"} <= set(drawn)
    assert not {"positions", "attitudes", "forces", "torques"} & set(drawn)
    assert {"force.guide.y", "force.pin.x"} <= set(drawn)
    assert not {"force.guide.x", "force.guide.z"} & set(drawn), "one is zero, the other not determinate"
    (curve,) = drawn["slider.x"].engines
    assert len(curve.difference) == len(entry.time)
    assert 0 < max(abs(value or 0.0) for value in curve.difference) < 1e-6


@pytest.mark.slow
def test_the_page_shows_the_mechanism(report: Path) -> None:
    """The scene's drawing is on the page with its own caption, and nothing speaks of balls."""
    content = json.loads((report / "report.json").read_text())
    page = (report / "report.html").read_text()
    (sheet,) = (item["sheet"] for item in content["comparisons"])
    assert sheet["undrawn"] == ""
    assert f'aria-label="{sheet["title"]}, at the start"' in page
    assert sheet["caption"] in page
    assert "where the ball touches" not in page
    (case,) = content["replay"]
    assert [run["frames"] for run in case["runs"]] == [case["frames"]] * 2
    assert all(verdict["verdict"] == "agrees" for verdict in content["comparisons"][0]["rows"])


@pytest.mark.nightly
@pytest.mark.slow
def test_a_mechanism_is_replayed(
    compared: tuple[Outcome, Store, Path], report: Path, visit: Callable[..., AbstractContextManager[Visit]]
) -> None:
    """In a browser the picture moves with the time, and the values beside it are those of the stored truth."""
    outcome, _, _ = compared
    with visit(report / "report.html") as opened:
        opened.near(".replay", "document.querySelector('.replay').dataset.ready === ''")
        canvas, line = (opened.page.locator(f'.replay [data-part="{name}"]') for name in ("canvas", "time"))
        before = canvas.screenshot()
        line.evaluate("(line) => { line.value = line.max; line.dispatchEvent(new Event('input')); }")
        end = "document.querySelector('.replay [data-part=time]').max"
        opened.wait(f"parseFloat(document.querySelector('.replay [data-part=clock]').textContent) === Number({end})")
        opened.until(lambda: canvas.screenshot() != before, what="another picture")
        shown = opened.page.locator('.replay [data-part="values"]').inner_text().replace("−", "-").split()
        true = next(iter(outcome.points.values())).trajectory.dataset
        assert abs(float(shown[shown.index("slider.x") + 1]) - float(true["slider.x"][-1])) < 1e-4
        assert opened.messages == []


def test_bodies_turn_as_often_as_their_spin_says() -> None:
    """Between two samples more than half a turn apart the frames go the way of the spin, all of it."""
    grid, rate = np.linspace(0.0, 1.0, 11), np.array([30.0, -40.0, 10.0])
    turned = Rotation.from_rotvec(grid[:, None] * rate) * Rotation.from_rotvec([0.3, 0.1, -0.2])
    times = np.linspace(0.0, 1.0, 101)
    found = _orientations(grid, turned.as_quat(scalar_first=True), np.tile(rate, (11, 1)), times)
    exact = Rotation.from_rotvec(times[:, None] * rate) * Rotation.from_rotvec([0.3, 0.1, -0.2])
    assert (Rotation.from_quat(found, scalar_first=True) * exact.inv()).magnitude().max() < 1e-9
    assert np.linalg.norm(rate) * 0.1 > np.pi, "the samples alone would not show it"


@pytest.mark.drill
def test_forces_of_contact_are_replayed_at_the_shapes() -> None:
    """A ladder shows the forces of floor and wall at its ends, on the ladder, as the truth has them."""
    scene = load_scene("ladder")
    true = truth(scene, np.linspace(0.0, 0.1, 6))
    case, _, numbers = draw_mechanism(Replayed(scene, true, Path("none"), [], "ladder", "as it is"))
    assert [joint["at"][2] for joint in case["joints"][1:]] == [-0.75, 0.75]
    assert next(width for name, _, width, _, _ in numbers.arrays if name == "force") == 9
    assert next(width for name, _, width, _, _ in numbers.arrays if name == "slip") == 2
    floor, wall, *ends = case["shapes"]
    assert [item["kind"] for item in case["shapes"]] == ["plane", "plane", "sphere", "sphere"]
    assert floor["at"][2] == pytest.approx(0.0, abs=1e-15)
    assert wall["at"][0] == pytest.approx(0.0, abs=1e-15)
    assert [(item["body"], item["at"][2], item["half"]) for item in ends] == [
        (0, -0.75, [0.02] * 3),
        (0, 0.75, [0.02] * 3),
    ]


@pytest.mark.drill
def test_a_bore_is_replayed_as_a_tube_along_the_way() -> None:
    """A tube around the bore's axis, as long as the way of the balls in it and its diameter."""
    body = Body("b", 1.0, inertia=(4e-4, 4e-4, 4e-4))
    joint = Joint("j", "free", "world", "b", q0=(0.0, 0.1, 0.0, 1, 0, 0, 0), v0=(1.0, 0, 0, 0, 0, 0))
    shapes = (
        Geometry("ball", "b", "sphere", radius=0.1),
        Geometry("tube", "world", "bore", (0.0, 0.0, -0.3), radius=0.5, axis=(1, 0, 0)),
    )
    mechanism = Mechanism(
        (body,), (joint,), gravity=(0, 0, 0), geometries=shapes, pairs=(Pair("hit", ("ball", "tube"), 0.1),)
    )
    scene = Scene("flying", "", (MechanismElement(mechanism),))
    case, _, _ = draw_mechanism(Replayed(scene, truth(scene, np.linspace(0.0, 0.2, 3)), "", [], "ball", "as it is"))
    tube = case["shapes"][1]
    assert (tube["kind"], tube["body"]) == ("bore", 1)  # on the world, which comes after the bodies
    assert tube["at"] == pytest.approx([0.1, 0.0, -0.3])
    assert tube["half"] == pytest.approx([0.5, 0.5, 0.6])
    assert Rotation.from_quat(tube["turn"]).apply([0, 0, 1]) == pytest.approx([1, 0, 0])
    (ring,) = [mark for mark in mechanism_drawing(scene.elements[0]).marks if getattr(mark, "look", "") == "hidden"]
    assert len(ring.points) > 50


@pytest.mark.parametrize(("name", "letters"), [("bowl", {"ξ", "η"}), ("cone", {"γ", "s"}), ("torus_rim", {"γ", "θ"})])
def test_a_ball_on_a_curved_wall_is_drawn_on_a_net(name: str, letters: set[str]) -> None:
    """Lines of coordinates, seen from behind dashed, their directions at the start, the ball inside the picture."""
    picture = mechanism_drawing(load_scene(name).elements[0])  # type: ignore[arg-type]
    looks = [getattr(mark, "look", "") for mark in picture.marks]
    assert looks.count("line") > 10
    assert looks.count("hidden") > 10
    assert letters <= {"".join(part.text for part in getattr(mark, "parts", ())) for mark in picture.marks}
    (ball,) = [mark for mark in picture.marks if getattr(mark, "look", "") == "ball"]
    left, top, width, height = picture.box
    assert left < ball.centre[0] < left + width
    assert top < ball.centre[1] < top + height


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize(("kind", "half"), [("capsule", [0.1, 0.1, 0.1]), ("cylinder", [0.1, 0.1, 0.3])])
def test_long_bodies_are_replayed_whole(kind: GeometryKind, half: list[float]) -> None:
    """A capsule has its radius and its length in radii, a cylinder half of its length, along the axis of the file."""
    body = Body("b", 1.0, inertia=(4e-4, 4e-4, 4e-4))
    joint = Joint("j", "free", "world", "b", q0=(0.0, 0.0, 1.0, 1, 0, 0, 0))
    shapes = (Geometry("log", "b", kind, radius=0.1, length=0.6, axis=(1, 0, 0)), Geometry("floor", "world", "plane"))
    mechanism = Mechanism((body,), (joint,), geometries=shapes, pairs=(Pair("hit", ("log", "floor"), 0.1),))
    scene = Scene("falling", "", (MechanismElement(mechanism),))
    case, _, _ = draw_mechanism(Replayed(scene, truth(scene, np.linspace(0.0, 0.1, 3)), "", [], "log", "as it is"))
    log = case["shapes"][0]
    assert (log["kind"], log["half"]) == (kind, pytest.approx(half))
    assert log.get("long", 6.0) == pytest.approx(6.0)
    assert ("long" in log) == (kind == "capsule")
    assert Rotation.from_quat(log["turn"]).apply([0, 0, 1]) == pytest.approx([1, 0, 0])


@pytest.mark.drill
def test_bodies_of_vertices_are_replayed_as_rods_around_them() -> None:
    """A block of two corners has rods from its centre of mass to both, and one between them."""
    scene = load_scene("rocking_block")
    case, _, _ = draw_mechanism(Replayed(scene, truth(scene, np.linspace(0.0, 0.02, 3)), "", [], "block", "as it is"))
    left, right = [-0.1, 0.0, -0.25], [0.1, 0.0, -0.25]
    rods = case["bodies"][0]["rods"]
    assert [[0.0, 0.0, 0.0], left] in rods
    assert [[0.0, 0.0, 0.0], right] in rods
    assert [left, right] in rods


@pytest.mark.drill
def test_the_picture_holds_whole_shapes() -> None:
    """Around what moves, the box that the camera shows reaches as far as the sphere, not as its centre of mass."""
    scene = load_scene("eccentric_sphere")
    true = truth(scene, np.linspace(0.0, 0.02, 3))
    _, _, numbers = draw_mechanism(Replayed(scene, true, "", [], "sphere", "as it is"))
    content, at = bytes(numbers.content), 0
    for name, _, width, length, least in numbers.arrays:
        if name == "extent":
            shuffled = np.frombuffer(content[at : at + 4 * width * length], np.uint8).reshape(4, -1)
            low, high = np.ascontiguousarray(shuffled.T).view("<i4").reshape(length, width).cumsum(axis=0) * least
        at += 4 * width * length
    assert low == pytest.approx([-0.1, -0.1, 0.0], abs=1e-3)
    path = true["p_WB"].to_numpy()[-1, 0]
    assert high == pytest.approx([0.1 + path[0], 0.1 + path[1], 0.2], abs=1e-3)


def test_nothing_is_replayed_of_a_motion_that_is_not_unique() -> None:
    """Where laws alone are known of a scene, there is no true motion beside which runs could be drawn."""
    scene = load_scene("painleve_rod")
    true = truth(scene, np.linspace(0.0, 0.01, 3))
    with pytest.raises(Refused, match="no true motion is known"):
        draw_mechanism(Replayed(scene, true, Path("none"), [], "rod", "as it is"))


def test_balls_on_surfaces_are_kinds_of_their_own() -> None:
    """A lone ball that keeps touching rolls or slips, by its friction; one that flies, or is no ball, is a contact."""
    scenes = {name: group_of(load_scene(name)) for name in ("inclined_plane", "slide_to_roll", "bouncing_ball", "sled")}
    assert list(scenes.values()) == ["ball rolling", "ball slipping", "contact", "contact"]
    assert group_of(load_scene("inclined_plane", mu_static=0.1)) == "ball slipping"
