"""Agreement in other people's tests: :mod:`proofroll.testing`, ``proofroll judge``, and the pytest plug-in."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp
from tiny import Tiny
from typer.testing import CliRunner

import proofroll
from proofroll.cli import app
from proofroll.core.errors import InputError
from proofroll.core.truth import truth
from proofroll.files.scene_file import load_scene
from proofroll.files.trajectory_file import read, write
from proofroll.papers.blajer_2006.ball.sampling import BallSample
from proofroll.running.simulation import build, simulate
from proofroll.testing import assert_agrees

Proofroll = Callable[..., tuple[int, str, str]]
BECAUSE = "a first look"
STILL = {"time": [0.0, 0.1]} | {name: np.zeros((2, 3)) for name in ("p_WB", "v_WB", "w_WB")}
STILL["q_WB"] = np.array([[1.0, 0, 0, 0], [1.0, 0, 0, 0]])


def swing(gravity: float = 9.81) -> dict[str, np.ndarray]:
    """Somebody's own pendulum, as arrays: a rod of a metre, let go at 2.8 rad from hanging down."""
    scene = proofroll.load_scene("pendulum")
    start = scene.elements[0].mechanism.joints[0].q0[0]  # type: ignore[attr-defined]  # a mechanism has joints
    times = np.linspace(0, 1, 21)
    found = solve_ivp(
        lambda _, x: [x[1], -1.5 * gravity * np.sin(x[0])], (0, 1), [start, 0], t_eval=times, rtol=1e-10, atol=1e-12
    )
    return {"time": times, "q.pivot": found.y[0]}


@pytest.mark.drill
def test_an_engine_that_agrees_says_what_was_found() -> None:
    """An engine by its name agrees, and the answer has error, tolerance and the truth's error bar."""
    found = assert_agrees("pendulum", "projection", tolerance={"positions": "1e-3 m"}, because=BECAUSE, until=0.2)
    (compared,) = found.compared
    assert compared.judgement.error < 1e-3
    assert 0 < compared.judgement.truth_error_bar < 1e-9
    assert str(found).startswith(
        "agrees with the truth of pendulum (tolerance: a first look)\n  ok positions are off by"
    )


class Drifting(Tiny):
    """Half a degree a second, which nobody announces as a plug-in."""

    def sample(self) -> BallSample:
        """The right state, further along the cylinder."""
        right = super().sample()
        return BallSample(right.p_WB + np.array([0, 0, 0.01 * self.t]), right.v_WB, right.w_WB, force=right.force)


@pytest.mark.drill
def test_what_differs_is_told_with_numbers() -> None:
    """A class needs no entry point; of one that is wrong the message says what, how much, when, and the bounds."""
    scene = proofroll.load_scene("sphere_in_cylinder")
    assert assert_agrees(scene, Tiny, tolerance="1e-3 m", because=BECAUSE, until=0.2)
    with pytest.raises(AssertionError) as caught:
        assert_agrees(scene, Drifting, tolerance={"z": "1e-3 m", "gamma": "1 %"}, because=BECAUSE, until=0.2)
    head, first, second = str(caught.value).splitlines()
    assert head == "tiny differs from the truth of sphere_in_cylinder (tolerance: a first look)"
    assert first.startswith("  !! z is off by 2e-3 m at 0.2 s, allowed 1e-3 m; the truth is known to ")
    assert second.startswith("  ok gamma is off by")


def test_an_engine_that_is_built_already() -> None:
    """An instance is run from where it stands."""
    scene = proofroll.load_scene("sphere_in_cylinder")
    built = Tiny.build(scene, Tiny.settings())
    assert_agrees(scene, built, tolerance="1e-3 m", because=BECAUSE, until=0.1)


@pytest.mark.drill
def test_a_tolerance_below_the_truths_own_bar_passes_nothing() -> None:
    """Where the truth is not known well enough nobody agrees, and the message says how well it is known."""
    with pytest.raises(AssertionError, match="not judged, for the truth is known to"):
        assert_agrees("pendulum", "truth", tolerance={"positions": "1e-30 m"}, because=BECAUSE, until=0.1)


