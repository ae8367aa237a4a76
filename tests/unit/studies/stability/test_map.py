"""Small real maps: what they hold, that they resume, and that their programs show what they say."""

from __future__ import annotations

import dataclasses
import itertools
import json
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from invented import boundary_point
from invented import stability_study as invented_map

from proofroll.core.errors import InputError
from proofroll.files import scene_file
from proofroll.files.json_data import plain, record
from proofroll.files.scene_file import load_scene
from proofroll.report.stability.tables import _beyond, boundary_table, headline, silent_lines
from proofroll.running.case import Status
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll.studies.stability.axes import Axis, AxisTerm, Effort, chosen, evenly_chosen
from proofroll.studies.stability.claims import Claim, file_for
from proofroll.studies.stability.map import _refused, axis_values, stability
from proofroll.studies.stability.records import Boundary, BoundaryPoint, StabilityStudy, dependence
from proofroll.studies.stability.step_numbers import OSCILLATION, explanation, values
from proofroll.studies.stability.study import stability_study, with_programs

SPEED = Axis("V0", "m/s", "initial speed", [2.0, 8.0], {"speed": AxisTerm()})
ENGINE = "projection[formulation=rotating_frame,preset=default]"
SHORT = Effort(periods=1.0, steps=200)


def mapped(folder: Path, engines: list[str], axes: list[Axis], **more: Any) -> Any:
    """A map with its own store."""
    return stability("sphere_in_cylinder", axes, Runner(Store(folder), jobs=1), engines=engines, effort=SHORT, **more)


@pytest.fixture(scope="module")
def resumed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Runner, int, Path]:
    """A folder with a map that was interrupted, how many results it had, and who makes the rest."""
    folder, calls = tmp_path_factory.mktemp("map"), itertools.count(1)

    def interrupt(_text: str, _count: int) -> None:
        if next(calls) == 8:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        mapped(folder, [ENGINE], [SPEED], progress=interrupt)
    return Runner(Store(folder), jobs=1), len(list(folder.glob("*.json"))), folder


@pytest.fixture(scope="module")
def small(resumed: tuple[Runner, int, Path]) -> Any:
    """The map of one formulation along one axis."""
    return stability("sphere_in_cylinder", [SPEED], resumed[0], engines=[ENGINE], effort=SHORT)


@pytest.mark.drill
def test_a_map(small: Any) -> None:
    """RK4 has a boundary at either speed, and as nothing but Ωh matters here, it is the same Ωh."""
    study = stability_study(small)
    assert [point.value for point in study.points] == [2.0, 8.0]
    turns = [point.sides["accurate"].numbers["turn"] for point in study.points]
    assert turns[0] == pytest.approx(turns[1])
    assert 0.1 < turns[0] < 1.5
    assert all(point.largest_accurate <= point.largest_stable for point in study.points)
    assert study.boundaries == sum(study.failures.values())
    assert record(StabilityStudy, json.loads(json.dumps(plain(study), allow_nan=False))) == study


