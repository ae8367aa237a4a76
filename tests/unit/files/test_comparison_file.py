from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from proofroll.core.comparison import Comparison, Tolerance
from proofroll.core.errors import InputError
from proofroll.core.verdict import Verdict
from proofroll.files.comparison_file import comparison_names, load_comparison
from proofroll.files.scene_file import load_scene

TEXT = """
title = "A claim"
question = "Does it hold?"
scene = "sphere_in_cylinder"
until = 1.0
every = 0.01

[vary]
speed = [2, 4]
rolling_resistance = [0.0, 5e-4]

[tolerances.tight]
because = "round-off"
z = "1e-10 m"
N = "0.1 %"

[[rows]]
engine = "projection"
tolerance = "tight"

[[rows]]
engine = "mujoco[formulation=chart]"
tolerance = "tight"
expect = "converges"
expect_for = { N = ["agrees", "converges"], F2 = "differs" }
because = "the contact is soft"
ladder = [1, 0.5, 0.25]
only = { speed = [4] }
order = { z = [0.9, 1.1] }
limit = { z = "3e-5 m" }
bound = { F3 = "2 %" }
"""

# Lines of the two rows after which something is added.
FIRST, SOFT = 'tolerance = "tight"', 'because = "the contact is soft"'


def excepted(where: str, expect: str, after: str = SOFT) -> str:
    """A line of a row, and an exception to what the row expects."""
    return f"{after}\nexcept_at = [{{ where = {{ {where} }}, expect = {expect} }}]"


@pytest.fixture
def load(tmp_path: Path) -> Callable[..., Comparison]:
    """Reads the comparison above with one text replaced."""

    def read(old: str = "", new: str = "") -> Comparison:
        assert old in TEXT
        path = tmp_path / "claim.toml"
        path.write_text(TEXT.replace(old, new, 1) if old else TEXT, encoding="utf-8")
        return load_comparison(str(path))

    return read


def test_a_comparison(load: Callable[..., Comparison]) -> None:
    """Everything that the file says is there, with defaults for what it does not say."""
    comparison = load()
    plain, free = comparison.rows
    assert comparison.name == "claim"
    assert comparison.time_limit == 120
    assert plain.expect == [Verdict.AGREES]
    assert plain.ladder == [4, 2, 1]
    assert free.ladder == [1, 0.5, 0.25]
    assert free.order == {"z": (0.9, 1.1)}
    assert free.limit == {"z": Tolerance(3e-5, False, "m")}
    assert free.bound == {"F3": Tolerance(0.02, True)}
    assert comparison.bands["tight"].because == "round-off"


def test_expected_verdicts(load: Callable[..., Comparison]) -> None:
    """One verdict may be written without a list, for the row and for an observable."""
    free = load().rows[1]
    assert free.expect == [Verdict.CONVERGES]
    assert free.expect_for == {"N": [Verdict.AGREES, Verdict.CONVERGES], "F2": [Verdict.DIFFERS]}


def test_exceptions_override(load: Callable[..., Comparison]) -> None:
    """At a point of an exception its verdicts are expected, the first one's that fits; elsewhere the row's."""
    first = '{ where = { speed = [2] }, expect = "agrees" }'
    second = '{ where = { speed = [2, 4] }, expect = "differs" }'
    free = load(SOFT, f"{SOFT}\nexcept_at = [{first}, {second}]").rows[1]
    assert free.expected({"speed": 2.0, "rolling_resistance": 0.0}) == [Verdict.AGREES]
    assert free.expected({"speed": 4.0, "rolling_resistance": 5e-4}) == [Verdict.DIFFERS]
    assert free.expected({"speed": 6.0, "rolling_resistance": 0.0}) == [Verdict.CONVERGES]


def test_an_exception_needs_every_parameter_to_fit(load: Callable[..., Comparison]) -> None:
    """An exception for two parameters holds only where both have a value of its lists."""
    free = load(SOFT, excepted("speed = [4], rolling_resistance = [0.0]", '["differs", "failed"]')).rows[1]
    assert free.expected({"speed": 4.0, "rolling_resistance": 0.0}) == [Verdict.DIFFERS, Verdict.FAILED]
    assert free.expected({"speed": 4.0, "rolling_resistance": 5e-4}) == [Verdict.CONVERGES]


