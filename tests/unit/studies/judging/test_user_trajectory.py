"""Trajectories of users: what they may hold."""

import io
import tracemalloc
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import proofroll
from proofroll.core.errors import InputError
from proofroll.files.trajectory_file import read_arrays, read_columns

TIMES = np.linspace(0, 1, 11)


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ({"time": TIMES, "p_WB": np.full((11, 1, 3), "a")}, "p_WB.*it holds text; give real numbers"),
        ({"time": TIMES, "q.pivot": np.zeros(11) + 1j}, "q.pivot.*it holds complex numbers; give real numbers"),
        ({"time": TIMES, "q.pivot": np.zeros(11, dtype=bool)}, "q.pivot.*it holds truth values; give real numbers"),
        (
            {"time": (1e3 * TIMES).astype("m8[ms]"), "q.pivot": np.zeros(11)},
            "time.*holds durations; give seconds",
        ),
        ({"time": TIMES.astype("m8[s]"), "q.pivot": np.zeros(11)}, "time.*holds durations; give seconds"),
        ({"time": np.arange(11).astype("M8"), "q.pivot": np.zeros(11)}, "time.*holds dates; give seconds"),
        ({"time": TIMES, "q.pivot": np.arange(11).astype("M8")}, "q.pivot.*holds dates; give seconds"),
        ({"time": TIMES, "q.pivot": TIMES.astype("m8[s]")}, "q.pivot.*holds durations; give seconds as real"),
        ({"time": TIMES.astype(str), "q.pivot": np.zeros(11)}, "time.*it holds text; give real numbers"),
        ({"time": 3e299 * TIMES, "q.pivot": np.zeros(11)}, "time up to 3e.299 s.*no motion is followed beyond 1e.09 s"),
    ],
)
def test_a_hostile_trajectory_is_refused(columns: dict[str, Any], words: str) -> None:
    """Values that are no real numbers, and times without end, are refused in one line with the column."""
    with pytest.raises(InputError, match=words):
        proofroll.judge(columns, "pendulum")


def test_a_header_that_promises_more_numbers_than_follow(tmp_path: Path) -> None:
    """Numbers that a file does not hold are told by name, and no memory is asked for them."""
    header, run = io.BytesIO(), tmp_path / "run.npz"
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (10**15,)})
    np.savez(run, time=TIMES)
    with zipfile.ZipFile(run, "a") as archive:
        archive.writestr("p_WB.npy", header.getvalue() + bytes(64))
    with pytest.raises(InputError, match=r"the header of p_WB promises 1e\+15 numbers, which do not follow"):
        proofroll.judge(run, "pendulum")


@pytest.mark.drill
def test_numbers_of_more_digits_are_judged(tmp_path: Path) -> None:
    """A file of longdouble has the verdict of the same numbers as float64."""
    angles = np.full(11, 2.8)
    long, short = tmp_path / "long.npz", tmp_path / "short.npz"
    np.savez(long, time=TIMES.astype(np.longdouble), **{"q.pivot": angles.astype(np.longdouble)})  # type: ignore[arg-type]  # its keywords are arrays
    np.savez(short, time=TIMES, **{"q.pivot": angles})  # type: ignore[arg-type]  # its keywords are arrays
    judged = [proofroll.judge(file, "pendulum").compared[0].judgement.error for file in (long, short)]
    assert judged[0] == judged[1]


@pytest.mark.parametrize(("place", "value"), [(b"PK\x01\x02", 1), (b"PK\x01\x02", 99), (b"\x93NUMPY", 40)])
def test_a_file_that_its_library_cannot_read(tmp_path: Path, place: bytes, value: int) -> None:
    """Encrypted entries, unknown compressions and endless headers are one line."""
    run = tmp_path / "run.npz"
    np.savez(run, time=TIMES, **{"q.pivot": np.zeros(11)})  # type: ignore[arg-type]  # its keywords are arrays
    content = bytearray(run.read_bytes())
    at = content.find(place)
    if value == 1:
        content[at + 8] = content[content.find(b"PK\x03\x04") + 6] = value
    elif value == 99:
        content[at + 10] = value
    else:
        content[at + 10 : at + 50] = b"(" * value
    run.write_bytes(content)
    with pytest.raises(InputError, match="no file of numpy's arrays") as caught:
        proofroll.judge(run, "pendulum")
    assert "\n" not in str(caught.value)