@pytest.mark.drill
def test_no_scene_is_loaded_after_the_runs(small: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """The record of a map is made from the scenes that were run."""

    def refused(*_: object) -> None:
        raise AssertionError("a scene is loaded again")

    monkeypatch.setattr(scene_file, "_read", refused)
    assert stability_study(small).meanings


def test_a_search_hangs_on_no_clock(small: Any) -> None:
    """Which rungs are tried follows from the number of steps, however long runs take; what is left out is the same."""
    point = small.points[0]
    slow = {rung: dataclasses.replace(item, wall_seconds=1e4) for rung, item in point.results.items()}
    slower = dataclasses.replace(point, results=slow)
    rungs = range(len(point.ladder))
    assert [point.too_long(rung, SHORT) for rung in rungs] == [slower.too_long(rung, SHORT) for rung in rungs]
    longest = [point.at.until / point.ladder[rung] for rung in rungs if not point.too_long(rung, SHORT)]
    assert SHORT.steps / 2 < max(longest) <= SHORT.steps


def test_a_quick_map_does_not_make_runs_that_are_foretold_to_be_long(small: Any) -> None:
    """The coarsest run that reached its end foretells the time of finer ones by their number of steps."""
    point = small.points[0]
    coarsest = min(rung for rung, item in point.results.items() if item.status == "done")
    known = {coarsest: dataclasses.replace(point.results[coarsest], processor={"advance": 0.1})}
    known_point = dataclasses.replace(point, results=known)
    effort = dataclasses.replace(SHORT, steps=10**9, seconds=0.8)
    made = [rung for rung in range(len(point.ladder)) if not known_point.too_long(rung, effort)]
    assert point.ladder[coarsest] / point.ladder[max(made)] <= 8 < point.ladder[coarsest] / point.ladder[max(made) + 1]


@pytest.mark.nightly
def test_what_checks_the_truth_is_mapped_on_request(tmp_path: Path) -> None:
    """Without names its formulations are absent with a sentence; by its name it is on the map."""
    axis = dataclasses.replace(SPEED, values=[2.0])
    usual, asked = (mapped(tmp_path, engines, [axis]) for engines in ([], [ENGINE]))
    assert usual.absent[ENGINE] == "only cross-checks the truth; --engine maps it"
    assert not any(point.curve.facts.witness for point in usual.points)
    assert {point.curve.engine for point in asked.points} == {ENGINE}


def test_a_run_that_met_the_limit_of_time_contradicts_nothing() -> None:
    """What a faster machine would have shown is left open: the claim is not tested there."""
    claim = Claim(ENGINE, "stable", "it is", number="turn", between=[0.4, 0.6])
    point = boundary_point(
        engine="projection",
        settings={"formulation": "rotating_frame", "preset": "default"},
        too_slow=1e-3,
        sides={"stable": side(largest=1.0, numbers={"turn": 9.0})},
    )
    assert claim.contradictions([point]) != []
    late = [dataclasses.replace(point, timed_out=True)]
    assert claim.contradictions(late) == []
    assert "limit of time" in claim.untested(late)


@pytest.mark.nightly
def test_a_closed_form_has_no_boundary(tmp_path: Path) -> None:
    """What has neither step nor tolerance is named with the reason, and its neighbour is mapped by its tolerance."""
    axis = Axis("V0", "m/s", "initial speed", [4.0], {"speed": AxisTerm()})
    told: list[str] = []
    found = mapped(tmp_path, ["reduced[preset=matched]"], [axis], progress=lambda text, _: told.append(text))
    assert told[-1].endswith("V0 = 4: 1 of 1 points")
    assert [point.curve.facts.settings["formulation"] for point in found.points] == ["equations"]
    assert stability_study(found).points[0].resolution == "rtol"
    (reason,) = found.absent.values()
    assert "neither step nor tolerance" in reason


def test_what_refuses_the_scene_everywhere_has_no_boundary() -> None:
    """A formulation without the scene's joints is told once with its reason; one that refuses in places stays."""
    cannot, can = SimpleNamespace(engine="cannot"), SimpleNamespace(engine="can")
    refused = SimpleNamespace(status=Status.REFUSED, message="needs universal joints")
    done = SimpleNamespace(status=Status.DONE, message="")
    points: Any = [
        SimpleNamespace(curve=cannot, results={0: refused, 4: refused}),
        SimpleNamespace(curve=cannot, results={0: refused}),
        SimpleNamespace(curve=can, results={0: refused}),
        SimpleNamespace(curve=can, results={0: done}),
    ]
    assert _refused(points) == {"cannot": "needs universal joints"}


@pytest.mark.drill
def test_a_map_resumes(small: Any, resumed: tuple[Any, int, Path]) -> None:
    """A map that was interrupted takes up what it had, and one that was finished runs nothing."""
    runner, before, folder = resumed
    assert before >= 4
    assert runner.reused == before
    again = Runner(Store(folder), jobs=1)
    other = stability("sphere_in_cylinder", [SPEED], again, engines=[ENGINE], effort=SHORT)
    assert stability_study(other).points == stability_study(small).points
    assert again.reused == small.runs + 2  # and the truth at both values


def test_reports_of_a_map(small: Any) -> None:
    """The terminal shows each curve within 100 columns."""
    from rich.console import Console

    study = stability_study(small)
    assert headline(study).startswith("2 points, ")
    console = Console(width=100, record=True, file=open("/dev/null", "w"))  # noqa: SIM115 -- nobody reads it
    console.print(boundary_table(study))
    assert "projection solver rotating frame, as installed" in console.export_text()
    assert len(list(silent_lines(study))) <= 8


def test_what_is_beyond_counts_its_own_silent_failures() -> None:
    """A failure that is reported does not borrow the mark of another that is silent."""
    points = [SimpleNamespace(failure="gave up", silent=False), SimpleNamespace(failure="lost phase", silent=True)]
    assert _beyond(points) == "lost phase 1!"  # type: ignore[arg-type]
    assert _beyond([*points, points[0]]) == "gave up"  # type: ignore[list-item]
    assert _beyond([SimpleNamespace(failure="", silent=False)]) == ""  # type: ignore[list-item]


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({}, "good only, tuned at V0 = 200: sank in at every step down to dt 1.25e-4 s, off by 150 % of the range"),
        ({"too_slow": 1e-5}, "sank in down to dt 1.25e-4 s, finer ones take too long"),
        ({"resolution": "rtol", "finest": 1e-9}, "sank in at every tolerance down to rtol 1e-9"),
        ({"sides": {"stable": Boundary(1e-3, True, {}, 2e-3, "", True, None, None, None)}}, "just beyond dt 1e-3 s"),
        (
            {"sides": {"stable": Boundary(1e-3, True, {}, 2e-3, "", True, 4e288, None, None)}},
            "off by more than a million times the range",
        ),
    ],
)
def test_the_worst_case_says_where_and_up_to_which_step(more: dict[str, Any], said: str) -> None:
    """Values of an axis keep their digits, and a step has its name, digits and unit."""
    point = boundary_point(**({"value": 200.0, "finest": 1.25e-4} | more))
    (line,) = silent_lines(dataclasses.replace(invented_map(), points=[point]))
    assert said in line


