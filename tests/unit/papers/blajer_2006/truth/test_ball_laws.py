"""Law check of a ball that rolls evenly."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from proofroll.core.arrays import FloatArray
from proofroll.core.dataset import ENDS, LAWS
from proofroll.core.errors import Refused
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.ball.mechanics import BallMotion
from proofroll.papers.blajer_2006.ball.rolling_equations import closed_form
from proofroll.papers.blajer_2006.truth import ball_laws

TIMES = np.linspace(0.0, 2.0, 21)
FAULTS: dict[str, tuple[Callable[[BallMotion], BallMotion], str]] = {
    "force": (lambda motion: replace(motion, force=1.000001 * motion.force), "momentum"),
    "spin": (lambda motion: replace(motion, w_WB=1.000001 * motion.w_WB), "does not slip"),
    "place": (lambda motion: replace(motion, p_WB=motion.p_WB + [0.0, 0.0, 1e-6] * motion.v_WB), "place"),
}


def test_an_even_rolling_holds_all_laws(scene: Scene) -> None:
    """Every truth of a ball says so, whatever its start and its resistance, and with a residual far from the limit."""
    laws = str(truth(scene, TIMES).attrs[LAWS])
    assert laws.startswith("holds 1")
    assert float(laws.split("largest residual ")[1].split(maxsplit=1)[0]) < 0.1


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_that_both_routes_share_is_refused(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A millionth suffices, though the routes agree to the last digit; the message names the law."""
    fault, law = FAULTS[name]
    kept = ball_laws._at
    monkeypatch.setattr(ball_laws, "_at", lambda motion, index: fault(kept(motion, index)))
    with pytest.raises(Refused, match=rf"breaks the law \".*{law}"):
        truth(load_scene("sphere_in_cylinder", rolling_resistance=5e-4), TIMES)


@pytest.fixture
def wrong_from_a_second_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """Forces that both routes state a thousandth too large from 1 s on."""
    honest = ball_laws._pieces

    def pieces_of(*arguments: object) -> ball_laws.Pieces:
        pieces = honest(*arguments)  # type: ignore[arg-type] -- passed on as they come
        return replace(pieces, force=np.where(pieces.time[..., None, None] < 1.0, 1.0, 1.001) * pieces.force)

    monkeypatch.setattr(ball_laws, "_pieces", pieces_of)


@pytest.mark.usefixtures("wrong_from_a_second_on")
def test_values_before_a_violation_are_kept() -> None:
    """Where a route goes wrong at 1 s, samples before are there, and the end is at the first piece that shows it."""
    dataset = truth(load_scene("sphere_in_cylinder"), TIMES)
    assert 1.0 <= dataset.attrs[ENDS] < 1.3
    assert dataset["time"].to_numpy().tolist() == TIMES[dataset.attrs[ENDS] > TIMES].tolist()


def test_orientations_follow_the_spin() -> None:
    """About a fixed axis they are those of the angle, to round-off."""
    spin, pace = np.zeros((1, ball_laws.COUNT, 3)), np.full((1, ball_laws.COUNT), 0.25)
    spin[..., 2] = 2.0
    turned = ball_laws._orientation(spin, pace)[0]
    angles: FloatArray = 0.5 * (ball_laws.POINTS + 1)
    assert turned[:, 1, 0] == pytest.approx(np.sin(angles), abs=1e-15)


def test_a_long_motion_is_looked_at_where_times_have_digits(monkeypatch: pytest.MonkeyPatch) -> None:
    """In 100,000 s a ball turns so often that the rounding of the time alone would break a law at the end."""
    scene = load_scene("sphere_in_cylinder")
    times = np.array([0.0, 5e4, 1e5])
    given = scene.elements[0], rolling_ball(scene), closed_form, times
    motion, residuals = ball_laws.checked_motion(*given, coarse=False)
    assert len(motion.p_WB) == len(times)
    assert residuals.first is None
    monkeypatch.setattr(ball_laws, "_SPAN", np.inf)
    assert ball_laws.checked_motion(*given, coarse=False)[1].first is not None


@pytest.mark.nightly
@pytest.mark.usefixtures("wrong_from_a_second_on")
def test_with_its_orientation_a_violation_still_ends_the_truth() -> None:
    """The general truth, which knows no end, adds the orientation up to that end and no line that says laws hold."""
    dataset = truth(load_scene("sphere_in_cylinder").fully_asked, TIMES)
    assert 1.0 <= dataset.attrs[ENDS] < 1.3
    assert len(dataset["q_WB"]) == len(dataset["time"]) < len(TIMES)
    assert LAWS not in dataset.attrs
