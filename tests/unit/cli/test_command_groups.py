"""Groups of commands in the help, and commands that the wheel does not contain."""

import pytest
import typer

from proofroll.cli import _commands, _usage_message
from proofroll.cli.command_groups import GROUPS, origin


def test_every_command_has_one_group() -> None:
    """Each command that is installed here is in one group by name."""
    named = [name for names in GROUPS.values() for name in names]
    assert len(named) == len(set(named))
    assert set(_commands().commands) <= set(named)


@pytest.mark.parametrize("name", ["bench", "drill"])
def test_a_command_of_the_repository_says_where_it_comes_from(name: str) -> None:
    """Where a package of the repository is not installed, its command is answered by the line that installs it."""
    said = _usage_message(typer._click.exceptions.UsageError(f"No such command '{name}'. Did you mean 'new'?"))
    assert said == origin(name)
    assert "pip install ./" in said


def test_another_command_is_unknown() -> None:
    """A mistyped command keeps its message."""
    said = "No such command 'comparre'. Did you mean 'compare'?"
    assert _usage_message(typer._click.exceptions.UsageError(said)) == said