def test_one_point_is_told_as_one() -> None:
    """A map of which one point never holds, and one is refused, says so in the singular."""
    said = headline(dataclasses.replace(invented_map(), never_accurate=1, refused=1))
    assert "At 1 point no step" in said
    assert "before the run: 1 point." in said


@pytest.mark.nightly
def test_what_is_ours_is_shown_through_proofroll(tmp_path: Path) -> None:
    """Where an engine has no program of its own, the program asks proofroll, says why, and shows what is there."""
    axis = Axis("V0", "m/s", "initial speed", [4.0], {"speed": AxisTerm()})
    found = mapped(tmp_path, ["projection[formulation=euler,preset=default]"], [axis])
    (written,) = with_programs(found, stability_study(found), tmp_path / "reproducers").points
    assert written.reproducer_needs == ["numpy", "proofroll"]
    assert written.reproducer is not None
    assert written.reproducer_note is not None
    assert "no program of its own" in written.reproducer_note
    text = Path(written.reproducer).read_text()
    assert written.reproducer_note in text
    beyond = f"'dt': {written.shown.beyond!r}"
    assert beyond in text
    for dt, code, words in ((beyond, 1, ": shown"), (f"{beyond} / 40", 0, "not shown")):
        run = subprocess.run(
            [sys.executable, "-"],
            input=text.replace(beyond, dt),
            capture_output=True,
            text=True,
            timeout=1500,
            check=False,
        )
        assert run.returncode == code, run.stdout + run.stderr
        assert words in run.stdout


def test_a_quick_map_leaves_out_the_longest_runs() -> None:
    """Lengths of runs end at the longest that is allowed, and no axis has more values than asked for."""
    horizon = Axis("horizon", "1", "length", [1, 10, 100, 1000], horizon=True)
    assert Effort(values=3, longest=10.0).values_of(horizon) == [1, 10]
    assert Effort(values=3, longest=10.0).values_of(dataclasses.replace(horizon, horizon=False)) == [1, 100, 1000]
    assert Effort().values_of(horizon) == horizon.values


@pytest.mark.nightly
def test_of_each_formulation_the_matched_settings(tmp_path: Path) -> None:
    """Where only matched settings are mapped, others of the same formulation are not, but where it has no matched."""
    axis = Axis("V0", "m/s", "initial speed", [4.0], {"speed": AxisTerm()})
    effort = dataclasses.replace(SHORT, steps=50, matched=True)
    runner = Runner(Store(tmp_path), jobs=1)
    found = stability("sphere_in_cylinder", [axis], runner, engines=["projection"], effort=effort)
    names = [point.curve.engine for point in found.points]
    assert names == [
        f"projection[formulation={name},preset=matched]" for name in ("euler", "rotating_frame", "dependent")
    ]
    only = "projection[formulation=euler,preset=default]"
    assert [
        p.curve.engine for p in stability("sphere_in_cylinder", [axis], runner, engines=[only], effort=effort).points
    ] == [only]


