"""Drawings show a scene's own surface with its symbols."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from proofroll.files.json_data import plain
from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.report.drawings import overview
from proofroll.report.pen import Drawing, View, circle, turn


def drawn(scene: str, **parameters: float) -> list[dict[str, Any]]:
    """The drawings of a scene as plain data."""
    body = rolling_ball(load_scene(scene, **parameters))
    return [plain(item.picture("")) for item in overview(body.wall, body)]


def letters(drawing: dict[str, Any]) -> list[str]:
    """All texts of a drawing, an index after its letter."""
    return ["".join(part["text"] for part in mark["parts"]) for mark in drawing["marks"] if "parts" in mark]


def places(mark: dict[str, Any]) -> np.ndarray[Any, Any]:
    """Where a mark is, shape (n, 2): the corners of a line, the ends of a circle, the middle of a text."""
    if "points" in mark:
        return np.array(mark["points"])
    if "centre" in mark:
        return np.array([np.add(mark["centre"], mark["radius"]), np.subtract(mark["centre"], mark["radius"])])
    return np.array([[mark["x"], mark["y"]]])


@pytest.mark.parametrize(
    ("scene", "wanted"),
    [
        ("sphere_in_cylinder", {"a", "b", "c = b − a", "γ", "z", "V0", "g"}),
    ],
)
def test_every_symbol_of_the_scene_is_in_its_drawing(scene: str, wanted: set[str]) -> None:
    """The whole has the symbols of its geometry, the contact the local frame, the spins and the forces."""
    whole, contact = drawn(scene, rolling_resistance=5e-4)
    assert wanted <= set(letters(whole))
    assert {"a", "e1", "e2", "e3", "ω1", "ω2", "ω3", "N", "F2", "F3", "f"} == set(letters(contact))


def test_what_is_not_there_is_not_drawn() -> None:
    """No arm of rolling resistance without rolling resistance, no arrow of gravity without gravity."""
    assert "f" not in letters(drawn("sphere_in_cylinder")[1])
    assert "g" not in letters(drawn("sphere_in_cylinder", gravity=0.0)[0])


def test_the_ball_is_drawn_to_the_scale_of_its_wall() -> None:
    """A ball of half the cylinder's radius has half the rim's width; the proportions are the parameters'."""
    for radius in (0.025, 0.1):
        marks = drawn("sphere_in_cylinder", radius=radius)[0]["marks"]
        rim = places(next(mark for mark in marks if mark["look"] == "wall"))
        ball = next(mark for mark in marks if mark["look"] == "ball")
        assert 2 * ball["radius"] / np.ptp(rim[:, 0]) == pytest.approx(radius / 0.225, rel=0.02)


@pytest.mark.parametrize(
    ("scene", "parameters"),
    [
        ("sphere_in_cylinder", {"radius": 1e-6}),
        ("sphere_in_cylinder", {"radius": 0.224}),
        ("sphere_in_cylinder", {"cylinder_radius": 1e3}),
    ],
)
def test_any_parameters_give_a_picture_that_holds_all_its_marks(scene: str, parameters: dict[str, float]) -> None:
    """Every number is finite, every mark inside the box, and the box has a size that can be looked at."""
    for drawing in drawn(scene, **parameters):
        x, y, width, height = drawing["box"]
        assert 100 < width < 700
        assert 60 < height < 700
        for mark in drawing["marks"]:
            corners = places(mark)
            assert corners.size
            assert np.all(np.isfinite(corners))
            assert np.all(corners >= [x, y])
            assert np.all(corners <= [x + width, y + height])


def test_indices_are_told_from_letters() -> None:
    """What follows a low line is an index, one character long."""
    drawing = Drawing()
    drawing.text((1.0, 2.0), "F_2 = 0")
    assert plain(drawing.marks)[0]["parts"] == [
        {"text": "F", "sub": False}, {"text": "2", "sub": True}, {"text": " = 0", "sub": False},
    ]  # fmt: skip


def test_a_view_keeps_lengths_across_it_and_hides_those_along_it() -> None:
    """A circle seen along its axis is round; seen from its plane it is a line."""
    ring = circle(np.zeros(3), (1, 0, 0), (0, 1, 0), turn(0, 2 * np.pi))
    above = View((0, 0, 1), (0, 1, 0), 10.0)(ring)
    assert np.linalg.norm(above, axis=1) == pytest.approx(10.0)
    beside = View((0, -1, 0), (0, 0, 1), 10.0)(ring)
    assert np.ptp(beside[:, 1]) == pytest.approx(0.0, abs=1e-12)
    assert np.ptp(beside[:, 0]) == pytest.approx(20.0)