def test_a_row_that_fits_no_point(tmp_path: Path) -> None:
    """A row whose values all exist, but at no point together, would never be run, and is refused."""
    points = "[[points]]\nspeed = 4\nrolling_resistance = 0.0\n\n[[points]]\nspeed = 2\nrolling_resistance = 5e-4\n"
    text = TEXT.replace("[vary]\nspeed = [2, 4]\nrolling_resistance = [0.0, 5e-4]\n", points)
    path = tmp_path / "claim.toml"
    path.write_text(text)
    assert len(load_comparison(str(path)).variations(load_comparison(str(path)).rows[1])) == 1
    path.write_text(text.replace("only = { speed = [4] }", "only = { speed = [4], rolling_resistance = [5e-4] }"))
    with pytest.raises(InputError, match=r"rows\.1\.only.*no point of the comparison fits"):
        load_comparison(str(path))


def test_variations(load: Callable[..., Comparison]) -> None:
    """A row is run at every combination of the parameters that it is not restricted from."""
    comparison = load()
    assert comparison.variations(comparison.rows[0]) == [
        {"speed": 2, "rolling_resistance": 0},
        {"speed": 2, "rolling_resistance": 5e-4},
        {"speed": 4, "rolling_resistance": 0},
        {"speed": 4, "rolling_resistance": 5e-4},
    ]
    assert [point["speed"] for point in comparison.variations(comparison.rows[1])] == [4, 4]
    point = "[[points]]\nspeed = 4\nmu_static = 0.3\n[tolerances.tight]"
    comparison = load("[tolerances.tight]", point)
    without = replace(comparison.rows[1], only={"speed": [4.0], "mu_static": []})
    assert [point.get("mu_static") for point in comparison.variations(without)] == [None, None]


def test_tolerance() -> None:
    """A tolerance is a number with a unit or a percentage of the scale."""
    assert Tolerance.parse("x", "6e-5 m").absolute(10) == 6e-5
    assert Tolerance.parse("x", "0.1 %").absolute(10) == pytest.approx(0.01)


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [("1e-3", "m", 1e-3), (2, "m", 2.0), ("1 mm", "m", 1e-3), ("1e-3 N m", "N m", 1e-3), ("2 kN", "N", 2e3)],
)
def test_a_tolerance_of_a_quantity_has_its_unit(text: object, unit: str, value: float) -> None:
    """Without a unit a number is in that of the quantity, which may have several parts or a prefix."""
    assert Tolerance.of_quantity("x", text, unit) == Tolerance(value, False, unit)
    with pytest.raises(InputError, match=f"its unit is {unit}"):
        Tolerance.of_quantity("x", "1 lb", unit)


def test_a_file_takes_the_tolerances_of_the_command_line(load: Callable[..., Comparison]) -> None:
    """Bounds, limits and bounds of one row may have a prefix, as ``1 mm``; they are kept in the scene's unit."""
    assert load('z = "1e-10 m"', 'z = "1 mm"').bands["tight"].bounds["z"] == Tolerance(1e-3, False, "m")
    assert load('limit = { z = "3e-5 m" }', 'limit = { z = "30 µm" }').rows[1].limit["z"].absolute(1) == pytest.approx(
        30e-6
    )
    assert load('bound = { F3 = "2 %" }', 'bound = { F3 = "2 kN" }').rows[1].bound["F3"].absolute(1) == 2e3


@pytest.mark.parametrize("text", ["6e-5", "m", "", "1.2.3 m", "0 m", "-1 m", "nan m", "inf m", "1 ", 6e-5, None])
def test_tolerances_of_another_form(text: object) -> None:
    """A tolerance without number or unit, or that is not positive, gives one line that shows the form."""
    with pytest.raises(InputError, match=r"write a (positive )?number and a unit") as caught:
        Tolerance.parse("claim: z", text)
    assert caught.value.field == "claim: z"