def test_axes_share_the_runs_where_they_meet() -> None:
    """A value that is the scene's default is no parameter of its own: the case is that of the other axis."""
    axes = [Axis(name, "1", name, [1.0], {name: AxisTerm(times=name)}) for name in ("mass", "radius")]
    assert [at.parameters for at in axis_values("sphere_in_cylinder", axes, SHORT)] == [{}, {}]


def test_axes_as_data() -> None:
    """A parameter follows the value of its axis by the factor and the power that the file gives."""
    scene = load_scene("sphere_in_cylinder")
    size = Axis("size", "1", "", [4.0], {"radius": AxisTerm("radius"), "speed": AxisTerm("speed", 0.5)})
    assert size.at(scene, 4.0) == {"radius": 0.1, "speed": 8.0}
    with pytest.raises(InputError, match="no such parameter"):
        Axis("x", "1", "", [1.0], {"nothing": AxisTerm()}).at(scene, 1.0)
    with pytest.raises(InputError, match="no such axis"):
        chosen([size], ["mass"])
    assert evenly_chosen([1, 2, 3, 4, 5, 6, 7], 3) == [1, 4, 7]
    assert evenly_chosen([1, 2], 3) == [1, 2]


def test_scale_free_axes() -> None:
    """Mass and size leave the dimensionless problem as it is: the numbers of a step in natural times stay the same."""
    axes = {axis.name: axis for axis in file_for("sphere_in_cylinder").axes}
    scene = load_scene("sphere_in_cylinder")
    for name in ("mass", "size"):
        assert axes[name].scale_free
        found = [load_scene("sphere_in_cylinder", **axes[name].at(scene, value)) for value in (1e-6, 1e6)]
        first, second = (values(one, 0.01 * one.natural_time) for one in found)
        assert {"turn", "spin", "fall", OSCILLATION} == set(first)
        assert first == pytest.approx(second)


def test_adependence_on_scale() -> None:
    """A boundary that moves along a scale-free axis by more than the rungs are apart is a finding."""

    def points(*largest: float | None) -> list[BoundaryPoint]:
        return [
            boundary_point(value=10.0**k, period=2.0, sides={"stable": side(largest=x, failure="refused")})
            for k, x in enumerate(largest)
        ]

    assert dependence(points(0.1, 0.1, 0.15), "stable") == ""
    assert dependence(points(None, None), "stable") == ""
    assert "0.05 of the natural time at 1, but 0.02 of the natural time at 10" in dependence(
        points(0.1, 0.04), "stable"
    )
    assert "nowhere at 10 (refused)" in dependence(points(0.1, None), "stable")
    cut = [dataclasses.replace(point, too_slow=0.05) for point in points(0.1, None)]
    assert dependence(cut, "stable") == ""


def test_what_explains_a_boundary() -> None:
    """The number that stays constant while the others move explains it; if all stay, none does."""
    moving = [{"turn": 0.05 * k, "spin": 0.2, "fall": 0.01 / k} for k in (1, 2, 8)]
    best = explanation(moving)
    assert best is not None
    assert (best.number, best.explains, best.spread) == ("spin", True, pytest.approx(1.0))
    still = explanation([{"turn": 0.1, "spin": 0.2}] * 3)
    assert still is not None
    assert not still.explains
    assert explanation(moving[:2]) is None


def claim(**more: Any) -> Claim:
    """A claim about the made-up point."""
    return Claim("made[formulation=only]", more.pop("boundary", "stable"), "a reason", **more)


def side(**more: Any) -> Boundary:
    """A boundary of the made-up point."""
    values: dict[str, Any] = {
        "largest": None,
        "reached": True,
        "numbers": {},
        "beyond": None,
        "failure": None,
        "silent": True,
    }
    return Boundary(**(values | {"error": None, "time": None, "message": None} | more))


POINT = boundary_point(
    engine="made",
    curve="made[formulation=only]",
    sides={
        "stable": side(largest=0.1, numbers={"spin": 0.3}, failure="energy gain"),
        "accurate": side(failure="creep"),
    },
)