@pytest.mark.one_in(3)
@pytest.mark.drill
@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"because": " "}, "say why"),
        ({"tolerance": {"q.pivto": "1 %"}}, "this trajectory has "),
        ({"tolerance": {"positions": "1e-3 rad"}}, "its unit is m"),
        ({"tolerance": "close"}, "write 1e-4 of the path"),
        ({"tolerance": []}, "write a positive number and a unit"),
        ({"tolerance": {}}, "give a tolerance"),
    ],
)
def test_what_makes_no_sense_is_one_line(change: dict[str, Any], words: str) -> None:
    """A tolerance of nothing, of another unit or without a reason is told in one line."""
    given = {"tolerance": "1 %", "because": BECAUSE, "until": 0.1} | change
    with pytest.raises(InputError, match=words) as caught:
        assert_agrees("pendulum", "projection", **given)
    assert "\n" not in str(caught.value)


@pytest.mark.drill
def test_arrays_of_ones_own_are_judged() -> None:
    """An angle over time, from anywhere, is held against the truth at its own times; a wrong gravity shows."""
    assert proofroll.judge(swing(), "pendulum", "1e-6 rad", because=BECAUSE).agrees
    late = {name: values[3:] for name, values in swing().items()}
    assert proofroll.judge(late, "pendulum", 1e-6).agrees
    wrong = proofroll.judge(swing(gravity=9.8), "pendulum", "1e-6 rad")
    assert not wrong.agrees
    assert "q.pivot is off by" in str(wrong)


@pytest.mark.drill
def test_the_state_alone_is_enough() -> None:
    """From place, velocity and spin of a ball everything else follows, as it does for an engine."""
    run = proofroll.simulate(proofroll.load_scene("sphere_in_cylinder"), "projection", until=0.2, every=0.02)
    state = {name: run[name].to_numpy() for name in ("time", "p_WB", "v_WB", "w_WB")}
    assert proofroll.judge(state, "sphere_in_cylinder", {"p_WB": "1e-3 m"}).agrees


def state_of(scene: str, **change: Any) -> dict[str, Any]:
    """The state of an honest run as arrays, some of them changed."""
    run = proofroll.simulate(scene, "projection", until=0.2, every=0.02)
    state = {name: run[name].to_numpy() for name in ("time", "p_WB", "v_WB", "w_WB", "q_WB") if name in run}
    return state | {name: how(state[name]) for name, how in change.items()}


@pytest.mark.drill
@pytest.mark.one_in(4)
@pytest.mark.drill_of("v_WB-sphere_in_cylinder")
@pytest.mark.parametrize("scene", ["sphere_in_cylinder", "pendulum"])
@pytest.mark.parametrize("name", ["v_WB", "w_WB"])
def test_velocities_that_are_given_are_judged(scene: str, name: str) -> None:
    """Velocities and spins in degrees, huge or off by 7 are no agreement, though the places agree."""
    assert proofroll.judge(state_of(scene), scene).agrees
    for factor, offset in ((180 / np.pi, 0.1), (1e30, 0.1), (1, 7)):
        lie = {name: lambda given, factor=factor, offset=offset: factor * given + offset}
        found = proofroll.judge(state_of(scene, **lie), scene)
        assert name in [item.judgement.observable for item in found.compared if not item.agrees]


@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("scene", "change", "words"),
    [
        ("sphere_in_cylinder", {"v_WB": lambda v: v * np.nan}, "v_WB.*it is not finite at 0 s"),
        (
            "sphere_in_cylinder",
            {"p_WB": lambda p: np.where(np.arange(11) > 2, np.inf, p.T).T},
            "p_WB.*finite at 0.06 s",
        ),
        ("pendulum", {"q_WB": lambda q: 7 * q}, "q_WB has length 7 .*give unit quaternions"),
        ("pendulum", {"q_WB": lambda q: 0 * q}, "q_WB has length 0 .*give unit quaternions"),
    ],
)
def test_a_state_that_is_none(scene: str, change: dict[str, Any], words: str) -> None:
    """A state that is not finite, or whose quaternions are none, is told in one line with its variable."""
    with pytest.raises(InputError, match=words) as caught:
        proofroll.judge(state_of(scene, **change), scene)
    assert "\n" not in str(caught.value)