@pytest.mark.one_in(2)
@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[vary]", "[vary", ["broken", "line"]),
        ('title = "A claim"', "", ["title", "required"]),
        ('scene = "sphere', 'scen = "sphere', ["scen"]),
        ("until = 1.0", 'until = "long"', ["until", "'long'", "number"]),
        ("until = 1.0", "until = 1.0\nwhile = 2", ["while", "no such key", "vary, points, tolerances, rows"]),
        ("until = 1.0", 'until = 1.0\nname = "x"', ["toml: name", "no such key here; the keys are title"]),
        ("until = 1.0", "until = 1.0\nbands = {}", ["toml: bands", "no such key"]),
        ('because = "round-off"', "", ["tolerances.tight.because", "every tolerance needs its reason"]),
        ('z = "1e-10 m"', 'z = "1e-10"', ["tolerances.tight.z", "'1e-10'", "a unit"]),
        ('tolerance = "tight"', 'tolerance = "loose"', ["rows.0.tolerance", "'loose'", "tight"]),
        ('tolerance = "tight"', "", ["rows.0.tolerance", "required"]),
        ('engine = "projection"', 'engines = "projection"', ["rows.0.engine"]),
        ('expect = "converges"', 'expect = "maybe"', ["rows.1.expect", "maybe", "'converges'"]),
        ('because = "the contact is soft"', "", ["rows.1.because", "needs its reason"]),
        ("ladder = [1, 0.5, 0.25]", f"short = '{'far ' * 13}'", ["rows.1.short", "has 13 words", "say it in 12"]),
        ("ladder = [1, 0.5, 0.25]", "ladder = [1, 0.5]", ["rows.1.ladder", "three positive factors"]),
        ("ladder = [1, 0.5, 0.25]", "ladder = [0.25, 0.5, 1]", ["rows.1.ladder", "largest first"]),
        ("ladder = [1, 0.5, 0.25]", "ladder = [8, 4, 2]", ["rows.1.ladder", "one of them 1"]),
        ("ladder = [1, 0.5, 0.25]", "ladder = [1, 0.5, 0.1]", ["rows.1.ladder", "same ratio"]),
        ("ladder = [1, 0.5, 0.25]", "ladder = [1, 1, 1]", ["rows.1.ladder"]),
        ("ladder = [1, 0.5, 0.25]", "ladder = [1, 0.5, -0.25]", ["rows.1.ladder"]),
        ("only = { speed = [4] }", "only = { sped = [4] }", ["rows.1.only", "sped", "varies speed"]),
        ("only = { speed = [4] }", "only = { speed = [5] }", ["rows.1.only.speed = 5", "has only 2, 4"]),
        ('N = "0.1 %"', 'n = "0.1 %"', ["tolerances.tight", "'n'", "choose from gamma, z, attitude, N"]),
        ('scene = "sphere_in_cylinder"', 'scene = "sphere"', ["scene = 'sphere'"]),
        ('expect_for = { N', 'expect_for = { n', ["rows.1", "'n'", "no such observable"]),
        ("order = { z", "order = { y", ["rows.1", "'y'", "no such observable"]),
        ('limit = { z = "3e-5 m" }', 'limit = { z = "3e-5" }', ["rows.1.limit.z", "a unit"]),
        ('limit = { z = "3e-5 m" }', "limit = 3e-5", ["rows.1.limit"]),
        ('expect_for = { N = ["agrees", "converges"], F2 = "differs" }', "expect_for = 3", ["rows.1.expect_for"]),
        ("[tolerances.tight]", "[tolerances]\nloose = 3\n[tolerances.tight]", ["tolerances.loose"]),
        ('expect = "converges"', 'expect = ["agrees", "differs"]', ["rows.1.expect", "agrees or differs", "except_at"]),
        ('F2 = "differs"', 'F2 = ["differs", "unconfirmed"]', ["rows.1.expect", "differs or unconfirmed", "except_at"]),
        ('F2 = "differs"', 'F2 = ["differs", "agrees"]', ["rows.1.expect", "differs or agrees", "except_at"]),
        (SOFT, excepted("speed = [4]", '["agrees", "differs"]'), ["rows.1.expect", "agrees or differs", "any engine"]),
        (SOFT, excepted("sped = [4]", '"differs"'), ["rows.1.except_at.sped", "varies speed, rolling_resistance"]),
        (SOFT, excepted("speed = [5]", '"differs"'), ["rows.1.except_at.speed = 5", "has only 2, 4"]),
        (SOFT, excepted("speed = 4", '"differs"'), ["rows.1.except_at.0.where.speed", "list"]),
        (SOFT, excepted("speed = [4]", '"maybe"'), ["rows.1.except_at.0.expect", "maybe", "'converges'"]),
        (SOFT, f"{SOFT}\nexcept_at = [3]", ["rows.1.except_at.0 = 3"]),
        (SOFT, f"{SOFT}\nexcept_at = 3", ["rows.1.except_at = 3"]),
        (SOFT, f"{SOFT}\nexcept_at = [{{ where = {{ speed = [4] }} }}]", ["rows.1.except_at.0.expect", "required"]),
        (FIRST, excepted("speed = [4]", '"differs"', FIRST), ["rows.0.because", "needs its reason"]),
        ('z = "1e-10 m"', 'z = "1e-10 ms"', ["tolerances.tight: z = '1e-10 ms'", "its unit is m"]),
        ('N = "0.1 %"', 'gamma = "5e-3 m"', ["tolerances.tight: gamma = '0.005 m'", "its unit is rad"]),
        ('limit = { z = "3e-5 m" }', 'limit = { z = "3e-5 s" }', ["rows.1: z = '3e-05 s'", "its unit is m"]),
        ('bound = { F3 = "2 %" }', 'bound = { F3 = "2 lb" }', ["rows.1: F3 = '2 lb'", "its unit is N"]),
        ('N = "0.1 %"', 'first_slip = "1 %"', ["tolerances.tight: first_slip = '%'", "no size of its own", "in s"]),
        ('bound = { F3 = "2 %" }', 'bound = { event_times = "2 %" }', ["rows.1: event_times = '%'", "in s"]),
        ("speed = [2, 4]", f"speed = {list(range(1, 9000))}", ["claim.toml: vary", "more than 10000 points"]),
        ("mujoco[formulation=chart]", "adams[dt=1]", ["rows.1.engine = 'adams[dt=1]'", "no such engine", "mujoco"]),
        ("mujoco[formulation=chart]", "mujoco[formulation]", ["rows.1.engine", "write key=value"]),
        ('title = "A claim"', f"title = {'[' * 2000}", ["claim.toml", "nested more than 16 deep"]),
        ("[vary]", f"[{'.'.join('v' * 3000)}]\n[vary]", ["claim.toml", "nested more than 16 deep"]),
        ("every = 0.01", "every = 2", ["every = 2", "further apart than the run is long, 1 s"]),
        ("until = 1.0", "until = -1", ["toml: until = -1", "not negative"]),
        ("until = 1.0", "until = true", ["until = True", "not a number; give one"]),
        ("speed = [2, 4]", "speed = [2, true]", ["vary.speed.1 = True", "not a number; give one"]),
        ("until = 1.0", "until = 0", ["until = 0", "above 0"]),
        ("speed = [2, 4]", "speed = []", ["vary.speed = []", "give at least one value"]),
        ("speed = [2, 4]", "speed = 2", ["vary.speed = 2", "give a list: [value, value]"]),
        ("[vary]", "points = [{ speed = 'x' }]\n[vary]", ["points.0.speed = 'x'", "give a number"]),
        ("order = { z = [0.9, 1.1] }", "order = { z = [0.9] }", ["rows.1.order.z = [0.9]", "list is too short"]),
        ("order = { z = [0.9, 1.1] }", "order = 3", ["rows.1.order = 3", "give a table of names and values"]),
        ("every = 0.01", "every = 0.01\ntime_limit = -1", ["time_limit = -1", "above 0"]),
        ("every = 0.01", "every = 0.01\ntime_limit = inf", ["time_limit = inf", "finite"]),
        ("[vary]", "brief = { sped = [4] }\n[vary]", ["brief", "sped", "rolling_resistance, speed"]),
        ("[vary]", "brief = { speed = [5] }\n[vary]", ["brief", "keep at least one"]),
        ("[vary]", "order = nan\n[vary]", ["order = nan", "must be a number"]),
        ("order = { z = [0.9, 1.1] }", "order = { z = [nan, 1] }", ["order.z = [nan, 1.0]", "write [low, high]"]),
        ('because = "round-off"', "because = nan", ["tolerances.tight.because = nan", "needs its reason"]),
    ],
)  # fmt: skip
def test_broken_comparisons(load: Callable[..., Comparison], old: str, new: str, words: list[str]) -> None:
    """Each thing that is wrong in a comparison gives one line with the file, the key and what to do."""
    with pytest.raises(InputError) as caught:
        load(old, new)
    text = str(caught.value)
    assert "\n" not in text
    assert "claim.toml" in text
    assert not re.search(r"[Ii]nput should|valid (number|string|list|dictionary)|instance of", text)
    for word in words:
        assert word in text