@pytest.mark.parametrize(
    ("made", "contradictions"),
    [
        (claim(never=True), 1),
        (claim(boundary="accurate", never=True), 0),
        (claim(number="spin", between=[0.2, 0.4]), 0),
        (claim(number="spin", between=[0.4, 0.5]), 1),
        (claim(boundary="accurate", number="spin", between=[0.2, 0.4]), 1),
        (claim(failure=["energy gain"], silent=True), 0),
        (claim(failure=["creep"], silent=False), 2),
        (claim(axes=["mass"], never=True), 0),
        (claim(values=[5.0, 9.0], never=True), 0),
    ],
)
def test_claims(made: Claim, contradictions: int) -> None:
    """A claim is contradicted by what it says otherwise, and only where it applies."""
    assert len(made.contradictions([POINT])) == contradictions


def test_a_claim_that_nothing_depends_on_an_axis() -> None:
    """Boundaries that are the same in natural times confirm it; one that moves along the axis is named."""

    def along(*steps: float) -> list[BoundaryPoint]:
        """Points with the same natural time."""
        sides = (dataclasses.replace(POINT.sides["stable"], largest=step) for step in steps)
        return [
            dataclasses.replace(POINT, axis="mass", value=10.0**k, period=1.0, sides={"stable": one})
            for k, one in enumerate(sides)
        ]

    assert claim(same=True).contradictions(along(0.1, 0.1, 0.2)) == []
    (said,) = claim(same=True).contradictions(along(0.1, 0.1, 0.01))
    assert "expected the same everywhere" in said
    assert "0.01 of the natural time at 100" in said


BROKEN = [
    ('because = "it is so"', 'because = ""', "every claim needs its reason"),
    ('axes = ["V0"]', 'axes = ["speed"]', "no such axis"),
    ('number = "spin"', 'number = "spine"', "choose one of"),
    ("between = [0, 1]", "between = [1, 0]", r"\[low, high\]"),
    ("values = [1, 2]", "values = []", "needs its values"),
    ('study = "stability"', 'study = "regimes"', "can be used here"),
    ("parameters.speed = {}", "parameters.spee = {}", "no such parameter"),
    ("values = [1, 2]", "values = [1, nan]", "give a number"),
    ("values = [1, 2]", "values = [1, -inf]", "give a number"),
    ("values = [1, 2]", "values = [1, inf]\nhorizon = true", "positive and finite"),
    ("speed = {}", "speed = { times = inf }", "give a finite number"),
    ("between = [0, 1]", "between = [nan, 1]", r"\[low, high\]"),
    ('engine = "mujoco"', 'engine = "= mass"', "claims.0: engine = '= mass': write name"),
]
FILE = """
study = "stability"
title = "t"
question = "q"
scene = "sphere_in_cylinder"
[[axes]]
name = "V0"
unit = "m/s"
meaning = "initial speed"
values = [1, 2]
parameters.speed = {}
[[claims]]
engine = "mujoco"
boundary = "stable"
axes = ["V0"]
number = "spin"
between = [0, 1]
because = "it is so"
"""


@pytest.mark.parametrize(("old", "new", "words"), BROKEN)
def test_broken_files(tmp_path: Path, old: str, new: str, words: str) -> None:
    """A mistake in a file is named, with what to write instead."""
    path = tmp_path / "made.toml"
    path.write_text(FILE)
    assert file_for(str(path)).axes[0].values == [1, 2]
    path.write_text(FILE.replace(old, new))
    with pytest.raises(InputError, match=words):
        file_for(str(path))


@pytest.mark.drill
def test_a_scene_without_a_file(tmp_path: Path) -> None:
    """A scene for which nobody wrote axes has its own parameters, in parts of their defaults that its bounds allow."""
    folder = tmp_path / "my_scene"
    shutil.copytree(load_scene("inclined_plane").folder, folder)
    axes, scene = file_for(str(folder)).axes, load_scene(str(folder))
    assert axes[-1].horizon
    assert {axis.name for axis in axes[:-1]} <= set(scene.parameters)
    assert all(scene.parameters[axis.name] and 1.0 in axis.values for axis in axes[:-1])


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize("scene", ["sphere_in_cylinder", "inclined_plane"])
def test_our_files_can_be_read(scene: str) -> None:
    """Every axis of our own files gives scenes that exist."""
    for axis in file_for(scene).axes:
        for value in axis.values:
            load_scene(scene, **axis.at(load_scene(scene), value))
