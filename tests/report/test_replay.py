"""The replay: its numbers, and the section in a real browser with its network cut."""

from __future__ import annotations

import base64
import dataclasses
import gzip
import json
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import replace
from importlib.metadata import PackageNotFoundError
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browsing import Visit
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from proofroll.core.truth import truth
from proofroll.files.json_data import plain
from proofroll.files.scene_file import load_scene
from proofroll.files.trajectory_file import StoredTrajectory
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.report.kind import BallReport
from proofroll.papers.blajer_2006.report.replay import AWAY, LENGTH, SLIPS, STICKS, middle, poses, wall
from proofroll.report.comparison.plots import point_curves
from proofroll.report.page.html import page
from proofroll.report.page.records import ReportContent, report_content
from proofroll.report.replay import library as replay_library
from proofroll.report.replay.library import thinned, three
from proofroll.report.replay.replay import WIDEST_TURN, frame_times, joined, replay_content

SPEED, UNTIL, EVERY = 4.0, 1.0, 0.02


def sampled(dataset: Any) -> dict[str, Any]:
    """A dataset as the replay reads it from its file."""
    return {str(name): variable.to_numpy() for name, variable in dataset.isel(body=0).variables.items()}


def times_of(data: Any) -> Any:
    """The frames of a ball's replay [s]."""
    return frame_times(data["time"][-1], np.linalg.norm(data["w_WB"], axis=1).max())


@pytest.fixture(scope="module")
def rolling() -> tuple[Any, dict[str, Any]]:
    """The ball in the cylinder without resistance, and its truth, sampled as comparisons are."""
    scene = load_scene("sphere_in_cylinder", speed=SPEED, asks=("orientation",))
    return rolling_ball(scene), sampled(truth(scene, np.linspace(0, UNTIL, round(UNTIL / EVERY) + 1)))


def spin(body: Any, t: float) -> Any:
    """The closed form's angular velocity in the world (Blajer 2006, f = 0) [rad/s]."""
    a, c, g = body.ball.radius, body.surface.radius, 9.81
    rate = SPEED / c
    nu = np.sqrt(2 / 7) * rate
    z, z_rate = -5 * g / (2 * rate**2) * (1 - np.cos(nu * t)), -5 * g / (2 * rate**2) * nu * np.sin(nu * t)
    local = np.array([rate * z / a, z_rate / a, -SPEED / a])
    return Rotation.from_euler("z", rate * t).apply(local)


@pytest.mark.drill
def test_the_true_ball_turns_as_its_spin_says(rolling: Any) -> None:
    """Frames between samples half a turn apart hold the orientation that the closed form's spin integrates to."""
    body, data = rolling
    times = times_of(data)
    found = poses(body, data, times).q_WB

    def rate(t: float, q: Any) -> Any:
        w = spin(body, t)
        return 0.5 * np.array([-w @ q[1:], *(q[0] * w + np.cross(w, q[1:]))])

    exact = solve_ivp(rate, (0, UNTIL), [1, 0, 0, 0], "DOP853", times, rtol=1e-10, atol=1e-12).y.T
    assert found is not None
    angle = 2 * np.arccos(np.clip(np.abs(np.sum(found * exact, axis=1)), 0, 1))
    assert angle.max() < 5e-3
    assert np.linalg.norm(spin(body, 0.0)) * EVERY > np.pi, "the samples alone would not show which way it turns"


@pytest.mark.drill
def test_an_engine_keeps_its_own_orientation(rolling: Any) -> None:
    """At its samples an engine's orientation is its own, in between its spin carries it; without one it has none."""
    body, data = rolling
    assert poses(body, {name: values for name, values in data.items() if name != "q_WB"}, data["time"]).q_WB is None
    times = times_of(data)
    offset = Rotation.from_rotvec([0.3, -0.5, 0.2])  # an orientation that no quadrature from the identity would find
    turned = poses(body, data, np.union1d(times, data["time"]))
    assert turned.q_WB is not None
    own = (Rotation.from_quat(turned.q_WB, scalar_first=True) * offset).as_quat(scalar_first=True)
    data = {**data, "q_WB": own[np.searchsorted(turned.time, data["time"])]}
    found = poses(body, data, times).q_WB
    assert found is not None
    dots = np.abs(np.sum(found * own[np.searchsorted(turned.time, times)], axis=1))
    assert 2 * np.arccos(np.clip(dots, 0, 1)).max() < 1e-2