def test_rows_are_counted_before_anything_is_unpacked(tmp_path: Path) -> None:
    """An array of other rows than the times is told from its header, without the memory of its numbers."""
    run = tmp_path / "run.npz"
    np.savez_compressed(run, t=TIMES, angle=np.zeros(2 * 10**6))
    words = r"angle has the shape \(2000000,\); give one row for each of 11 times"
    with pytest.raises(InputError, match=words):
        proofroll.judge(run, "pendulum", columns={"t": "time", "angle": "q.pivot"})
    tracemalloc.start()
    with pytest.raises(ValueError, match="no stored trajectory"):
        read_columns(run)
    with pytest.raises(ValueError, match=words):
        read_arrays(run, "t")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 8e6  # bytes: half of the array


def test_more_samples_than_a_run_may_have_are_not_unpacked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file of more times than a run may have samples is refused by the header of its times."""
    monkeypatch.setattr("proofroll.files.trajectory_file.MOST_SAMPLES", 10)
    np.savez(tmp_path / "run.npz", time=TIMES, **{"q.pivot": TIMES})  # type: ignore[arg-type]  # its keywords are arrays
    with pytest.raises(InputError, match="it has 11 times; thin them to at most 10"):
        proofroll.judge(tmp_path / "run.npz", "pendulum")


@pytest.mark.drill
@pytest.mark.filterwarnings("error")
def test_times_of_half_precision_and_columns_of_another_shape_are_told_apart() -> None:
    """Times as float16 are read without a warning; a table of times, and a quantity of another shape, are named."""
    angles = np.full(11, 2.8)
    with pytest.raises(InputError, match=r"its shape is \(11, 1\); give one number for each sample"):
        proofroll.judge({"time": TIMES[:, None], "q.pivot": angles}, "pendulum")
    run = {"time": TIMES.astype(np.float16), "q.pivot": np.tile(angles[:, None], 5)}
    assert "q.pivot has the shape (11, 5), the truth has (11,)" in str(proofroll.judge(run, "pendulum"))


def test_judge_has_a_limit_of_time(command_line: Callable[..., tuple[int, str, str]], tmp_path: Path) -> None:
    """A truth that takes longer than ``--time-limit`` ends in one line and exit 2."""
    np.savez(tmp_path / "run.npz", time=9e8 * TIMES, **{"q.pivot": np.zeros(11)})
    code, out, err = command_line("judge", str(tmp_path / "run.npz"), "--scene", "pendulum", "--time-limit", "0.2")
    assert (code, out) == (2, "")
    assert "--time-limit = '0.2 s': the truth of pendulum took longer; end the trajectory sooner" in err


@pytest.fixture(scope="module")
def pendulum() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times [s], angle [rad] and place [m] of the pendulum."""
    run = proofroll.simulate("pendulum", "projection", until=0.2, every=0.01)
    return run["time"].to_numpy(), run["q.pivot"].to_numpy(), run["tip.x"].to_numpy()


