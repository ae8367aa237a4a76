from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy.io import netcdf_file

from proofroll.core.dataset import from_samples
from proofroll.core.engine import Sample
from proofroll.core.errors import ProofrollError
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.ball_on_surface.closed_form import closed_form
from proofroll.elements.ball_on_surface.dataset import columns
from proofroll.elements.ball_on_surface.element import changed, rolling_ball
from proofroll.files.netcdf import read, read_some, write
from proofroll.files.scene_file import load_scene


def exact(scene: Scene, times: np.ndarray) -> xr.Dataset:
    """The closed form alone, which costs nothing."""
    motion = closed_form(rolling_ball(scene), times)
    assert motion is not None
    return columns(rolling_ball(scene), times, motion.p_WB, motion.v_WB, motion.w_WB, force=motion.force).dataset()


@pytest.mark.parametrize("every", [0.01, 0.25, 0.7, 1.3])
@pytest.mark.parametrize("speed", [4.0, -6.0])
def test_angle_is_unwrapped(every: float, speed: float) -> None:
    """γ grows without jumps also when the ball goes round up to six times between two samples."""
    scene = load_scene("sphere_in_cylinder", speed=speed)
    times = np.arange(0, 5, every)
    assert exact(scene, times)["gamma"].to_numpy() == pytest.approx(speed / 0.2 * times, abs=1e-9)


def test_angle_starts_on_the_branch_of_the_scene() -> None:
    """An initial γ beyond half a turn stays what it is."""
    scene = load_scene("sphere_in_cylinder")
    start = dataclasses.replace(scene.elements[0].start, coordinates=(40.0, 0.1))
    found = exact(changed(scene, start=start), np.array([0, 0.1]))["gamma"]
    assert found.to_numpy() == pytest.approx([40.0, 42.0], abs=1e-12)


def test_derived_variables(scene: Scene) -> None:
    """Rates, slip, local forces and needed friction follow from the state and the force by their definitions."""
    times = np.linspace(0, 0.1, 5)
    dataset = truth(scene, times)
    body = rolling_ball(scene)
    names = body.surface.coordinates
    u = np.stack([dataset[name].to_numpy() for name in names], axis=-1)
    rates = np.stack([dataset[f"{name}_rate"].to_numpy() for name in names], axis=-1)
    assert body.surface.position(u) == pytest.approx(dataset["p_WB"].to_numpy(), abs=1e-12)
    velocity = np.einsum("tij,tj->ti", body.surface.tangents(u), rates)
    assert velocity == pytest.approx(dataset["v_WB"].to_numpy(), abs=1e-12)
    a = body.ball.radius
    along = velocity[:, None, :] @ body.surface.frame(u)
    assert dataset["omega2"].to_numpy() == pytest.approx(along[:, 0, 2] / a, abs=1e-8)
    assert dataset["omega3"].to_numpy() == pytest.approx(-along[:, 0, 1] / a, abs=1e-8)
    friction = np.hypot(dataset["F2"], dataset["F3"]) / dataset["N"]
    assert dataset["needed_friction"].to_numpy() == pytest.approx(friction.to_numpy(), rel=1e-12)
    assert float(dataset["N"].min()) > 0


def test_slip_has_sign_and_size() -> None:
    """A ball that spins too fast slips by the surplus."""
    scene = load_scene("sphere_in_cylinder")
    body = rolling_ball(scene)
    surplus = np.array([0.0, 3.0, 2.0])
    dataset = columns(
        rolling_ball(scene), np.zeros(1), body.p0[None], body.v0[None], (body.w0 + surplus)[None]
    ).dataset()
    assert float(dataset["slip2"][0]) == pytest.approx(0.025 * 2, rel=1e-12)
    assert float(dataset["slip3"][0]) == pytest.approx(-0.025 * 3, rel=1e-12)


def test_every_variable_has_units(times: np.ndarray) -> None:
    """No variable is without unit and meaning."""
    dataset = exact(load_scene("sphere_in_cylinder"), times)
    assert dataset["time"].attrs["units"] == "s"
    for name, values in dataset.data_vars.items():
        assert values.attrs["units"], name
        assert values.attrs["long_name"], name
    units = {name: dataset[name].attrs["units"] for name in ("gamma", "gamma_rate", "z_rate", "N", "energy")}
    assert units == {"gamma": "rad", "gamma_rate": "rad/s", "z_rate": "m/s", "N": "N", "energy": "J"}


def test_what_the_engine_cannot_say_is_absent() -> None:
    """Without forces and orientation there are none in the result; with them they are there."""
    scene = load_scene("sphere_in_cylinder")
    times = np.linspace(0, 0.1, 3)
    motion = closed_form(rolling_ball(scene), times)
    assert motion is not None
    states = list(zip(motion.p_WB, motion.v_WB, motion.w_WB, motion.force, strict=True))
    silent = from_samples(scene, times, [Sample(p, v, w) for p, v, w, _ in states])
    assert not {"N", "F2", "F3", "needed_friction", "q_WB"} & set(silent.data_vars)
    q = np.array([1.0, 0, 0, 0])
    full = from_samples(scene, times, [Sample(p, v, w, q, f) for p, v, w, f in states])
    assert {"N", "F2", "F3", "needed_friction", "q_WB"} <= set(full.data_vars)
    assert full["q_WB"].dims == ("time", "wxyz")