@pytest.mark.drill
def test_quaternions_of_the_other_sign_are_the_same() -> None:
    """Turned by -q as by q, whether alone or with the state, and from any sample on."""
    given = state_of("pendulum", q_WB=lambda q: q * np.where(np.arange(11) % 3, -1.0, 1.0)[:, None, None])
    alone = {name: given[name] for name in ("time", "q_WB")}
    for run in (given, alone, {name: values[2:] for name, values in given.items()}):
        assert proofroll.judge(run, "pendulum", {"q_WB": 1e-3}).agrees


@pytest.mark.drill
def test_a_file_that_run_wrote_knows_its_scene(tmp_path: Path) -> None:
    """`judge FILE` alone takes scene and parameters from the file; of one without it asks for the scene."""
    path = str(tmp_path / "run.nc")
    given = ["--engine", "projection", "--until", "0.1", "--set", "length=2", "--out", path]
    assert CliRunner().invoke(app, ["run", "pendulum", *given]).exit_code == 0
    done = CliRunner().invoke(app, ["judge", path])
    assert (done.exit_code, done.output.splitlines()[0]) == (0, "✓ run.nc agrees with the truth of pendulum")
    xr.load_dataset(path, engine="scipy").drop_attrs().to_netcdf(other := tmp_path / "other.nc", engine="scipy")
    assert CliRunner().invoke(app, ["judge", str(other)]).exit_code != 0


@pytest.mark.drill
@pytest.mark.nightly_of("sphere_in_cylinder")
@pytest.mark.drill_of("sphere_in_cylinder")
@pytest.mark.parametrize("scene", ["sphere_in_cylinder", "pendulum"])
def test_a_run_of_which_variables_were_left_out(scene: str, tmp_path: Path) -> None:
    """A file that run wrote is judged by what somebody left in it."""
    run = proofroll.simulate(scene, "projection", until=0.2, every=0.02)
    keep = ["p_WB", "v_WB", "w_WB", *(["q_WB"] if scene == "pendulum" else [])]
    for names in (keep, keep[:1], keep[1:]):
        write(run[names], path := tmp_path / "some.nc")
        found = proofroll.judge(str(path), scene)
        assert found.agrees, found
        assert set(names) <= {item.judgement.observable for item in found.compared} | {"q_WB"}
    for lost in {"N", "F2", "needed_friction"} & set(run):  # some of the forces, and not all
        write(run.drop_vars(lost), path)
        assert {"N", "F2", "F3"} - {lost} <= {
            item.judgement.observable for item in proofroll.judge(path, scene).compared
        }


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize("scene", ["sphere_in_cylinder", "double_pendulum"])
def test_a_table_of_numbers(command_line: Proofroll, scene: str, tmp_path: Path) -> None:
    """What run writes as CSV has every number over time under its name and unit, and is judged as the run is."""
    own = tmp_path / "run.csv"
    code, _, err = command_line("run", scene, "--engine", "projection", "--until", "0.1", "--out", str(own))
    assert (code, err) == (0, "")
    run, table = proofroll.simulate(scene, "projection", until=0.1), np.genfromtxt(own, delimiter=",", skip_header=1)
    header = own.read_text(encoding="utf-8").splitlines()[0].split(",")
    assert header[0] == "time [s]"
    last = f"w_WB/{run['body'].item(-1)}/z [rad/s]" if "body" in run.dims else "w_WB/z [rad/s]"
    assert np.array_equal(table[:, header.index(last)], run["w_WB"].to_numpy().reshape(len(table), -1)[:, -1])
    code, out, err = command_line("judge", str(own), "--scene", scene)
    assert (code, err) == (0, ""), out
    assert "v_WB is off by" in out
    decides = "positions" if scene == "double_pendulum" else " gamma,"
    assert decides not in out.partition("not judged:")[2]  # which is judged