def test_the_contact_lies_on_the_wall() -> None:
    """Also where an engine's ball has sunk in or come out."""
    name = "sphere_in_cylinder"
    body = rolling_ball(load_scene(name))
    data = sampled(truth(load_scene(name), np.linspace(0, 0.2, 11)))
    for depth in (0.0, 2e-3, -2e-3):
        moved = {**data, "p_WB": data["p_WB"] + depth * body.surface.normal(data["p_WB"])}
        found = poses(body, moved, data["time"])
        assert np.abs(body.wall.gap(found.contact)).max() < 1e-12
        distance = np.linalg.norm(found.contact - found.p_WB, axis=1)
        assert np.abs(distance - (body.ball.radius - depth)).max() < 1e-12


def test_the_forces_add_up(rolling: Any) -> None:
    """-N e1 + F2 e2 + F3 e3 is the mass times what accelerates the ball besides gravity."""
    body, data = rolling
    found = poses(body, data, data["time"])
    assert found.press is not None
    assert found.friction is not None
    c, g, m = body.surface.radius, 9.81, body.ball.mass
    rate = SPEED / c
    z_accel = -5 * g / 7 * np.cos(np.sqrt(2 / 7) * rate * found.time)
    angle = rate * found.time
    inward = -(SPEED**2) / c * np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    needed = m * (inward + np.stack([np.zeros_like(angle), np.zeros_like(angle), z_accel + g], axis=1))
    assert np.abs(found.friction - found.press[:, None] * found.normal - needed).max() < 1e-9


def test_the_contact_changes_at_the_events_and_not_at_the_samples(rolling: Any) -> None:
    """The state of a frame is that after the last event before it; an event without a time changes nothing."""
    body, data = rolling
    events = {
        "event_kind": np.array([b"slip", b"stick", b"lift_off", b"slip"]),
        "event_time": np.array([0.205, 0.211, 0.9, np.nan]),
    }
    body = dataclasses.replace(body, contact=dataclasses.replace(body.contact, mu_static=0.3, mu_kinetic=0.3))
    found = poses(body, {**data, **events}, np.array([0.0, 0.204, 0.206, 0.212, 0.899, 0.901])).state
    assert found is not None
    assert found.tolist() == [STICKS, STICKS, SLIPS, STICKS, STICKS, AWAY]
    assert poses(rolling[0], data, data["time"]).state is None


@pytest.mark.parametrize(("rate", "until"), [(0.0, 1.0), (160.0, 2.0), (240.0, 4.0), (1e4, 1.0)])
def test_frames_are_close_enough_to_see_which_way_it_turns(rate: float, until: float) -> None:
    """Sixty a second at least, and never as much as half a turn from one frame to the next."""
    times = frame_times(until, rate)
    assert (times[0], times[-1]) == (0.0, until)
    assert np.diff(times).max() * rate <= WIDEST_TURN * (1 + 1e-9)
    assert np.diff(times).max() <= 1 / 60 + 1e-12


def test_a_run_that_ends_early_is_shown_until_then(rolling: Any) -> None:
    """No frame is made up beyond the last sample, also where there is but one."""
    body, data = rolling
    times = times_of(data)
    for count in (1, 2, 30):
        found = poses(body, {name: values[:count] for name, values in data.items() if np.ndim(values)}, times)
        assert found.time[-1] <= data["time"][count - 1] + 1e-12
        assert len(found.p_WB) == found.time.size >= 1


def test_the_drawn_wall_is_the_wall_around_the_path() -> None:
    """Its points lie on the wall and reach beyond the path; a camera that follows keeps to the axis or to the ball."""
    body = rolling_ball(load_scene("sphere_in_cylinder"))
    u = body.u0 + np.linspace(0, 1, 20)[:, None] * np.array([0.3, -0.5])
    built = wall(body, u)
    assert np.abs(body.wall.gap(built.points)).max() < 1e-12
    reached = body.wall.locate(built.points.reshape(-1, 3))
    for column, (period, scale) in enumerate(zip(body.surface.periods, body.surface.length_scales, strict=True)):
        if period is None:
            margin = body.ball.radius / scale
            assert reached[:, column].min() < u[:, column].min() - margin
            assert reached[:, column].max() > u[:, column].max() + margin
    followed = middle(body, u)
    at = body.surface.position(u)
    expected = np.stack([0 * u[:, 1], 0 * u[:, 1], at[:, 2]], axis=1) if body.surface.periods[0] else at
    assert np.abs(followed - expected).max() < 1e-12


