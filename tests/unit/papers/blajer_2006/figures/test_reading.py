"""Files that define figures."""

from __future__ import annotations

from pathlib import Path

import pytest

from proofroll.core.errors import InputError
from proofroll.files.comparison_file import comparison_names, load_comparison
from proofroll.papers.blajer_2006.figures.judging import rounds_to
from proofroll.papers.blajer_2006.figures.reading import load_figures

TEXT = """
study = "figures"
title = "Some figures"
source = "somebody"
scene = "sphere_in_cylinder"
engine = "truth"
until = 0.5
every = 0.01

[symbols]
z = 'z_C'

[runs.free]
label = "free"
parameters = { speed = 4 }

[[figures]]
name = "height"
caption = "The height."
[[figures.panels]]
y = ["z"]
runs = ["free"]

[[statements]]
says = "ω3 = -160 1/s"
source = "section 3"
runs = ["free"]
of = "omega3"
measure = "every"
stated = "-160"
"""


def written(tmp_path: Path, text: str) -> str:
    """The path of a file with this text."""
    path = tmp_path / "made.toml"
    path.write_text(text, encoding="utf-8")
    return str(path)


@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('study = "figures"', 'study = "regimes"', 'only a file with study = "figures"'),
        ('title = "Some figures"', "title = Some figures", "the file is broken"),
        ('scene = "sphere_in_cylinder"', 'scene = "nowhere"', "there is no such scene"),
        ("speed = 4", "haste = 4", "runs.free.haste"),
        ("speed = 4", "speed = 0", "nothing to roll on"),
        ("until = 0.5", "until = -1", "not negative"),
        ("every = 0.01", "every = 0.01\nwheels = 4", "wheels"),
        ("z = 'z_C'", "height = 'z_C'", "symbols"),
        ('y = ["z"]', 'y = ["height"]', "choose from F2"),
        ('y = ["z"]', "y = []", "at least one quantity"),
        ('y = ["z"]\nruns = ["free"]', 'y = ["z"]\nruns = ["bound"]', "choose from free"),
        ('name = "height"', 'name = "../height"', "a name of its own"),
        ('name = "height"', 'name = "height"\ncolumns = 0', "at least 1 column"),
        ('name = "height"', 'name = "height"\nuntil = 9', "up to that of the runs"),
        ('name = "height"', 'name = "height"\nregimes = "stick_slip"', "either panels or"),
        ('source = "section 3"', 'source = ""', "needs its source"),
        ('measure = "every"', 'measure = "highest"', "measure"),
        ('measure = "every"\nstated = "-160"', 'measure = "every"\nbelow = 0', "every is for a stated number"),
        ('stated = "-160"', "", "give exactly one of"),
        ('stated = "-160"', 'stated = "-160"\nbelow = 0', "stated, below"),
        ('stated = "-160"', 'stated = "many"', "a number as text"),
        ('stated = "-160"', "at_most = 0", "needs its reason"),
        ('stated = "-160"', 'events = ["slip"]', "no quantity, measure or order"),
        ('of = "omega3"', 'of = "omega4"', "choose from"),
    ],
)
def test_a_broken_file_is_one_line(tmp_path: Path, old: str, new: str, words: str) -> None:
    """Every mistake is one line that says what to do."""
    assert old in TEXT
    with pytest.raises(InputError, match=words.replace("[", r"\[")) as raised:
        load_figures(written(tmp_path, TEXT.replace(old, new)))
    assert "\n" not in str(raised.value)


@pytest.mark.drill
def test_files_are_found_by_scene_and_are_no_comparisons() -> None:
    """The founding scene's figures are found by its name; the file is not taken for a comparison."""
    ours = load_figures("sphere_in_cylinder")
    assert ours.name not in comparison_names()
    assert ours.wants_orientation
    with pytest.raises(InputError, match=f"proofroll report {ours.name} runs it"):
        load_comparison(ours.name)
    with pytest.raises(InputError, match=f"choose one of {ours.name}"):
        load_figures("sphere_in_cone")


def test_a_number_holds_to_the_digits_stated() -> None:
    """Half a unit of the last digit is the border, inclusive; zeros at the end count; nan is no number."""
    assert rounds_to(0.2102143, "0.21")
    assert not rounds_to(0.2151, "0.21")
    assert rounds_to(0.2, "0.20")
    assert not rounds_to(0.206, "0.20")
    assert rounds_to(1.2925e-4, "1.293e-4")
    assert not rounds_to(-159.4, "-160")
    assert not rounds_to(float("nan"), "0")
    assert not rounds_to(float("inf"), "0")