@pytest.mark.parametrize(
    ("header", "words"),
    [
        ("time [s],q.pivot [rad]", ""),
        ("time,q.pivot", ""),
        ("time [days],q.pivot [rad]", "convert time to s"),
        ("time [s],q.pivot [cm]", "convert q.pivot to rad"),
        ("t [s],q.pivot [rad]", "it has no column time"),
        ("time [s],time [s]", "two columns are called time"),
        ("time [s],[rad]", r"column 2 is called '\[rad\]'"),
        ("time [s]", "line 2 has 2 fields, the header 1; [0-9]+ further lines are wrong"),
        ("time [s],p_WB/rod/x [m]", "the columns of p_WB are not whole"),
    ],
)
def test_a_table_of_ones_own(header: str, words: str, tmp_path: Path) -> None:
    """CSV from anywhere is judged; what is wrong with it is one line that names the column or line."""
    own = swing()
    rows = "".join(f"{t!r},{q!r}\n" for t, q in zip(own["time"].tolist(), own["q.pivot"].tolist(), strict=True))
    (file := tmp_path / "own.csv").write_text(f"{header}\n{rows}", encoding="utf-8-sig")
    if not words:
        assert proofroll.judge(file, "pendulum", "1e-6 rad").agrees
        return
    with pytest.raises(InputError, match=words) as caught:
        proofroll.judge(file, "pendulum")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "it is empty; its first line has names with units"),
        ("time [s],q.pivot [rad]\n", "there are no samples; give times"),
        ("time [s],q.pivot [rad]\n0.0,2.8\n0.2,2.8\n0.1,2.8\n", "0.1 s follows 0.2 s; give times"),
        ("time [s],q.pivot [rad]\n0.0,2.8\nnan,2.8\n", "sample 2 has no time; give times"),
        ("time [s],q.pivot [rad]\n-1,2.8\n0.1,2.8\n", "it begins at -1 s; give times"),
        ("time [s],q.pivot [rad]\n0.0,2.8\n0.1,\n", r"line 3, column q.pivot \[rad\]: there is no number; fill it"),
        (
            "time [s],q.pivot [rad]\n0.0,2.8\n0.1,none\n",
            r"line 3, column q.pivot \[rad\]: 'none' is no number; fill it",
        ),
        ('time [s],q.pivot [rad]\n0.0,"2.8\n0.1,2.7\n', "line 3: unexpected end of data"),
    ],
)
def test_a_table_that_is_none_is_one_line(text: str, words: str, tmp_path: Path) -> None:
    """Without samples, with times that do not rise, a hole, a word or an open quote it is told with the place."""
    (file := tmp_path / "own.csv").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=words) as caught:
        proofroll.judge(file, "pendulum")
    assert "\n" not in str(caught.value)


def test_rows_of_separators_alone_are_no_samples(tmp_path: Path) -> None:
    """Rows without any number, which spreadsheets write at the end, change nothing."""
    text = "time [s],q.pivot [rad]\n0.0,2.8\n0.1,2.78392784\n"
    readings = []
    for tail in ("", ",\n,\n"):
        (file := tmp_path / "own.csv").write_text(text + tail, encoding="utf-8")
        readings.append(read(file)["q.pivot"].to_numpy().tolist())
    assert readings[0] == readings[1]


@pytest.mark.drill
def test_bodies_in_another_order(tmp_path: Path) -> None:
    """Bodies of a file stand in the order of the scene, or are told to."""
    run = proofroll.simulate("double_pendulum", "projection", until=0.1)
    other = run[["p_WB", "v_WB", "w_WB", "q_WB"]].drop_attrs().isel(body=[1, 0])
    for ending in ("csv", "nc"):
        write(other, file := tmp_path / f"run.{ending}")
        with pytest.raises(InputError, match="in its order: "):
            proofroll.judge(file, "double_pendulum")


@pytest.mark.drill
def test_reactions_of_a_file_are_judged(tmp_path: Path) -> None:
    """A CSV of a run is judged with its forces and moments, as the run itself is, and a wrong one differs."""
    run = proofroll.simulate("pendulum", "pinocchio", until=0.1)
    write(run, file := tmp_path / "run.csv")
    found = proofroll.judge(file, "pendulum")
    assert found.agrees
    assert {"forces", "torques"} <= {item.judgement.observable for item in found.compared}
    assert not any(name.startswith(("force", "torque")) for name in found.unjudged)
    run["forces"] = run["forces"] * 1.1
    write(run, file)
    assert [item.judgement.observable for item in proofroll.judge(file, "pendulum").compared if not item.agrees] == [
        "forces"
    ]