@pytest.mark.drill
def test_columns_of_any_name_and_unit(
    pendulum: tuple[np.ndarray, np.ndarray, np.ndarray],
    command_line: Callable[..., tuple[int, str, str]],
    tmp_path: Path,
) -> None:
    """A table with semicolons, decimal commas, own names, ms, degrees and cm is judged as the same run in SI units."""
    times, angles, places = pendulum
    rows = zip(1e3 * times, np.degrees(angles), 100 * places, strict=True)
    lines = ["t (ms);theta;x", *(";".join(f"{value:.15g}".replace(".", ",") for value in row) for row in rows)]
    (tmp_path / "own.csv").write_text("\n".join(lines), encoding="utf-8")
    given = ("judge", str(tmp_path / "own.csv"), "pendulum")
    code, out, err = command_line(*given, "--map", "t=time,theta=q.pivot[deg],x=tip.x[cm]")
    assert (code, err) == (0, "")
    assert "✓ q.pivot" in out
    assert "✓ tip.x" in out
    code, out, err = command_line(*given, "--map", "t=time,theta=q.pivot,x=tip.x[cm]")
    assert code == 1
    assert out.startswith("✗ own.csv differs from the truth of pendulum: q.pivot is 57.3 times the truth")
    assert "--map 't=time,x=tip.x[cm],theta=q.pivot[deg]'" in " ".join(out.split())
    assert "tip.x" not in [line.partition(" is off")[0][2:] for line in out.splitlines()]
    out = command_line(*given, "--map", "t=time,theta=q.pivot,x=tip.x[cm]", "--all")[1]
    assert [line[:7] for line in out.splitlines() if " is off by " in line] == ["✗ q.piv", "✓ tip.x"]
    code, out, err = command_line(*given)
    assert (code, out) == (2, "")
    assert "its first line has the names, here t (ms), theta, x; --map t=time" in err
    code, _, err = command_line(*given, "--map", "tt=time")
    assert code == 2
    assert "it has no column tt; it has t, theta, x" in err


def test_arrays_are_renamed_and_converted(pendulum: tuple[np.ndarray, np.ndarray, np.ndarray]) -> None:
    """``columns`` does the same for arrays, and for a dataset whose attributes have the units."""
    times, angles, _ = pendulum
    names = {"t": "time[ms]", "theta": "q.pivot[deg]"}
    arrays = {"t": 1e3 * times, "theta": np.degrees(angles)}
    assert proofroll.judge(arrays, "pendulum", columns=names).agrees
    dataset = xr.Dataset({"q.pivot": ("time", np.degrees(angles), {"units": "deg"})}, {"time": times})
    assert proofroll.judge(dataset, "pendulum").agrees
    with pytest.raises(InputError, match="columns = 'phi': the trajectory has t, theta"):
        proofroll.judge(arrays, "pendulum", columns={"phi": "q.pivot"})


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize("own", [True, False], ids=["of a run", "of a file"])
@pytest.mark.parametrize("column", ["q.pivot", "v.pivot", "tip.x", "positions"])
def test_a_column_that_contradicts_the_state_is_named(column: str, *, own: bool) -> None:
    """Its largest difference and time are told; the same columns unchanged agree."""
    run = proofroll.simulate("pendulum", "projection", until=0.2, every=0.02)
    run = run.copy(deep=True) if own else run.drop_attrs(deep=False).drop_dims("between")
    assert proofroll.judge(run, "pendulum").agrees
    run[column][5:] += 0.25
    run[column][7] += 0.25
    judged = proofroll.judge(run, "pendulum")
    (wrong,) = (item for item in judged.compared if not item.agrees)
    assert wrong.judgement.observable == column
    assert wrong.at == pytest.approx(0.14)
    assert column not in judged.unjudged
    assert ("against the state of the same trajectory" in str(wrong)) is (column != "positions" or not own)


@pytest.mark.drill
def test_a_tolerance_of_a_column_is_for_what_was_given() -> None:
    """Beside a right state, too."""
    run = (
        proofroll.simulate("pendulum", "projection", until=0.2, every=0.02).drop_attrs(deep=False).drop_dims("between")
    )
    assert proofroll.judge(run, "pendulum", {"q.pivot": "1e-6 rad"}).agrees
    run["q.pivot"][5] += 1e-4
    assert not proofroll.judge(run, "pendulum", {"q.pivot": "1e-6 rad"}).agrees
