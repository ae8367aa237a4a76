"""A case in its process: what a truth is kept as."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from proofroll.core import truth
from proofroll.core.dataset import ended_at
from proofroll.files import scene_sources
from proofroll.running import run_case
from proofroll.running.case import Case


class Source:
    """Reader that sees a touch at the third sample."""

    @staticmethod
    def until_met(path: Path, scene: Any, motion: Any) -> Any:
        """See the protocol."""
        assert (path, scene.name) == (Path("there.xml"), "sphere_in_cylinder")
        return ended_at(motion, 2, "knee and floor touch")


def test_a_truth_ends_where_the_reader_of_its_scene_sees_a_touch(
    monkeypatch: pytest.MonkeyPatch, make_case: Callable[..., Case], tmp_path: Path
) -> None:
    """Samples from a touch on that a scene of a file has no pair for are not kept, and the message says why."""
    case, times = make_case("truth", every=0.02), 0.02 * np.arange(6)
    true = xr.Dataset({"x": ("time", times)}, {"time": times}, {"route": "one", "second_route": "another"})
    monkeypatch.setattr(truth, "truth", lambda *_: true)
    whole = run_case.run(asdict(case), str(tmp_path / "whole.npz"))
    monkeypatch.setattr(scene_sources, "source_of", lambda _: (Source(), Path("there.xml")))
    cut = run_case.run(asdict(case), str(tmp_path / "cut.npz"))
    assert whole["message"] == "one, checked by another"
    assert cut["message"] == "the truth ends at t = 0.04 s, behind its 2 samples: knee and floor touch"