def test_a_brief_comparison(load: Callable[..., Comparison]) -> None:
    """What is brief has only the combinations that fit, says how many it leaves out, and without the key has all."""
    points = "[[points]]\nspeed = 4\nmu_static = 0.3\n[[points]]\nspeed = 6\n[tolerances.tight]"
    whole = load("[tolerances.tight]", f"[brief]\nspeed = [4]\n{points}")
    brief = whole.briefly()
    assert (len(whole.combinations()), whole.left_out) == (6, 0)
    assert brief.combinations() == [
        {"speed": 4.0, "mu_static": 0.3},
        {"speed": 4.0, "rolling_resistance": 0.0},
        {"speed": 4.0, "rolling_resistance": 5e-4},
    ]
    assert brief.left_out == 3
    assert load().briefly() == load()


def test_rows_that_are_no_list(tmp_path: Path) -> None:
    """Rows written as one table are the user's error, not ours."""
    (tmp_path / "claim.toml").write_text(TEXT.split("[[rows]]", maxsplit=1)[0] + '[rows]\nengine = "projection"\n')
    with pytest.raises(InputError, match="rows"):
        load_comparison(str(tmp_path / "claim.toml"))


def test_a_comparison_without_rows(tmp_path: Path) -> None:
    """A comparison that compares nothing is refused."""
    (tmp_path / "claim.toml").write_text(TEXT.split("[[rows]]", maxsplit=1)[0])
    with pytest.raises(InputError, match="rows"):
        load_comparison(str(tmp_path / "claim.toml"))


