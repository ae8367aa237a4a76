"""Files of both kinds: what is written comes back, and netCDF as xarray alone makes and reads it."""

from __future__ import annotations

import io
import sys
import zipfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy.io import netcdf_file

from proofroll.core.columns import Columns
from proofroll.core.errors import ProofrollError
from proofroll.core.events import Event, with_events
from proofroll.files.scene_file import load_scene
from proofroll.files.trajectory_file import StoredTrajectory, read, read_arrays, read_columns, write
from proofroll.running.simulation import simulate

VALUES = np.array([5e-324, -0.0, 1.7976931348623157e308, np.nan, -np.inf, 0.1, 9.969209968386869e36])
ALL_KINDS = xr.Dataset(
    {
        "number": ("time", VALUES, {"error_bar": 5e-324, "long_name": "größer"}),
        "small": ("time", np.linspace(0, 1, 7, dtype=np.float32)),
        "sticking": ("time", np.ones(7, dtype=np.int8)),
        "holds": ("time", VALUES > 0),
        "name": (("body", "time"), [["a", "zwölf", "", "c", "d", "e", "f"]]),
        "scalar": 3.0,
    },
    {"time": ("time", np.arange(7.0), {"units": "s"}), "xyz": ["x", "y", "z"]},
    {"count": 3, "half": np.float32(0.5), "message": "", "list": np.array([1, 2, 3]), "nothing": np.nan},
)
NO_EVENT = with_events(ALL_KINDS, [])
RUNS: dict[str, Callable[[], xr.Dataset]] = {
    "kinds": lambda: ALL_KINDS,
    "no event": lambda: NO_EVENT,
    "an event": lambda: with_events(ALL_KINDS, [Event("slip", 0.5, 0.4, 0.6)]),
    "balls": lambda: simulate(
        load_scene("sphere_in_cylinder", mu_static=0.2, mu_kinetic=0.15), "projection", until=0.3
    ),
    "mechanisms": lambda: simulate("double_pendulum", until=0.1),
}


@cache
def run(name: str) -> xr.Dataset:
    """One of these runs, made when the first test asks for it."""
    return RUNS[name]()


BOTH = pytest.mark.parametrize("ending", [".npz", ".nc"])


@pytest.mark.drill_of("balls-.npz", "balls-.nc", "mechanisms-.npz", "mechanisms-.nc")
@BOTH
@pytest.mark.parametrize("name", RUNS)
def test_a_run_comes_back(tmp_path: Path, name: str, ending: str) -> None:
    """Numbers, units, texts and truth values come back to the last bit, and the same run gives the same file."""
    dataset, file = run(name), tmp_path / "new" / f"run{ending}"
    contents = set()
    for given in (dataset, Columns.of(dataset)):
        write(given, file)
        xr.testing.assert_identical(read(file), dataset)
        contents.add(file.read_bytes())
    assert len(contents) == 1
    assert [path.name for path in file.parent.iterdir()] == [file.name]
    for variable, item in read(file).variables.items():
        assert item.to_numpy().tobytes() == dataset[variable].to_numpy().tobytes(), variable
        assert item.dtype == dataset[variable].dtype


@pytest.mark.drill
def test_others_read_the_same_from_the_file(tmp_path: Path) -> None:
    """The numbers in a file, as another reader of netCDF, or numpy, finds them there, are those of the dataset."""
    dataset = run("balls")
    write(dataset, tmp_path / "x.nc")
    write(dataset, tmp_path / "x.npz")
    with netcdf_file(tmp_path / "x.nc", mmap=False) as file, np.load(tmp_path / "x.npz") as arrays:
        for name, item in dataset.variables.items():
            if item.dtype.kind == "f":
                for values in (file.variables[name][...].astype(float), arrays[name]):
                    assert values.tobytes() == item.to_numpy().tobytes(), name
                assert file.variables[name].units == item.attrs["units"].encode()


def test_what_the_format_cannot_hold_is_refused(tmp_path: Path) -> None:
    """An integer beyond 32 bits is not cut."""
    with pytest.raises(ValueError, match="int64"):
        write(xr.Dataset({"count": ("time", [2**40])}), tmp_path / "run.nc")
    assert list(tmp_path.iterdir()) == []


def array_alone() -> bytes:
    """A file of numpy's with one array."""
    buffer = io.BytesIO()
    np.save(buffer, np.zeros(2))
    return buffer.getvalue()


def another_archive(about: str = "") -> bytes:
    """A file of numpy's that is no run; ``about`` stands where a run describes its variables."""
    buffer = io.BytesIO()
    np.savez(buffer, time=np.zeros(2))
    if about:
        with zipfile.ZipFile(buffer, "a") as archive:
            archive.writestr("about.json", about)
    return buffer.getvalue()


OTHERS = [
    another_archive(about) for about in ("", "[1, 2]", '[{"time": [["time"], 5]}, {}]', "[{}, [1]]", "[" * 100_000)
]


