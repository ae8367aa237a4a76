"""Files that claim something of a trade-off."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from proofroll.core.errors import InputError
from proofroll.files.comparison_file import comparison_names, load_comparison
from proofroll.files.data_folders import data_folder
from proofroll.studies.claims import claims_for, load_claims

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


def measured(cost_of_fast: float) -> dict[str, Any]:
    """Two points that hold the tolerance."""
    points = []
    for number, (engine, cost) in enumerate({"fast": cost_of_fast, "slow": 1.0}.items()):
        points.append(
            {
                "id": number,
                "engine": engine,
                "curve": engine,
                "level": None,
                "settings": {"formulation": "only"},
                "resolution": "dt",
                "step": 1e-3,
                "message": "",
                "error": {"z": 1e-5},
                "envelope": {"z": 1e-5},
                "seconds_per_second": cost,
                "interval": [cost, cost],
                "corners": [],
            }
        )
    return {
        "scene": "sphere_in_cylinder",
        "parameters": {},
        "until": 1.0,
        "quantities": {"z": {"unit": "m", "scale": 0.1, "truth_error_bar": 1e-13}},
        "points": points,
        "budgets": [],
        "over": {},
        "absent": {},
        "measured": {},
    }


def test_a_claim_is_held_against_the_points(tmp_path: Path) -> None:
    """Where the claimed engine is the cheapest there is no contradiction; where it is not, one sentence says so."""
    claims = load_claims(written(tmp_path))
    assert claims.contradictions(measured(0.1)) == []
    (sentence,) = claims.contradictions(measured(10.0))
    assert "the cheapest is slow only, expected: fast[formulation=only]" in sentence
    nothing = claims.contradictions(measured(0.1) | {"points": []})
    assert "nothing holds it" in nothing[0]


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
        ('scene = "sphere_in_cylinder"', 'scene = "cone"', "there is no such scene"),
        (TEXT[TEXT.index("[[cheapest]]") :], "", "claims nothing"),
        ('title = "A claim"', "title = A claim", "the file is broken"),
    ],
)
def test_a_broken_file_is_one_line(tmp_path: Path, old: str, new: str, words: str) -> None:
    """Every mistake is one line that names where it is."""
    assert old in TEXT
    with pytest.raises(InputError, match=words) as raised:
        load_claims(written(tmp_path, TEXT.replace(old, new)))
    assert "\n" not in str(raised.value)


def test_the_founding_scene_has_claims() -> None:
    """The file of the founding scene is found by its name, and is not taken for a comparison."""
    claims = claims_for("sphere_in_cylinder")
    assert claims is not None
    assert claims.name not in comparison_names()
    assert claims_for("inclined_plane") is None
    with pytest.raises(InputError, match="proofroll tradeoff sphere_in_cylinder"):
        load_comparison(str(data_folder("comparisons") / f"{claims.name}.toml"))
