"""The part of a report about a trade-off."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from invented import boundary_point, invented_study, measured_point, timed

from proofroll.report.labels import name_of
from proofroll.report.long_table import TableLine
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


CONES = ("engine[formulation=free,preset=matched,cone=pyramidal]", "engine[formulation=free,preset=matched]")


def lines_of(**errors: list[float]) -> list[TableLine]:
    """Lines of a trade-off with these errors of z along its curves, at 1e-3 s and ever half of it."""
    part = TradeoffPart.load(FILE, ())
    curves = [(curve, settings(curve), errors) for curve, errors in zip(CONES, errors.values(), strict=False)]
    points = [
        measured_point(
            id=10 * number + place, engine="engine", curve=curve, settings=chosen, step=chosen["dt"] / 2**place,
            error={"z": error}, envelope={"z": max(errors[place:])}, **timed(0.1 * 2**place),
        )
        for number, (curve, chosen, errors) in enumerate(curves)
        for place, error in enumerate(errors)
    ]  # fmt: skip
    points = [replace(point, settings=point.settings | {"dt": point.step}) for point in points]
    part.study = invented_study(*points)
    return part.lines()


def settings(curve: str) -> dict[str, Any]:
    """Complete settings of a curve."""
    return {"formulation": "free", "preset": "matched", "dt": 1e-3, "cone": "pyramidal" if "cone" in curve else "e"}


def test_an_option_of_an_engine_is_part_of_its_setting() -> None:
    """Settings that differ by an option alone are two in the table and in every name."""
    lines = lines_of(pyramidal=[1e-5], elliptic=[2e-5])
    assert [line.setting for line in lines] == ["cone=pyramidal", "matched"]
    points = [boundary_point(engine="engine", curve=curve, settings=settings(curve)) for curve in CONES]
    assert [name_of(point) for point in points] == ["engine free, cone=pyramidal", "engine free, matched"]


def test_a_line_has_the_error_of_its_run_and_the_number_of_its_curve() -> None:
    """The error is the run's own, though finer runs are worse."""
    lines = lines_of(one=[1e-6, 2e-3, 1e-7], other=[1e-4, 1e-5])
    assert [(line.row, line.step, line.error) for line in lines] == [
        (0, 1e-3, 1e-6), (0, 5e-4, 2e-3), (0, 2.5e-4, 1e-7), (1, 1e-3, 1e-4), (1, 5e-4, 1e-5),
    ]  # fmt: skip