@BOTH
@pytest.mark.parametrize("content", [b"", b"something else", array_alone(), *OTHERS])
def test_another_file_is_no_trajectory(tmp_path: Path, content: bytes, ending: str) -> None:
    """Bytes of another kind are no trajectory."""
    file = tmp_path / f"run{ending}"
    file.write_bytes(content)
    with pytest.raises(ValueError, match="netCDF" if ending == ".nc" else "no stored trajectory"):
        read(file)


def test_arrays_are_numbers_and_texts(tmp_path: Path) -> None:
    """Arrays of numpy come back as they are, by columns, empty or compressed; objects are refused."""
    path, columns = tmp_path / "run.npz", np.asfortranarray(np.arange(6.0).reshape(2, 3))
    arrays = {"time": np.arange(2.0), "columns": columns, "texts": np.array(["a", "bc"]), "empty": np.zeros((2, 0))}
    np.savez_compressed(path, **arrays)
    for name, values in read_arrays(path).items():
        np.testing.assert_array_equal(values, arrays.pop(name), strict=True)
    assert not arrays
    np.savez(path, time=np.arange(2.0), objects=np.array([None, 1], dtype=object))
    with pytest.raises(ValueError, match="it holds objects"):
        read_arrays(path)


def test_a_damaged_file_is_no_trajectory(tmp_path: Path) -> None:
    """A stored file that was cut anywhere, or of whose arrays a bit was changed, is refused."""
    file = tmp_path / "run.npz"
    write(ALL_KINDS, file)
    whole = file.read_bytes()
    cuts = [whole[:length] for length in range(0, len(whole), 97)]
    with zipfile.ZipFile(file) as archive:
        starts = [(item.header_offset, len(item.filename), item.file_size) for item in archive.infolist()]
    # An entry is its header of 30 bytes, its name, what else the header says it has, and the array.
    ends = [at + 30 + name + int.from_bytes(whole[at + 28 : at + 30], "little") + size for at, name, size in starts]
    changed = [whole[: end - 1] + bytes([whole[end - 1] ^ 1]) + whole[end:] for end in ends]
    for content in cuts + changed:
        file.write_bytes(content)
        with pytest.raises(ValueError, match="no stored trajectory"):
            read_columns(file)


def test_a_write_that_fails_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file is whole or not there: a failure halfway leaves the old one and no scraps."""
    path = tmp_path / "run.npz"
    write(ALL_KINDS, path)
    before = path.read_bytes()

    def half(self: Path, content: bytes) -> None:
        with self.open("wb") as file:
            file.write(content[:100])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", half)
    with pytest.raises(ProofrollError, match="No space left on device"):
        write(NO_EVENT, path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_a_place_that_cannot_be_written(tmp_path: Path) -> None:
    """A folder that cannot be made gives one sentence."""
    (tmp_path / "file").write_text("")
    with pytest.raises(ProofrollError, match="cannot be written"):
        write(ALL_KINDS, tmp_path / "file" / "run.npz")


def test_what_was_read_longest_ago_makes_room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Trajectories are held up to a size together; one that was dropped is read again, and is what it was."""
    files = [tmp_path / f"{number}.npz" for number in range(4)]
    for file in files:
        write(ALL_KINDS, file)
    monkeypatch.setattr("proofroll.files.trajectory_file.MOST_HELD", int(2.5 * read(files[0]).nbytes))
    runs = [StoredTrajectory(file) for file in files]
    first = runs[0].dataset
    assert all(run.dataset.identical(first) for run in runs)
    assert [("dataset" in vars(run)) for run in runs] == [False, False, True, True]
    assert runs[0].dataset.identical(first)
    assert runs[0].dataset is runs[0].dataset


def test_what_nobody_uses_takes_no_room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Many trajectories that are read once and let go of, as those of a map, do not push out one that is in use."""
    file = tmp_path / "run.npz"
    write(ALL_KINDS, file)
    monkeypatch.setattr("proofroll.files.trajectory_file.MOST_HELD", int(2.5 * read(file).nbytes))
    used = StoredTrajectory(file)
    first = used.dataset
    for _ in range(5):
        assert StoredTrajectory(file).dataset.identical(first)
    assert used.dataset is first


def test_several_threads_may_hold_trajectories(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each gets what it asks for, while others make room."""
    made = ALL_KINDS.copy()
    monkeypatch.setattr("proofroll.files.trajectory_file.read", lambda _: made)
    monkeypatch.setattr("proofroll.files.trajectory_file.MOST_HELD", 50 * made.nbytes)
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(4) as pool:
            runs = [StoredTrajectory(tmp_path / str(number)) for number in range(300)]
            assert all(found is made for found in pool.map(lambda run: run.dataset, runs))
    finally:
        sys.setswitchinterval(interval)
