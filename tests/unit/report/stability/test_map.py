"""The map of stability as a table: what its cells say and look like, and a sentence for each engine."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest
from invented import boundary_point, stability_study

from proofroll.core.engine_abilities import Level
from proofroll.core.verdict import Verdict
from proofroll.report.stability.map import cell, heat_map


@pytest.mark.parametrize(
    ("facts", "said"),
    [
        ({"largest_accurate": 1e-2, "period": 0.64}, ("64", Verdict.AGREES)),
        ({"largest_accurate": 1e-3, "period": 0.7777}, ("780", Verdict.CONVERGES)),
        ({"largest_accurate": 0.1, "resolution": "rtol"}, ("0.1", Verdict.AGREES)),
        ({"largest_accurate": None}, ("–", Verdict.DIFFERS)),
        ({"largest_accurate": None, "failure": "refused"}, ("⊘", Verdict.REFUSED)),
        ({"largest_accurate": None, "problem": "chaos"}, ("?", Verdict.NOT_JUDGED)),
    ],
)
def test_a_cell_has_the_steps_per_natural_time(facts: dict[str, Any], said: tuple[str, str]) -> None:
    """Steps that are right, or the tolerance; many are dear; none, a refusal and a missing truth have signs."""
    assert cell(dataclasses.replace(boundary_point(), **facts)) == said


def test_an_engine_has_one_sentence_with_its_settings_alike_ones_together() -> None:
    """It counts places that are right and limits that are passed silently; equations by hand have no row."""
    study = stability_study()
    silent, held = study.points
    other = [dataclasses.replace(point, curve="other") for point in study.points]
    hand = dataclasses.replace(held, engine="hand", curve="hand", level=Level.REDUCED)
    found = heat_map(dataclasses.replace(study, points=[silent, held, *other, hand]))
    assert list(found.groups) == list(found.sentences) == [silent.engine]
    (sentence,) = found.sentences.values()
    names = ", ".join(name for name, _ in found.groups[silent.engine])
    assert sentence == f"{names} right at 1 of 2 places; wrong without a warning beyond 2 of 4 limits."
    everywhere = dataclasses.replace(held, failure="", value=4.0)
    (sentence,) = heat_map(dataclasses.replace(study, points=[held, everywhere])).sentences.values()
    assert sentence.endswith("right everywhere; never wrong without a warning.")