def test_a_run_that_ended_early_has_fewer_times() -> None:
    """The time axis is as long as the samples."""
    scene = load_scene("sphere_in_cylinder")
    body = rolling_ball(scene)
    dataset = from_samples(scene, np.linspace(0, 1, 11), [Sample(body.p0, body.v0, body.w0)] * 2)
    assert dataset["time"].to_numpy() == pytest.approx([0, 0.1])


def test_netcdf_round_trip(tmp_path: Path) -> None:
    """A trajectory comes back from its file bit for bit, with units and error bars."""
    dataset = truth(load_scene("sphere_in_cylinder"), np.linspace(0, 0.1, 5)).assign_attrs(status="done")
    write(dataset, tmp_path / "new" / "run.nc")
    back = read(tmp_path / "new" / "run.nc")
    xr.testing.assert_identical(back, dataset)
    assert back["N"].attrs["error_bar"] == dataset["N"].attrs["error_bar"]
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["run.nc"]


def test_a_write_that_fails_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file is whole or not there: a failure halfway leaves the old one and no scraps."""
    path = tmp_path / "run.nc"
    dataset = truth(load_scene("inclined_plane"), np.linspace(0, 1, 3))
    write(dataset, path)
    before = path.read_bytes()

    def half(self: Path, content: bytes) -> None:
        with self.open("wb") as file:
            file.write(content[:100])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", half)
    with pytest.raises(ProofrollError, match="No space left on device"):
        write(dataset, path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_a_place_that_cannot_be_written(tmp_path: Path) -> None:
    """A folder that cannot be made gives one sentence."""
    (tmp_path / "file").write_text("")
    with pytest.raises(ProofrollError, match="cannot be written"):
        write(truth(load_scene("inclined_plane"), np.zeros(1)), tmp_path / "file" / "run.nc")


def test_a_dimension_without_entries_is_kept(tmp_path: Path) -> None:
    """A trajectory in which nothing happened, its attributes and its texts come back from the file as they were."""
    times = np.array([0.0, 0.1])
    dataset = xr.Dataset(
        {
            "event_kind": ("event", np.array([], dtype="<U7"), {"units": "1"}),
            "sticking": ("time", np.array([1, 0], dtype=np.int8), {"long_name": "größer"}),
        },
        coords={"time": ("time", times, {"units": "s"}), "xyz": ["x", "y", "z"]},
        attrs={"message": "", "wall_seconds": 0.5},
    )
    write(dataset, tmp_path / "x.nc")
    xr.testing.assert_identical(read(tmp_path / "x.nc"), dataset)


def test_others_read_the_same_from_the_file(tmp_path: Path) -> None:
    """The numbers in the file, as another reader of netCDF-3 finds them, are those of the dataset to the last bit."""
    dataset = truth(load_scene("sphere_in_cylinder", mu_static=0.15), np.linspace(0, 0.5, 11))
    write(dataset, tmp_path / "x.nc")
    with netcdf_file(tmp_path / "x.nc", mmap=False) as file:
        assert "event_kind" in file.variables
        for name, item in dataset.variables.items():
            if item.dtype.kind == "f":
                assert file.variables[name][...].astype(float).tobytes() == item.to_numpy().tobytes(), name
                assert file.variables[name].units == item.attrs["units"].encode()


def test_every_number_comes_back(tmp_path: Path) -> None:
    """The smallest, the largest and what is no number come back as they were, and truth values stay such."""
    values = np.array([5e-324, -0.0, 1.7976931348623157e308, np.nan, -np.inf, 0.1, 9.969209968386869e36])
    dataset = xr.Dataset({"x": ("time", values), "sticking": ("time", values > 0)}, attrs={"bar": 5e-324})
    write(dataset, tmp_path / "x.nc")
    found = read(tmp_path / "x.nc")
    assert found["x"].to_numpy().tobytes() == values.tobytes()
    assert found["sticking"].dtype == bool
    xr.testing.assert_identical(found, dataset)


def test_some_variables_are_read_as_all_are(tmp_path: Path) -> None:
    """A part of a file is what the whole has there, texts too; what the file has not is left out."""
    dataset = truth(load_scene("sphere_in_cylinder", mu_static=0.15), np.linspace(0, 0.5, 11))
    write(dataset, tmp_path / "x.nc")
    found = read_some(tmp_path / "x.nc", ["p_WB", "event_kind", "event_time", "absent"])
    assert found.keys() == {"p_WB", "event_kind", "event_time"}
    for name, values in found.items():
        assert values.tolist() == dataset[name].to_numpy().tolist()
        assert values.dtype.isnative
    write(dataset.isel(event=slice(0, 0)), tmp_path / "y.nc")
    assert read_some(tmp_path / "y.nc", ["event_kind"])["event_kind"].tolist() == []


def test_another_file_is_no_trajectory(tmp_path: Path) -> None:
    """What is no netCDF-3 says so in a line."""
    (tmp_path / "x.nc").write_bytes(b"something else")
    with pytest.raises(ValueError, match="is no netCDF-3"):
        read(tmp_path / "x.nc")
