"""Progress on standard error: a bar or growing rows on a terminal, a line now and then where nothing may move."""

from __future__ import annotations

import os
import pty
import subprocess
import sys
import time

import pytest

from proofroll.cli import options


def test_a_pipe_gets_a_line_now_and_then(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Long work says how far it is, in lines; short work says nothing."""
    with options.progress_bar("runs", total=2) as advance:
        advance("exudyn")
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(options, "_SAID_EVERY", 0.05)
    said = ""
    with options.progress_bar("runs", total=2) as advance:
        advance("exudyn")
        while "exudyn: 1 of 2" not in said:  # ended by the limit of time of the tests
            time.sleep(0.01)
            said += capsys.readouterr().err
    with options.spinner("pendulum in mujoco") as say:
        say("building")
        while "building" not in said:
            time.sleep(0.01)
            said += capsys.readouterr().err
    for shown in (True, False):  # rows of a comparison, and one for a program
        said = ""
        with options.growing(lambda: ["a row"], lambda: "1 of 2 runs", shown=shown) as moves:
            while "1 of 2 runs" not in said:
                time.sleep(0.01)
                said += capsys.readouterr().err
        assert not moves
    assert "\x1b" not in said
    assert all(line.startswith("proofroll: ") for line in said.splitlines())


WORK = """
from proofroll.cli.options import progress_bar, spinner
with progress_bar("runs", total=2) as advance:
    advance("exudyn")
with spinner("pendulum"):
    pass
"""


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize("no_color", [False, True])
def test_no_color_moves_nothing(no_color: bool) -> None:
    """On a terminal NO_COLOR leaves no escape codes, of colours or of the cursor; without it there is a bar."""
    ours, theirs = pty.openpty()
    environment = {key: value for key, value in os.environ.items() if key not in {"NO_COLOR", "TERM", "FORCE_COLOR"}}
    environment |= {"TERM": "xterm"} | ({"NO_COLOR": "1"} if no_color else {})
    subprocess.run([sys.executable, "-c", WORK], env=environment, stdout=theirs, stderr=theirs, timeout=120, check=True)
    os.write(theirs, b"end")
    said = os.read(ours, 1 << 16)
    os.close(ours)
    os.close(theirs)
    assert (b"\x1b" in said) is not no_color


GROWING = """
import sys
from proofroll.cli.options import growing
with growing(lambda: ["a row"], lambda: "1 of 2 runs", shown=len(sys.argv) < 2) as moves:
    pass
print(moves)
"""


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize(("more", "moves"), [([], True), (["json"], False)])
def test_rows_grow_on_a_terminal_alone(more: list[str], moves: bool) -> None:
    """Rows above a line of progress are shown on a terminal and removed at the end; for a program, never."""
    ours, theirs = pty.openpty()
    environment = {key: value for key, value in os.environ.items() if key not in {"NO_COLOR", "TERM", "FORCE_COLOR"}}
    command = [sys.executable, "-c", GROWING, *more]
    done = subprocess.run(
        command, env=environment | {"TERM": "xterm"}, stdout=subprocess.PIPE, stderr=theirs, timeout=120, check=True
    )
    os.write(theirs, b"end")
    said = os.read(ours, 1 << 16)
    os.close(ours)
    os.close(theirs)
    assert done.stdout.decode().strip() == str(moves)
    assert (b"a row" in said, b"1 of 2 runs" in said) == (moves, moves)
    assert (b"\x1b[2K" in said.rpartition(b"1 of 2 runs")[2]) is moves, "the line is erased"
    piped = subprocess.run(command, env=environment, capture_output=True, timeout=120, check=True)
    assert piped.stderr == b""