def test_numbers_survive_being_packed() -> None:
    """Unpacked as the page does it they are off by half a step at most, and what is not finite or huge stays finite."""
    values = np.random.default_rng(0).normal(size=(50, 3)).cumsum(axis=0)
    sorted_bytes = np.frombuffer(thinned(values, LENGTH), np.uint8).reshape(4, -1)
    again = np.ascontiguousarray(sorted_bytes.T).view("<i4").reshape(50, 3).cumsum(axis=0) * LENGTH
    assert np.abs(again - values).max() <= LENGTH / 2
    wild = np.frombuffer(thinned(np.array([np.nan, 1e30, -1e30]), 1.0), np.uint8).reshape(4, -1)
    assert np.ascontiguousarray(wild.T).view("<i4").ravel().cumsum().tolist() == [0, 2**30, -(2**30)]


def test_every_truth_is_a_case_with_the_default_settings_as_ghosts(made: Any) -> None:
    """One ghost of each engine is shown at first: the default one where there is one; the numbers fill what is said."""
    content = plain(replay_content([made[0]], BallReport.replay()))
    assert [case["label"] for case in content["cases"]] == ["speed 3", "speed 4"]
    assert content["start"] == 1, "the scene as its file has it"
    for case, numbers in zip(content["cases"], content["packed"], strict=True):
        names = {ball["name"]: ball["shown"] for ball in case["runs"]}
        assert names == {"truth": True, "alpha fine, as installed, dt 1e-3 s": True, "beta only, dt 1e-3 s": True}
        bytes_said = sum(4 * width * length for _, _, width, length, _ in case["arrays"])
        assert len(gzip.decompress(base64.b64decode(numbers))) == bytes_said
    silent = next(i for i, ball in enumerate(content["cases"][0]["runs"]) if ball["name"].startswith("beta"))
    held = {name for name, ball, *_ in content["cases"][0]["arrays"] if ball == silent}
    assert held == {"p", "reading0", "reading1", "reading2"}, "neither forces nor an orientation are invented"
    readings = [(reading["symbol"], reading["unit"]) for reading in content["cases"][0]["readings"]]
    assert readings == [("γ", "rad"), ("z", "m"), ("energy", "J")]


def moved(made: Any, engine: str, change: Callable[[Any], Any], **shifts: float) -> Any:
    """The comparison with the ball of an engine's first run elsewhere, and variables of the run shifted."""
    outcome, _ = made
    run = next(run for run in outcome.runs if run.row.engine == engine)
    dataset = run.trajectory.dataset
    elsewhere = StoredTrajectory(run.trajectory.file)
    changed = {"p_WB": change(dataset["p_WB"].to_numpy())}
    changed |= {name: dataset[name].to_numpy() + shift for name, shift in shifts.items()}
    vars(elsewhere)["dataset"] = dataset.assign({name: dataset[name].copy(data=changed[name]) for name in changed})
    runs = [dataclasses.replace(run, trajectory=elsewhere) if item is run else item for item in outcome.runs]
    return dataclasses.replace(outcome, runs=runs)


def replay_with(made: Any, engine: str, change: Callable[[Any], Any]) -> dict[str, Any]:
    """The first case of the replay with the ball of an engine's first run elsewhere."""
    return dict(plain(replay_content([moved(made, engine, change)], BallReport.replay()))["cases"][0])


def test_the_furthest_of_the_other_settings_is_there_if_it_is_seen(made: Any) -> None:
    """A setting that is not the default but off by more than a hundredth of the ball's radius is a ghost, not shown."""
    balls = replay_with(made, "alpha[formulation=fine]", lambda p: p + 1e-3)["runs"]
    assert {ball["name"]: ball["shown"] for ball in balls}["alpha fine, matched, dt 1e-3 s"] is False


def test_it_begins_where_a_ghost_is_furthest_off(made: Any) -> None:
    """Of all cases, also of another kind, that of the largest distance; without any the scene as it is."""
    assert replay_content([made[0]], BallReport.replay()).start == 1, "speed=4, as the scene is"
    found = replay_content([moved(made, "beta", lambda p: p + np.array([0.0, 0.0, 0.1]))], BallReport.replay())
    assert (found.start, found.largest) == (0, pytest.approx(0.1))
    near = replace(found, largest=0.05, start=1)
    both = joined([near, found])
    assert both is not None
    assert both.start == len(near.cases) + found.start


