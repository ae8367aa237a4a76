"""Changes of random scenes: simpler ones, such as differ in one thing, and such as have to move alike."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from proofroll.core.errors import ProofrollError
from proofroll.files.scene_file import load_scene
from proofroll_fuzz.drawing import Change, drawn_scene
from proofroll_fuzz.mechanisms.families import FAMILIES
from proofroll_fuzz.mechanisms.poses import PosesAtStart
from proofroll_fuzz.mechanisms.smaller import remove, rounded
from proofroll_fuzz.relations import write_scene


def drawn(family: str, seed: int = 0) -> dict[str, Any]:
    """Tables of a random scene."""
    return dict(drawn_scene({family: FAMILIES[family]}, seed).tables)


def changed(tables: Mapping[str, Any], change: Change) -> dict[str, Any] | None:
    """A changed copy; None where the change does not apply."""
    copy = deepcopy(dict(tables))
    try:
        change(copy)
    except (LookupError, StopIteration):
        return None
    return copy


def is_valid(folder: Path, tables: Mapping[str, Any]) -> bool:
    """True if the reader accepts a scene."""
    write_scene(folder, tables)
    try:
        load_scene(str(folder))
    except ProofrollError:
        return False
    return True


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.drill_of("loop")
@pytest.mark.parametrize("family", FAMILIES)
def test_changes_apply_or_are_refused_in_words(family: str, tmp_path: Path) -> None:
    """Each change leads to a scene that the reader accepts, or refuses with its own error; most are accepted."""
    tables, before = drawn(family), deepcopy(drawn(family))
    candidates = [changed(tables, change) for change in list(FAMILIES[family].smaller(tables))[::2]]
    candidates += [changed(tables, change) for _, change in FAMILIES[family].nearest(tables)][::8]
    assert tables == before
    accepted = [is_valid(tmp_path, candidate) for candidate in candidates if candidate is not None]
    assert sum(accepted) > len(accepted) / 2


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(("family", "seed"), [("loop", 0), ("contact", 2), ("contact", 5)])
def test_rounded_lengths_fit_again(family: str, seed: int, tmp_path: Path) -> None:
    """Rounding opens a loop without dependent joints, or presses bodies together; closing makes it valid."""
    tables = next(
        tables
        for tables in (drawn(family, number) for number in range(seed, seed + 40))
        if not any("dependent" in row for row in tables["joints"])
    )
    valid = []
    for change in FAMILIES[family].smaller(tables):
        candidate = changed(tables, change)
        if getattr(change, "keywords", {}).get("digits") and candidate and not is_valid(tmp_path, candidate):
            FAMILIES[family].close(candidate, tables)
            valid.append(is_valid(tmp_path, candidate))
    assert any(valid)


def test_a_body_goes_with_all_that_hangs_on_it() -> None:
    """Without a body its joint and laws are gone; without loops no joint is dependent; some body is left."""
    tables = drawn("bar")
    remove(tables, {"rod"})
    assert [row["name"] for row in tables["bodies"]] == ["crank", "output"]
    assert [row["child"] for row in tables["joints"]] == ["crank", "output"]
    assert "loops" not in tables
    assert not any("dependent" in row for row in tables["joints"])
    with pytest.raises(LookupError):
        remove(tables, {"crank", "output"})


def test_numbers_of_formulas_are_rounded() -> None:
    """Digits of a formula's numbers are cut; its words and exponents are not."""
    assert rounded("= 0.1234*cos(2.345*t)^3", 2) == "= 0.12*cos(2.3*t)^3"
    assert rounded(1234.0, 1) == 1000.0
    assert rounded("revolute", 1) == "revolute"
    assert rounded(True, 1) is True


@pytest.mark.one_in(2)
@pytest.mark.parametrize("family", FAMILIES)
def test_a_turned_scene_is_valid_and_turns_all_bodies_alike(family: str, tmp_path: Path) -> None:
    """Every body of a turned scene is turned and shifted by the same amount."""
    for seed in range(6):
        tables = drawn(family, seed)
        turned = deepcopy(tables)
        FAMILIES[family].relations["turned"].change(turned, {})
        assert is_valid(tmp_path, turned)
        first, second = PosesAtStart.of(tables), PosesAtStart.of(turned)
        turns = [second.rotation(row["name"]) @ first.rotation(row["name"]).T for row in tables["bodies"]]
        shifts = [
            second.place(row["name"]) - R @ first.place(row["name"])
            for row, R in zip(tables["bodies"], turns, strict=True)
        ]
        assert max(np.abs(R - turns[0]).max() for R in turns) < 1e-12
        size = max(np.abs(first.place(row["name"])).max() for row in tables["bodies"])
        assert max(np.abs(shift - shifts[0]).max() for shift in shifts) < 1e-12 * max(size, 1)
