"""Groups of commands in the help, and commands that are called something else now."""

import shlex
from collections.abc import Callable

import pytest
import typer

from proofroll.cli import _made, _usage_message, app
from proofroll.cli.command_groups import GROUPS, NOW

Proofroll = Callable[..., tuple[int, str, str]]


def test_every_command_has_one_group() -> None:
    """Each command that is installed here is in one group by name."""
    named = [name for names in GROUPS.values() for name in names]
    assert len(named) == len(set(named))
    assert set(_made(app).commands) <= set(named)


def test_the_commands_fit_a_screen(proofroll: Proofroll) -> None:
    """The list of commands leaves a line for the prompt on a screen of 80 columns and 24 lines."""
    code, out, err = proofroll("--help")
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert (max(map(len, lines)) <= 80, len(lines) < 24) == (True, True)


@pytest.mark.parametrize("name", NOW)
def test_an_old_command_is_answered_by_the_new_one(proofroll: Proofroll, name: str) -> None:
    """An old spelling runs nothing: one line names the new one, which is there."""
    code, out, err = proofroll(name, "--json")
    assert (code, out, err) == (2, "", f"proofroll: {name} is now {NOW[name]}\n")
    program, *words = shlex.split(NOW[name].partition(";")[0].partition(",")[0])
    if program == "proofroll":
        known = _made(app).commands
        assert words[0] in known
        options = {option for item in known[words[0]].params for option in item.opts}
        assert {word for word in words if word.startswith("--")} <= options
        assert words[0] != "paper" or words[1] in known["paper"].commands
    else:
        assert __import__(words[1])


def test_another_command_is_unknown() -> None:
    """A mistyped command keeps its message."""
    said = "No such command 'comparre'. Did you mean 'compare'?"
    assert _usage_message(typer._click.exceptions.UsageError(said)) == said
