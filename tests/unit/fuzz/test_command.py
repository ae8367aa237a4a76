"""Seeds of the command ``fuzz``."""

from __future__ import annotations

from collections.abc import Callable
from datetime import date, timedelta
from itertools import pairwise

import pytest

from proofroll_fuzz.command import seed_of

# More scenes than a night has.
_NIGHT = 10_000


def test_nights_have_no_scene_in_common() -> None:
    """Seeds of a year's dates lie further apart than a night draws scenes, and are the same everywhere."""
    seeds = sorted(seed_of((date(2026, 11, 29) + timedelta(days=day)).isoformat()) for day in range(365))
    assert min(after - before for before, after in pairwise(seeds)) > _NIGHT
    assert seed_of("2026-11-29") == 575535891297


def test_a_number_is_a_seed_itself() -> None:
    """The seed that a hunt prints repeats it."""
    assert seed_of("20261129") == 20261129


@pytest.mark.parametrize("seed", ["yesterday", "-3", "1.5", "2026-13-01"])
def test_other_seeds_are_refused(seed: str, command_line: Callable[..., tuple[int, str, str]]) -> None:
    """Text that is neither a number nor a date is one line that says so."""
    code, out, err = command_line("fuzz", "truth", f"--seed={seed}")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert f"--seed = {seed!r}: must be a whole number from 0 on, or a date" in err
