from __future__ import annotations

import io
import json

import pytest
from rich.table import Table

from proofroll.report.labels import settings_text, step
from proofroll.report.terminal.printable import escaped, printable
from proofroll.report.terminal.screen import Screen, console, numeric, plain_table, unbroken

COMMANDS = "\x1b]0;title\x07\x1b[2J\x9b31m\x00\x08\r\x7f\u202e\u2028"


def test_text_without_commands() -> None:
    """Control characters are left out; letters, symbols and line feeds stay."""
    assert printable(f"γ̇ = 2 rad/s{COMMANDS}\n–") == "γ̇ = 2 rad/s]0;title[2J31m\n–"


def test_json_loses_nothing() -> None:
    """In JSON control characters are numbers, and come back as they were."""
    text = escaped(json.dumps({"said": COMMANDS}, ensure_ascii=False))
    assert printable(text) == text
    assert json.loads(text) == {"said": COMMANDS}


@pytest.mark.parametrize("coloured", [True, False])
def test_a_screen_obeys_its_own_styles_alone(coloured: bool) -> None:
    """What is shown in a table or a line commands nothing, while the screen's own colours do."""
    out = io.StringIO()
    screen = Screen(file=out, force_terminal=coloured, color_system="standard" if coloured else None, width=80)
    table = Table("engine")
    table.add_row(COMMANDS, style="red")
    screen.print(table)
    screen.print(COMMANDS, markup=False, style="red")
    shown = out.getvalue()
    assert ("\x1b[31m" in shown) == coloured
    for command in ("\x1b]0", "\x1b[2J", "\x9b", "\x07", "\x00", "\r", "\u202e"):
        assert command not in shown


def test_a_text_is_shown_as_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    """What looks like a style or a picture's name in a line or a cell, as in names of files and settings, stays."""
    said = "[bold]x[/bold] :smile:"
    table = Table("engine", title=said)
    table.add_row(said)
    for part in (said, table):
        console().print(part)
    assert capsys.readouterr().out.count(said) == 3


@pytest.mark.parametrize("width", [24, 40, 60, 80, 100])
def test_a_table_is_never_cut(width: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Whatever the width of a pipe, each word and number of a table is there whole, and no line is wider."""
    monkeypatch.setenv("COLUMNS", str(width))
    table = Table(title="errors", box=None, padding=(0, 1, 0, 0))
    table.add_column("engine formulation setting", min_width=10, overflow="fold")
    numbers = [f"{index + 1}.7e-{index + 10}" for index in range(8)]
    for index in range(8):
        table.add_column(f"name{index} [m/s]", justify="right", no_wrap=index % 2 == 0)
    table.add_row("pinocchio free_flyer matched", *numbers)
    console().print(table)
    console().print()
    out = capsys.readouterr().out
    assert out.endswith("\n\n")
    assert max(map(len, out.splitlines())) <= width
    assert "…" not in out
    for word in ("errors", "pinocchio", "free_flyer", "matched", *numbers):
        assert word in out.split()
    assert out.count("errors") == 1


def test_what_is_said_below_a_table_is_as_wide_as_the_screen(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A narrow table, or the narrow last part of a wide one, has its caption once, in lines of the whole width."""
    monkeypatch.setenv("COLUMNS", "40")
    said = "wall seconds per simulated second"
    wide = Table("engine", *(f"a name of column {index}" for index in range(5)), box=None, caption=said)
    for column in wide.columns:
        column.no_wrap = True
    for table in (Table("a", caption=said), wide):
        console().print(table)
        assert capsys.readouterr().out.splitlines().count(said) == 1


def test_a_pipe_has_the_width_that_it_is_given(monkeypatch: pytest.MonkeyPatch) -> None:
    """In a pipe COLUMNS decides, and 100 where nothing is said."""
    monkeypatch.setenv("COLUMNS", "133")
    assert console().width == 133
    monkeypatch.delenv("COLUMNS")
    assert console().width == 100


@pytest.mark.parametrize(
    ("resolution", "value", "shown"),
    [
        ("dt", 1e-3, "dt 1e-3 s"),
        ("dt", 1.25e-4, "dt 1.25e-4 s"),
        ("dt", 0.125, "dt 0.125 s"),
        ("rtol", 2.2e-14, "rtol 2.2e-14"),
        ("dt", None, ""),
        (None, None, ""),
    ],
)
def test_a_step_is_shown_as_it_is(resolution: str | None, value: float | None, shown: str) -> None:
    """A step has its name, its digits and its unit, a tolerance its name and two digits."""
    assert step(resolution, value) == shown


def test_settings_that_are_left_to_the_engine_are_not_listed() -> None:
    """A setting without a value is no text that a person could give."""
    assert settings_text({"dt": 1e-3, "elimination": None}) == "dt=0.001"


def test_parts_of_a_table_tell_their_lines(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Where columns go below the others, the columns that tell the lines apart stand there again."""
    monkeypatch.setenv("COLUMNS", "45")
    table = plain_table(*unbroken("engine", "step"), *numeric(*(f"quantity {number}" for number in range(3))))
    for step_size in ("dt 0.1 s", "dt 0.2 s"):
        table.add_row("projection", step_size, *("1.7e-10",) * 3)
    console().print(table)
    out = capsys.readouterr().out
    assert out.count("projection dt 0.1 s") == out.count("projection dt 0.2 s") == out.count("step") == 2
