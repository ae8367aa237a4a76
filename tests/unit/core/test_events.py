from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from proofroll.core.events import Event, events_of, with_events
from proofroll.files.trajectory_file import read, write

EVENTS = [Event("slip", 1.0, 0.9, 1.1), Event("stick", 2.0, 2.0, 2.0), Event("lift_off", 3.0, 2.5, 3.5)]


@pytest.mark.parametrize("events", [EVENTS, []], ids=["three", "none"])
def test_events_survive_a_file(tmp_path: Path, events: list[Event]) -> None:
    """Events that go into a dataset and a netCDF file come out of it as they were, also when there are none."""
    dataset = xr.Dataset(coords={"time": ("time", np.arange(3.0))})
    write(with_events(dataset, events), tmp_path / "run.nc")
    assert events_of(read(tmp_path / "run.nc")) == events


def test_no_variables_no_events() -> None:
    """A trajectory without event variables has no events."""
    assert events_of(xr.Dataset()) == []
