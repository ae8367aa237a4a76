"""The part of a report about a trade-off."""

from __future__ import annotations

from pathlib import Path

import pytest
from invented import invented_study, measured_point

from proofroll.report.tradeoff.part import TradeoffPart
from proofroll.studies.tradeoff import curve

FILE = Path(__file__).parents[4] / "comparisons" / "tradeoff.toml"


def test_no_scene_is_loaded_after_judging(monkeypatch: pytest.MonkeyPatch) -> None:
    """The lines of a study take the scene that its claims were read with."""
    part = TradeoffPart.load(FILE, ())
    part.study = invented_study(measured_point(error={"z": 1e-3}))

    def refused(*_: object, **__: object) -> None:
        raise AssertionError("a scene is loaded again")

    monkeypatch.setattr(curve, "load_scene", refused)
    (line,) = part.lines()
    assert (line.quantity, line.unit, line.headline) == ("z", "m", True)