def test_arrays_of_numpy_in_a_file(tmp_path: Path) -> None:
    """A file of ``numpy.savez`` is judged as its arrays are; any other file of that ending is one line."""
    np.savez(tmp_path / "own.npz", **swing())
    assert proofroll.judge(tmp_path / "own.npz", "pendulum", "1e-6 rad").agrees
    (tmp_path / "none.npz").write_bytes(b"PK")
    with pytest.raises(InputError, match=r"none\.npz is no file of numpy's arrays"):
        proofroll.judge(tmp_path / "none.npz", "pendulum")


def test_a_file_that_was_cut_off(tmp_path: Path) -> None:
    """Wherever a file ends before it should, it is told in one line."""
    write(proofroll.simulate("pendulum", "projection", until=0.1), whole := tmp_path / "whole.nc")
    for size in (100, 700, 1500):
        (part := tmp_path / "part.nc").write_bytes(whole.read_bytes()[:size])
        with pytest.raises(InputError, match="cannot be read"):
            proofroll.judge(str(part), "pendulum")


@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("run", "words"),
    [
        ({"q.pivot": [0.0]}, "it has no time"),
        ({"time": [0.0, 0.1], "q.pivot": [0.0]}, "one row for each of the 2 times"),
        ({"time": [0.1, 0.0], "q.pivot": [0.0, 0.0]}, "rise from 0"),
        ({"time": [0.0], "q.pivot": [2.8]}, "it has only the start"),
        ({"time": [0.0, 0.1], "angle": [0.0, 0.0]}, "the truth has none of these; .*it has .*q.pivot"),
        ("nowhere.nc", "there is no such file"),
        (STILL | {"p_WB": np.zeros((2, 2))}, "p_WB .*: these are no states of pendulum"),
        (STILL | {"joint_force": np.zeros((2, 3, 2))}, r"no states of pendulum \(.*joint_force with shape \(3, 2\)"),
    ],
)
def test_a_trajectory_that_is_none(run: Any, words: str) -> None:
    """What cannot be judged is told in one line, with what is missing."""
    with pytest.raises(InputError, match=words):
        proofroll.judge(run, "pendulum")


@pytest.mark.parametrize(
    ("name", "unit", "words"),
    [
        ("q.pivot", "gon", "'q.pivot in gon': convert q.pivot to rad"),
        ("time", "days", "'time in days': convert time to s"),
        ("p_WB", "inch", "'p_WB in inch': convert p_WB to m,"),
        ("q.pivot", "radians", ""),
    ],
)
def test_units_are_those_of_the_truth(name: str, unit: str, words: str) -> None:
    """A variable that says another unit is refused in one line, of the state too; a unit in words is the same."""
    import xarray as xr

    arrays = swing() if name != "p_WB" else STILL
    dims = {key: ("time", *(f"{key}_{axis}" for axis in range(1, np.ndim(values)))) for key, values in arrays.items()}
    given = {key: xr.DataArray(values, dims=dims[key]) for key, values in arrays.items()}
    given[name].attrs["units"] = unit
    whole = xr.Dataset({key: item for key, item in given.items() if key != "time"}, {"time": given["time"]})
    for run in (given, whole):
        if not words:
            assert proofroll.judge(run, "pendulum", "1e-6 rad").agrees
            continue
        with pytest.raises(InputError, match=words) as caught:
            proofroll.judge(run, "pendulum")
        assert "\n" not in str(caught.value)


@pytest.mark.drill
def test_what_is_not_judged_is_named() -> None:
    """What the truth does not have, what has no tolerance, and what the state says already, each with its reason."""
    own = swing()
    given = own | {"q.pviot": own["q.pivot"], "v.pivot": np.gradient(own["q.pivot"], own["time"])}
    found = proofroll.judge(given, "pendulum", {"q.pivot": "1e-6 rad"})
    assert found.agrees
    assert str(found).splitlines()[2:] == [
        "  not judged: q.pviot; the truth has nothing of that name",
        "  not judged: v.pivot; no tolerance is given",
    ]
    assert not proofroll.judge(own, "pendulum", {"q.pivot": "1e-6 rad"}).unjudged
    run = proofroll.simulate("pendulum", "projection", until=0.1)
    assert not proofroll.judge(run, "pendulum").unjudged
    state = {name: run[name].to_numpy() for name in ("time", "p_WB", "v_WB", "w_WB", "q_WB", "energy")}
    assert proofroll.judge(state, "pendulum").unjudged == {"energy": "it follows from the state, which is judged"}
    of_places = proofroll.judge(state, "pendulum", {"positions": "1 %"}).unjudged
    assert of_places == dict.fromkeys(("p_WB", "v_WB", "w_WB", "q_WB", "energy"), "no tolerance is given")