def test_a_ball_that_flies_off_is_dropped_where_it_leaves(made: Any) -> None:
    """A ghost beyond all bounds has frames until it leaves the picture, and the page says when that is."""
    whole = replay_with(made, "beta", lambda p: np.concatenate([p[:25], 1e9 * p[25:]]))
    ball = next(run for run in whole["runs"] if run["name"].startswith("beta"))
    assert 0 < ball["frames"] < whole["frames"]
    assert "leaves the picture" in ball["message"]


def test_report_json_names_what_is_replayed(written: Any) -> None:
    """Names, settings and trajectories of the ghosts are in report.json; their poses are not."""
    content = json.loads((written[1] / "report.json").read_text(encoding="utf-8"))
    balls = content["replay"][0]["runs"]
    assert balls[0]["name"] == "truth"
    assert all(ball["trajectory"].endswith(".npz") for ball in balls)
    assert all(ball["settings"]["dt"] == 1e-3 for ball in balls[1:])
    assert "arrays" not in content["replay"][0]


def test_three_js_travels_with_its_licence(written: Any) -> None:
    """The page names three.js's makers and holds the terms; what it unpacks is the program that defines THREE."""
    library = three()
    assert library is not None
    text = gzip.decompress(base64.b64decode(library["packed"])).decode("utf-8")
    assert "THREE={}" in text
    assert "GLTFLoader" not in text, "what else the viewer holds stays there"
    html = (written[1] / "report.html").read_text(encoding="utf-8")
    assert library["packed"] in html
    assert "Three.js Authors" in html
    assert "Permission is hereby granted" in html


