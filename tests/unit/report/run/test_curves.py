"""Curves of a run as panels of a page."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from proofroll.report.run.curves import CurvePanel, curves_alone


def panel(values: np.ndarray) -> CurvePanel:
    """Panel of a run with these values."""
    times = np.linspace(0.0, 1.0, len(values))
    return curves_alone(xr.Dataset({"z": ("time", values, {"units": "m"})}, {"time": times}))[0]


def drawn(curve: CurvePanel) -> np.ndarray:
    """Places of the curve."""
    return np.array([[float(number) for number in place.split(",")] for place in curve.run.split()])


def test_no_peak_is_lost() -> None:
    """Of many samples a peak of one sample is drawn at its height, and the curve has few places."""
    values = np.zeros(100_001)
    values[77_777] = 5.0
    curve = panel(values)
    places = drawn(curve)
    assert len(places) <= 402
    assert places[:, 1].min() == pytest.approx(100 * 0.06 / 1.12, abs=0.1)
    assert places[places[:, 1].argmin(), 0] == pytest.approx(777.8, abs=0.1)
    assert (curve.low, curve.high) == ("0", "5")


def test_what_is_constant_or_missing_is_drawn() -> None:
    """A constant lies in the middle, and samples without a value are left out."""
    places = drawn(panel(np.array([2.0, np.nan, 2.0, 2.0])))
    assert places[:, 1] == pytest.approx(50.0)
    assert places[:, 0] == pytest.approx([0.0, 666.7, 1000.0], abs=0.1)
