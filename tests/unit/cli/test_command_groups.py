"""Groups of commands in the help, and commands that are called something else now."""

import shlex
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
import typer

from proofroll.cli import _made, _usage_message, app
from proofroll.cli.command_groups import GROUPS, NOW

ROOT = Path(__file__).parents[3]
# Commands of packages that may be lacking.
_PACKAGES = {name: ROOT / name for name in ("balance", "fuzz", "throughput")}
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


@pytest.mark.parametrize("name", [name for name in NOW if name not in _PACKAGES])
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


@pytest.mark.parametrize("name", _PACKAGES)
def test_a_command_whose_package_is_lacking_names_it(
    proofroll: Proofroll, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without the package that announces a command, one line says from where to install it; both places are there."""
    project = tomllib.loads((_PACKAGES[name] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert name in project["entry-points"]["proofroll.commands"]
    left = [item for item in app.registered_groups if item.name != name]
    monkeypatch.setattr(app, "registered_groups", left)
    monkeypatch.setattr(app, "registered_commands", [item for item in app.registered_commands if item.name != name])
    monkeypatch.setattr("proofroll.cli._made", _made.__wrapped__)
    code, out, err = proofroll(name, "--json")
    assert (code, out, err) == (2, "", f"proofroll: {name} is now {NOW[name]}\n")
    assert f"pip install {project['name']};" in err
    assert ROOT / err.split()[-1] == _PACKAGES[name]


def test_the_command_that_is_asked_for_is_made_alone() -> None:
    """A known name makes its own command with all options, as all are made otherwise."""
    every = _made(app).commands
    for name, command in every.items():
        (alone,) = _made(app, name).commands.values()
        assert [item.opts for item in alone.params] == [item.opts for item in command.params]
        assert alone.short_help == command.short_help
    assert _made(app, "comparre").commands.keys() == every.keys()


def test_another_command_is_unknown() -> None:
    """A mistyped command keeps its message."""
    said = "No such command 'comparre'. Did you mean 'compare'?"
    assert _usage_message(typer._click.exceptions.UsageError(said)) == said