@pytest.mark.parametrize("what", ["absent", "changed"])
def test_without_three_js_there_is_no_library(what: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A trimesh that is absent, or laid out in another way, is no error: the page does without the picture."""

    class Changed:
        version, files = "0", ()

        def locate_file(self, name: str) -> Path:
            return tmp_path / name

    def found(_: str) -> Changed:
        if what == "absent":
            raise PackageNotFoundError
        return Changed()

    monkeypatch.setattr(replay_library, "distribution", found)
    assert three.__wrapped__() is None


def test_what_engines_and_files_say_stays_text(made: Any, parse: Callable[[str], Any]) -> None:
    """Markup in a title, a point, a name or a message makes no element."""
    evil = "</script><script>alert(1)</script><img src=x onerror=alert(2)>"
    replay = replay_content([made[0]], BallReport.replay())
    case = replay.cases[0]
    case.runs[1] = replace(case.runs[1], name=evil, message=evil)
    replay.cases[0] = replace(case, group=evil, label=evil, scene=evil)
    html = page(report_content([made[0]], "proofroll report"), [point_curves(made[0])], replay=replay)
    elements = parse(html)
    assert "img" not in {tag for tag, _ in elements.tags}
    assert not any("alert(1)" in script and '"runs"' not in script for script in elements.scripts)
    known = next(script for script in elements.scripts if '"arrays"' in script)
    assert json.loads(known)[0]["runs"][1]["message"] == evil


# ---- in a browser ----


Visiting = Callable[..., AbstractContextManager[Visit]]
SMALL = {"width": 640, "height": 480}  # a picture that is quickly painted


@pytest.fixture(scope="module")
def replayed(written: Any, visit: Visiting) -> Iterator[Visit]:
    """The report, in which nothing was looked at yet."""
    with visit(written[1] / "report.html", viewport=SMALL) as opened:
        yield opened


def part(opened: Visit, name: str) -> Any:
    """One element of the replay."""
    return opened.page.locator(f'.replay [data-part="{name}"]')


def ready(opened: Visit) -> None:
    """Brings the replay into view and waits until it has drawn."""
    opened.near(".replay", "document.querySelector('.replay').dataset.ready === ''")
    settle(opened)


def settle(opened: Visit) -> None:
    """Waits for two frames of the browser: what was asked for is drawn then."""
    opened.page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")


def clock(opened: Visit) -> float:
    """The time shown [s]."""
    return float(part(opened, "clock").inner_text().split()[0])


def picture(opened: Visit) -> bytes:
    """What is drawn."""
    settle(opened)
    return bytes(part(opened, "canvas").screenshot())


def still(opened: Visit) -> bytes:
    """What is drawn once it stands: twice the same."""
    taken = [b"", picture(opened)]

    def same() -> bool:
        taken[:] = [taken[1], picture(opened)]
        return taken[0] == taken[1]

    opened.until(same, what="a picture that stands")
    return taken[1]


def passes(opened: Visit, time: float) -> None:
    """Waits until the time shown is beyond ``time`` [s]."""
    opened.until(lambda: clock(opened) > time, what=f"the time {time} s is shown")


@pytest.mark.drill
def test_the_replay_plays(written: Any, replayed: Visit) -> None:
    """From file:// without network: nothing before it is seen, then time and picture advance; no error, no request."""
    opened = replayed
    assert opened.page.evaluate("typeof THREE") == "undefined"
    assert opened.page.locator(".replay[data-ready]").count() == 0
    ready(opened)
    assert opened.page.evaluate("typeof THREE") == "object"
    settle(opened)
    assert clock(opened) == 0, "nothing moves by itself"
    before = still(opened)  # the picture stands while time does
    part(opened, "play").click()
    passes(opened, 0.02)
    part(opened, "play").click()
    stopped = clock(opened)
    assert still(opened) != before
    assert clock(opened) == stopped, "pause holds it"
    values = part(opened, "values").inner_text()
    assert "N" in values
    assert "rolls without slip" in values
    assert opened.messages == []
    assert opened.requested == [(written[1] / "report.html").as_uri()]


@pytest.mark.nightly
def test_errors_of_ghosts_stand_below_the_picture(
    made: Any, content: ReportContent, tmp_path: Path, visit: Visiting
) -> None:
    """A curve for each ghost shows its error in the quantity chosen; a click goes to its time, ghosts hide."""
    file, shift = tmp_path / "report.html", np.array([0.0, 0.0, 2e-3])
    replay = replay_content([moved(made, "beta", lambda p: p + shift, energy=0.02)], BallReport.replay())
    file.write_text(page(content, [[]], replay=replay), encoding="utf-8")
    with visit(file, viewport=SMALL) as opened:
        opened.near(".replay", "document.querySelector('.replay').dataset.ready === ''")
        part(opened, "case").select_option("0")
        heights = """[...document.querySelectorAll('[data-part=errors] polyline')].map((line) =>
          line.getAttribute('points').split(' ').map((point) => Number(point.split(',')[1])))"""
        # 2 mm between 0.1 mm, which is invisible, and 10 mm; what agrees lies on the floor.
        at = 100 * (1 - np.log10(2 / 0.1) / 2)
        opened.wait(f"{heights}.length === 2 && {heights}[1].every((height) => Math.abs(height - {at}) < 0.2)")
        assert set(opened.page.evaluate(heights)[0]) == {100}
        plot = part(opened, "errors").locator("svg")
        assert plot.get_attribute("aria-label").endswith("in place over time, logarithmic, at most 2 mm")
        choice = part(opened, "errors").locator("select")
        assert choice.locator("option").all_inner_texts() == ["place", "γ", "z", "energy"]
        choice.select_option("energy")
        opened.wait("document.querySelector('[data-part=errors] svg').ariaLabel.includes('energy')")
        assert plot.get_attribute("aria-label").endswith("in energy over time, logarithmic, at most 0.02 J")
        plot.scroll_into_view_if_needed()
        box = plot.bounding_box()
        plot.click(position={"x": 0.75 * box["width"], "y": 0.5 * box["height"]})
        opened.until(lambda: abs(clock(opened) - 0.75) < 0.01, what="the time of the click")
        opened.wait("Math.abs(parseFloat(document.querySelector('[data-errors=now]').style.left) - 75) < 1")
        opened.page.locator('[data-part="runs"] input').first.uncheck()
        opened.wait("document.querySelector('[data-part=errors] polyline').style.display === 'none'")
        assert opened.messages == []


@pytest.mark.nightly
def test_a_case_opens_at_the_largest_error_in_sight(
    made: Any, content: ReportContent, tmp_path: Path, visit: Visiting
) -> None:
    """The time shown first is that at which a visible ghost is furthest off; where none is, the start."""
    file, times = tmp_path / "report.html", np.linspace(0, UNTIL, round(UNTIL / EVERY) + 1)
    off = 2e-2 * np.exp(-(((times - 0.6) / 0.1) ** 2))
    replay = replay_content([moved(made, "beta", lambda p: p + off[:, None, None])], BallReport.replay())
    file.write_text(page(content, [[]], replay=replay), encoding="utf-8")
    with visit(file, viewport=SMALL) as opened:
        opened.near(".replay", "document.querySelector('.replay').dataset.ready === ''")
        opened.until(lambda: abs(clock(opened) - 0.6) < 0.01, what="the time of the largest error")
        part(opened, "case").select_option("1")
        opened.until(lambda: clock(opened) == 0, what="the start of a case that agrees")
        assert opened.messages == []


@pytest.mark.nightly
def test_the_replay_obeys(made: Any, replayed: Visit) -> None:
    """Keys, time line, ghosts, view and the choice of a case each change what is shown; values are the truth's."""
    opened = replayed
    ready(opened)
    opened.page.evaluate(
        "() => { const line = document.querySelector('[data-part=time]');"
        " line.value = 0.5; line.dispatchEvent(new Event('input')); }"
    )
    opened.until(lambda: clock(opened) == 0.5, what="the time of the line")
    shown = part(opened, "values").inner_text().replace("−", "-").split("\n")
    dataset = made[0].points["speed=4"].trajectory.dataset.sel(time=0.5, method="nearest")
    assert abs(float(shown[shown.index("z") + 1].split()[0]) - float(dataset["z"])) < 2e-4
    assert abs(float(shown[shown.index("N") + 1].split()[0]) - float(dataset["N"])) < 2e-2
    opened.page.keyboard.press("Tab")
    part(opened, "canvas").focus()
    opened.page.keyboard.press("Space")
    passes(opened, 0.51)
    opened.page.keyboard.press("Space")
    before = clock(opened)
    part(opened, "time").focus()
    opened.page.keyboard.press("Shift+ArrowRight")
    passes(opened, before)
    drawn = still(opened)
    part(opened, "canvas").focus()
    opened.page.keyboard.press("ArrowLeft")
    opened.until(lambda: picture(opened) != drawn, what="a turned view")
    turned = still(opened)
    part(opened, "forces").uncheck()
    opened.until(lambda: picture(opened) != turned, what="a picture without forces")
    bare = still(opened)
    opened.page.locator('[data-part="runs"] input').first.uncheck()
    opened.wait("document.querySelectorAll('[data-part=runs] tr.off').length === 1")
    part(opened, "case").select_option("0")
    opened.until(lambda: clock(opened) == 0, what="the start of the other case")
    opened.until(lambda: picture(opened) != bare, what="the other case")
    assert opened.messages == []


@pytest.mark.nightly_of("three.js")
@pytest.mark.drill
@pytest.mark.parametrize("lacking", ["WebGL", "three.js"])
def test_without_a_picture_the_values_follow_the_time(
    lacking: str, made: Any, content: ReportContent, tmp_path: Path, visit: Visiting
) -> None:
    """One sentence says what is missing; time and values run, and nothing fails."""
    replay = replay_content([made[0]], BallReport.replay())
    if lacking == "three.js":
        replay = replace(replay, library=None)
    file = tmp_path / "report.html"
    file.write_text(page(content, [[]], replay=replay), encoding="utf-8")
    blind = "HTMLCanvasElement.prototype.getContext = () => null;" if lacking == "WebGL" else ""
    with visit(file, before=blind, viewport=SMALL) as opened:
        ready(opened)
        assert lacking in part(opened, "said").inner_text()
        part(opened, "play").click()
        passes(opened, 0.02)
        assert opened.messages == []


@pytest.mark.nightly_of("projection-False")
@pytest.mark.nightly
@pytest.mark.parametrize(("engine", "hidden"), [("truth", True), ("projection", False)])
def test_a_run_alone_has_no_table_of_ghosts(
    proofroll: Callable[..., tuple[int, str, str]], tmp_path: Path, visit: Visiting, engine: str, hidden: bool
) -> None:
    """The table says how far other runs are from the one drawn solid; where there is none, there is no table."""
    run = tmp_path / "run.nc"
    lengths = ["--until", "0.1", "--every", "0.05"]
    assert proofroll("run", "pendulum", "--engine", engine, *lengths, "--out", str(run))[0] == 0
    assert proofroll("replay", str(run))[0] == 0
    with visit(tmp_path / "run-replay.html", viewport=SMALL) as opened:
        ready(opened)
        assert part(opened, "runs").locator("tr").count() == (0 if hidden else 1)
        assert part(opened, "head").is_hidden() is hidden
        assert not opened.messages
