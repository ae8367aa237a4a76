"""One tolerance at every door: its forms, and what each bounds."""

from __future__ import annotations

import pytest

from proofroll.core.comparison import Tolerance
from proofroll.core.errors import InputError
from proofroll.files.scene_file import load_scene
from proofroll.studies.judging.asked_tolerance import AskedTolerance, judged_names, orientations_of

SCENE = load_scene("double_pendulum")


@pytest.mark.parametrize(
    ("text", "bound"),
    [
        ("1e-4", Tolerance(1e-4, True)),
        ("1e-4 of path", Tolerance(1e-4, True)),
        ("1e-4 of the path", Tolerance(1e-4, True)),
        ("0.1 %", Tolerance(1e-3, True)),
        ("1 mm", Tolerance(1e-3, False, "m")),
        ("2e-3 m", Tolerance(2e-3, False, "m")),
    ],
)
def test_a_tolerance_without_a_name_bounds_every_place(text: str, bound: Tolerance) -> None:
    """A part, a percentage or a length bounds the motion in summaries and the place of every body."""
    asked = AskedTolerance.of([text], SCENE)
    assert set(asked.bounds) == {"positions", "p_WB"}
    for found in asked.bounds.values():
        assert found.value == pytest.approx(bound.value)
        assert (found.relative, found.unit) == (bound.relative, bound.unit)


def test_a_name_bounds_one_quantity_in_its_own_unit() -> None:
    """``name=value`` bounds that quantity alone; several are bounded together."""
    asked = AskedTolerance.of(["q.elbow=1e-3 rad", "positions=1 mm"], SCENE)
    assert asked.bounds == {"q.elbow": Tolerance(1e-3, False, "rad"), "positions": Tolerance(1e-3, False, "m")}
    assert not asked.relative


def test_forces_count_where_they_are_asked_for() -> None:
    """A part bounds the reactions, too, with forces; a length bounds none."""
    assert "forces" in AskedTolerance.of(["1e-4"], SCENE, forces=True).bounds
    assert "forces" not in AskedTolerance.of(["1e-4"], SCENE).bounds
    assert "forces" not in AskedTolerance.of(["1 mm"], SCENE, forces=True).bounds


@pytest.mark.parametrize("text", ["1 kg", "much", "-1e-4", "positions=1 kg", "nothing=1 mm", "0"])
def test_another_form_is_refused(text: str) -> None:
    """Another unit, sign, word or quantity is refused with one sentence."""
    with pytest.raises(InputError):
        AskedTolerance.of([text], SCENE)


@pytest.mark.parametrize("text", ["0", "0 %", "0 mm", "1e400"])
def test_a_tolerance_of_nothing_is_named_as_it_was_written(text: str) -> None:
    """The one line has the field, what was given and that it lies above 0, whatever unit it was read in."""
    with pytest.raises(InputError, match=rf"^tolerance = '{text}': write 1e-4 of .* above 0; judged here are"):
        AskedTolerance.of([text], SCENE)


def test_attitudes_are_bounded_by_a_tolerance_of_their_own() -> None:
    """A tolerance of lengths bounds no attitude, and that is known; a tolerance of its own bounds it."""
    assert orientations_of(SCENE, judged_names(SCENE)) == ["attitudes"]
    assert orientations_of(SCENE, AskedTolerance.of(["1 mm", "attitudes=1e-3"], SCENE).bounds) == []
