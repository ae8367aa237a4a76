"""Files that claim something of a trade-off."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from invented import invented_budget, invented_study, measured_point

from proofroll.core.errors import InputError
from proofroll.files.comparison_file import comparison_names, load_comparison
from proofroll.files.data_folders import data_folder
from proofroll.running.case import Status
from proofroll.running.timing import FACTOR
from proofroll.studies.tradeoff.claims import claims_for, load_claims
from proofroll.studies.tradeoff.records import DroppedStep, TradeoffStudy

TEXT = """
study = "tradeoff"
title = "A claim"
question = "Which?"
scene = "sphere_in_cylinder"
until = 1.0
quantity = "z"

[over]
speed = [3, 5]

[[cheapest]]
tolerance = "1e-3 m"
engine = "fast[formulation=only]"
because = "it takes long steps"
"""


def written(tmp_path: Path, text: str = TEXT) -> Path:
    """The file."""
    path = tmp_path / "made.toml"
    path.write_text(text)
    return path


STEADY = (1.0, 1.01, 0.99, 1.0, 1.02, 0.98)


def measured(cost_of_fast: float, rounds: tuple[float, ...] = STEADY, **more: Any) -> TradeoffStudy:
    """Two points that hold the tolerance; ``rounds`` are those of the slower one, and slow the faster one as well."""
    points = [
        measured_point(
            id=number,
            engine=engine,
            level=None,
            seconds_per_second=cost,
            interval=(cost, cost),
            rounds=[cost * value for value in rounds],
            corners=[],
        )
        for number, (engine, cost) in enumerate({"fast": cost_of_fast, "slow": 1.0}.items())
    ]
    return invented_study(*points, **more)


def test_a_claim_is_held_against_the_points(tmp_path: Path) -> None:
    """Where the claimed engine is the cheapest there is no contradiction; where it is far from it, there is one."""
    claims = load_claims(written(tmp_path))
    assert claims.contradictions(measured(0.1)) == claims.undecided(measured(0.1)) == []
    (sentence,) = claims.contradictions(measured(10.0))
    assert "fast only at 0.001 takes 10 times as long as slow only at 0.001" in sentence
    study = measured(0.1)
    off = replace(study.points[0], error={"z": 1e-2}, envelope={"z": 1e-2})
    study = replace(study, points=[off, study.points[1]])
    assert "no step of it holds that" in claims.contradictions(study)[0]


def test_a_cost_that_is_not_clearly_higher_leaves_a_claim_undecided(tmp_path: Path) -> None:
    """Two steps of the sweep apart or less, too few rounds, or a brief study: nothing contradicts, and that is said."""
    claims = load_claims(written(tmp_path))
    noisy = (1.0, 5.0, 0.2, 1.0, 9.0, 0.1)
    for study in (
        measured(1.04),
        measured(FACTOR - 0.01),
        measured(10.0, STEADY[:3]),
        measured(10.0, STEADY, brief=True),
        replace(measured(10.0), points=measured(10.0).points[1:]),
    ):
        assert claims.contradictions(study) == []
        assert "undecided" in claims.undecided(study)[0]
    # What slows a round slows both, so that noise alone decides nothing and hides nothing.
    assert claims.contradictions(measured(10.0, noisy)) != []
    assert claims.contradictions(measured(0.1, noisy)) == []


def test_costs_within_each_others_noise_contradict_nothing(tmp_path: Path) -> None:
    """Two costs whose rounds overlap, 4.3 (4.2 to 4.7) against 4.5 (3.8 to 4.6) in ms, are undecided."""
    study = measured(1.0)
    study.points[0].rounds[:] = [4.47e-3, 3.79e-3, 4.59e-3, 4.5e-3, 4.4e-3, 4.3e-3]
    study.points[1].rounds[:] = [4.30e-3, 4.24e-3, 4.68e-3, 4.3e-3, 4.3e-3, 4.25e-3]
    claims = load_claims(written(tmp_path))
    assert claims.contradictions(study) == []
    assert len(claims.undecided(study)) == 1


EXACT = """
[[holds]]
engine = "fast"
tolerance = "1e-3 m"
step = 1e-3
because = "it is stable there"