@pytest.mark.nightly
def test_bodies_beside_the_tracked_points_are_named_where_no_tolerance_judges_them() -> None:
    """A crank that is a metre off agrees in the places of tracked points; that its own place is not judged is said."""
    run = proofroll.simulate("slider_crank", "projection", until=0.05)
    state = {name: run[name].to_numpy() for name in ("time", "p_WB", "v_WB", "w_WB", "q_WB")}
    state["p_WB"] = state["p_WB"] + np.array([1.0, 0.0, 0.0]) * (np.arange(3) == 0)[:, None]
    found = proofroll.judge(state, "slider_crank", {"positions": "1 mm"})
    assert found.agrees
    assert str(found).endswith("not judged: p_WB, v_WB, w_WB, q_WB; no tolerance is given")
    assert not proofroll.judge(state, "slider_crank").agrees


def test_a_notebook_shows_a_verdict() -> None:
    """A verdict is a table with a row for each quantity; what somebody else wrote is text in it."""
    given = swing(9.7) | {"<b>mine": swing()["time"]}
    shown = proofroll.judge(given, "pendulum", {"q.pivot": "1e-3 rad"}, because="<i>a look")._repr_html_()
    assert re.search(r"<th>q\.pivot</th><td>✗ differs</td><td>[\d.]+ rad</td><td>1e-3 rad</td>", shown)
    assert "differs from the truth of pendulum (tolerance: &lt;i&gt;a look)" in shown
    assert "not judged: &lt;b&gt;mine; the truth has nothing of that name" in shown


@pytest.mark.drill
def test_the_command(proofroll: Proofroll, tmp_path: Path) -> None:
    """A file of somebody's is judged: exit 0 if it agrees, 1 if not, with the numbers as JSON; 2 for another scene."""
    import xarray as xr

    right, wrong, own = (tmp_path / f"{name}.nc" for name in ("right", "wrong", "own"))
    for file, gravity in ((right, 9.81), (wrong, 9.7)):
        arrays = swing(gravity)
        write(xr.Dataset({"q.pivot": ("time", arrays["q.pivot"])}, {"time": arrays["time"]}), file)
    given = ["--scene", "pendulum", "--tolerance", "q.pivot=1e-6 rad", "--because", BECAUSE]
    code, out, err = proofroll("judge", str(right), *given)
    assert (code, err) == (0, "")
    assert out.startswith("✓ right.nc agrees with the truth of pendulum (tolerance: a first look)")
    code, out, _ = proofroll("judge", str(wrong), *given, "--json")
    found = json.loads(out)
    assert (code, found["agrees"], found["compared"][0]["verdict"]) == (1, False, "differs")
    documented = (Path(__file__).parents[1] / "docs" / "json.md").read_text(encoding="utf-8")
    section = documented.partition("## `judge --json`")[2].partition("\n## ")[0]
    assert set(re.findall(r"^\| `(\w+)` \|", section, flags=re.MULTILINE)) == set(found)
    assert found["compared"][0].keys() == set(re.findall(r"`(\w+)`", section.strip().splitlines()[-1])) - {"compared"}
    assert proofroll("run", "pendulum", "--engine", "projection", "--until", "0.1", "--out", str(own))[0] == 0
    assert proofroll("judge", str(own), "--scene", "pendulum")[0] == 0
    for either in ((str(own), "pendulum"), ("pendulum", str(own))):
        assert proofroll("judge", *either)[0] == 0
    code, _, err = proofroll("judge", str(own), "--scene", "pendulum", "--set", "gravity=9.7")
    assert code == 2
    assert "it is a run of pendulum with other numbers" in err