@pytest.mark.drill
def test_an_unknown_comparison() -> None:
    """An unknown comparison is answered with those that exist, a mistyped name with what resembles it."""
    with pytest.raises(InputError, match=r"there is no such comparison or scene; choose one of paper, .*, … or a file"):
        load_comparison("no_such_claim")
    for wrong in ("pendulumm", "mechanisms/pendulumm", "pendulumm.toml"):
        with pytest.raises(InputError, match=r"choose one of pendulum, ([\w/]+, ){0,2}… or a file"):
            load_comparison(wrong)
    with pytest.raises(InputError, match=r"there is no such scene; choose one of pendulum, ([\w/]+, ){0,2}…$"):
        load_scene("pendulm")
    with pytest.raises(InputError, match=r"comparison = 'arm\.urdf': there is no such file$"):
        load_comparison("arm.urdf")


def test_comparisons_come_in_the_order_that_they_ask_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The founding one first; those that do not ask come last, by name, and a broken one hides no other."""
    assert comparison_names()[0] == "paper"
    texts = {"b": "", "a": "", "z": "order = 1", "y": "order = 2.5", "broken": "order = [", "other": 'study = "x"'}
    for name, text in texts.items():
        (tmp_path / f"{name}.toml").write_text(text)
    monkeypatch.setattr("proofroll.files.comparison_file.study_folders", lambda: (tmp_path,))
    assert comparison_names() == ["z", "y", "a", "b", "broken"]


@pytest.mark.parametrize("name", comparison_names())
def test_our_comparisons_can_be_read(name: str) -> None:
    """Every comparison of the project is whole, and every reason in it is a sentence."""
    comparison = load_comparison(name)
    assert comparison.rows
    assert all(comparison.variations(row) for row in comparison.rows)
    for band in comparison.bands.values():
        assert len(band.because.split()) > 3, band.because


@pytest.mark.parametrize("read", [load_comparison, load_scene])
def test_a_bare_file_of_a_scene_says_what_a_scene_is(read: Callable[[str], object], tmp_path: Path) -> None:
    """A file with a scene that is not in a folder of its own gets one line that says where it belongs."""
    file = tmp_path / "box.toml"
    file.write_text('title = "t"\nsource = "s"\n[gravity]\nmagnitude = 9.81\n')
    with pytest.raises(InputError, match="a scene is a folder: put this file into one"):
        read(str(file))