[[converges]]
engine = "fast"
order = [1.9, 2.1]
because = "its rule has order 2"
"""


def test_steps_and_orders_are_judged_exactly_in_a_brief_study_too(tmp_path: Path) -> None:
    """The coarsest step that holds and the order hang on no clock: another one is a contradiction, however timed."""
    claims = load_claims(written(tmp_path, TEXT + EXACT))
    budget = invented_budget(curve="fast[formulation=only]", order=2.0, order_low=1.97, order_high=2.03)
    study = measured(0.1, (1.0,), brief=True, budgets=[budget])
    first = study.points[0]
    assert claims.contradictions(study) == []
    coarser = [replace(first, step=2e-3, id=9, rounds=[]), *study.points]
    (sentence,) = claims.contradictions(replace(study, points=coarser))
    assert "the coarsest that does is 0.002" in sentence
    (sentence,) = claims.contradictions(replace(study, budgets=[replace(budget, order_low=0.9, order_high=1.1)]))
    assert "what shows is 0.9 to 1.1" in sentence
    late = [replace(first, status=Status.TIMEOUT, id=9), *study.points]
    assert claims.contradictions(replace(study, points=late)) == []


def test_steps_that_a_brief_study_leaves_out_contradict_nothing(tmp_path: Path) -> None:
    """No step that holds, no order and no cheapest engine: undecided with the reason where steps were left out."""
    claims = load_claims(written(tmp_path, TEXT + EXACT))
    study = measured(0.1, (1.0,), brief=True)
    off = replace(study.points[0], error={"z": 1e-2}, envelope={"z": 1e-2})
    study = replace(study, points=[off, study.points[1]])
    assert len(claims.contradictions(study)) == 3
    study = replace(study, dropped=[DroppedStep(off.curve, 1e-4, "it would take too long")])
    assert claims.contradictions(study) == []
    assert sum("it would take too long" in sentence for sentence in claims.undecided(study)) == 3
    assert len(claims.contradictions(replace(study, brief=False))) == 3


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('study = "tradeoff"', 'study = "other"', "study"),
        ('quantity = "z"', 'quantity = "y"', "choose from gamma, z"),
        ('"1e-3 m"', '"1e-3 N"', "its unit is m"),
        ('"1e-3 m"', '"soon"', "cheapest.0.tolerance"),
        ('because = "it takes long steps"', 'because = ""', "needs its reason"),
        ("speed = [3, 5]", "speed = [0, 5]", "speed"),
        ("speed = [3, 5]", "haste = [3, 5]", "haste"),
        ("until = 1.0", "until = 1.0\nwheels = 4", "wheels"),
        ('scene = "sphere_in_cylinder"', 'scene = "nowhere"', "there is no such scene"),
        (TEXT[TEXT.index("[[cheapest]]") :] + EXACT, "", "claims nothing"),
        ('title = "A claim"', "title = A claim", "the file is broken"),
        ("fast[formulation=only]", "= mass < 1", "cheapest.0: engine = '= mass < 1': write name"),
        ("step = 1e-3", "step = 0", "holds.0.step = 0.0: the value must be above 0"),
        ("order = [1.9, 2.1]", "order = [nan, 2]", r"converges.0.order = \[nan, 2.0\]: write \[low, high\]"),
    ],
)
def test_a_broken_file_is_one_line(tmp_path: Path, old: str, new: str, words: str) -> None:
    """Every mistake is one line that names where it is."""
    whole = TEXT + EXACT
    assert old in whole
    with pytest.raises(InputError, match=words) as raised:
        load_claims(written(tmp_path, whole.replace(old, new)))
    assert "\n" not in str(raised.value)


def test_the_founding_scene_has_claims() -> None:
    """The file of the founding scene is found by its name, and is not taken for a comparison."""
    claims = claims_for("sphere_in_cylinder")
    assert claims is not None
    assert claims.name not in comparison_names()
    assert claims_for("inclined_plane") is None
    with pytest.raises(InputError, match="proofroll tradeoff sphere_in_cylinder"):
        load_comparison(str(data_folder("comparisons") / f"{claims.name}.toml"))