@pytest.mark.nightly
def test_the_plug_in_costs_nothing_until_it_is_used(tmp_path: Path) -> None:
    """Pytest starts without loading anything heavy of this package; a test that takes the fixture gets the function."""
    (tmp_path / "test_mine.py").write_text(
        "import sys\n"
        "def test_light():\n"
        "    assert 'proofroll.pytest_plugin' in sys.modules\n"
        "    assert not {'numpy', 'scipy', 'xarray', 'pydantic'} & set(sys.modules)\n"
        "def test_mine(assert_agrees):\n"
        "    assert_agrees('pendulum', 'projection', tolerance='1 %', because='a look', until=0.1)\n"
        "def test_wrong(assert_agrees):\n"
        "    run = {'time': [0.0, 0.1], 'q.pivot': [0.0, 0.0]}\n"
        "    assert_agrees('pendulum', run, tolerance='1e-3 rad', because='a look')\n"
    )
    others = [
        word for name in ("cacheprovider", "hypothesispytest", "xdist", "timeout") for word in ("-p", f"no:{name}")
    ]
    command = [sys.executable, "-m", "pytest", "-q", *others, "."]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=600)
    assert "1 failed, 2 passed" in done.stdout, done.stdout
    # a failure shows the line of the test and the sentence, none of our frames
    assert "AssertionError: the trajectory differs from the truth of pendulum" in done.stdout
    assert "testing.py" not in done.stdout


@pytest.mark.parametrize("given", [object, 3])
def test_what_is_no_engine(given: object) -> None:
    """A class or a thing without the methods of an engine is told what it lacks."""
    with pytest.raises(InputError, match=r"give a name, or a class that has name, .*build, advance, sample, built too"):
        build(load_scene("pendulum"), given)


@pytest.mark.nightly
def test_the_orientation_of_a_ball_that_nobody_asked_for() -> None:
    """An orientation that an engine gives of a ball is judged, whether the scene asks for it or not."""
    scene = load_scene("sphere_in_cylinder")
    true = truth(scene.fully_asked, np.linspace(0.0, 0.2, 11))
    state = {name: true[name].to_numpy() for name in ("time", "p_WB", "v_WB", "w_WB", "q_WB")}
    assert proofroll.judge(state, scene).agrees
    frozen = proofroll.judge(state | {"q_WB": state["q_WB"][:1].repeat(11, axis=0)}, scene)
    assert [item.judgement.observable for item in frozen.compared if not item.agrees] == ["q_WB"]


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize("name", ["stop", "pendulum_friction"])
def test_a_mechanism_that_switches_is_judged(name: str) -> None:
    """A run of a mechanism whose truth has events is judged, though no run of a mechanism tells any."""
    found = proofroll.judge(proofroll.simulate(name, "projection", until=0.5, every=0.05), name)
    assert found.agrees, found


@pytest.mark.nightly
def test_what_lies_behind_the_end_of_a_truth_is_not_judged() -> None:
    """A run agrees whatever it does behind the end of the truth, and differs by what it does before."""
    scene = load_scene("bouncing_ball", back_spin=60.0, height=0.1, restitution=0.5, tangential_restitution=1.0)
    true = simulate(scene, "truth", until=0.6, every=0.02)  # ends at 0.43 s
    missing = 31 - len(true["time"])
    assert missing > 5
    given = {name: true[name].to_numpy() for name in ("p_WB", "v_WB", "w_WB", "q_WB")}
    given = {name: np.concatenate([values, [values[-1]] * missing]) for name, values in given.items()}
    given["time"] = 0.02 * np.arange(31)
    judged = assert_agrees(scene, given, tolerance={"gap": "1e-6 m"}, because="copied from the truth")
    assert "not judged: what lies behind" in str(judged)
    given["p_WB"][28] += 1.0
    assert_agrees(scene, given, tolerance={"gap": "1e-6 m"}, because="copied from the truth")
    given["p_WB"][15] += 1.0
    with pytest.raises(AssertionError, match="gap is off by"):
        assert_agrees(scene, given, tolerance={"gap": "1e-6 m"}, because="copied from the truth")
