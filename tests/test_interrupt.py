"""Ctrl-C, as a terminal sends it to the whole group of processes, and an output that cannot be written."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from proofroll.running.memory import descendants

# A shell's job may have been told to ignore Ctrl-C.
START = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)
from proofroll.__main__ import main
main()
"""
SLEEPER = """
import pathlib, time
pathlib.Path(__file__).with_name("begun").touch()
time.sleep(600)
"""


def interrupted(arguments: list[str], ready: Callable[[int], bool], times: int = 1) -> tuple[int, str, str]:
    """Exit code, standard output and standard error of a command that gets Ctrl-C when its process is ready for it."""
    process = subprocess.Popen(
        [sys.executable, "-c", START, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        deadline = time.monotonic() + 300
        while not ready(process.pid):
            assert process.poll() is None, "it ended too early"
            assert time.monotonic() < deadline, "it did not begin"
            time.sleep(0.05)
        for _ in range(times):
            os.killpg(process.pid, signal.SIGINT)
        out, err = process.communicate(timeout=300)  # an engine that hangs would take 600 s
    finally:
        process.kill()
    return process.returncode, out, err


@pytest.mark.nightly_of("command1")
@pytest.mark.drill
@pytest.mark.parametrize(
    "command", [["engines", "--capabilities"], ["run", "sphere_in_cylinder", "--engine", "sleeper"]]
)
def test_while_an_engine_is_asked(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    install_engines: Callable[[Mapping[str, str]], None],
    command: list[str],
) -> None:
    """Where an engine hangs while it is loaded Ctrl-C ends the command at once, with one line."""
    install_engines({"sleeper": "sleeper:Engine"})
    (tmp_path / "sleeper.py").write_text(SLEEPER)
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}{os.pathsep}{os.environ['PYTHONPATH']}")
    code, out, err = interrupted(command, lambda _: (tmp_path / "begun").exists())
    assert (code, out) == (130, "")
    assert err.startswith("proofroll: interrupted")
    assert err.count("\n") == 1


@pytest.mark.nightly
def test_while_the_map_is_drawn(tmp_path: Path) -> None:
    """Processes that compute for the truth end with Ctrl-C as well, and none of them says anything."""
    code, out, err = interrupted(
        ["paper", "regimes", "--jobs", "2", "--out", str(tmp_path)], lambda process: len(descendants(process)) > 1
    )
    assert (code, out) == (130, "")
    (line,) = [line for line in err.splitlines() if " of 10082, " not in line]  # how far it is, on a slow machine
    assert line == "proofroll: interrupted; cases that were finished and stored will be reused"


@pytest.mark.parametrize("module", ["proofroll.core.errors", "typing", "proofroll.cli", "typer"])
def test_while_the_command_is_loaded(module: str) -> None:
    """Ctrl-C before anything is run is one line too, from the first module on that is loaded."""
    script = (
        "import sys\n"
        f"sys.modules.pop({module!r}, None)\n"
        "class Impatient:\n"
        "    def find_spec(self, name, *_):\n"
        f"        if name == {module!r}:\n"
        "            raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Impatient())\n"
        "from proofroll.__main__ import main\n"
        "main()\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (130, "")
    assert done.stderr == "proofroll: interrupted before anything was run\n"


BROKEN_OFF = """
import os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
for ignored in (signal.SIGTERM, signal.SIGHUP):
    signal.signal(ignored, signal.SIG_DFL)
name, number = sys.argv.pop(1), int(sys.argv.pop(1))
class Spoilt:
    def find_spec(self, module, *_):
        if module == name:
            try:
                os.kill(os.getpid(), number)
            except KeyboardInterrupt:
                raise ImportError("partially initialized module") from None
sys.meta_path.insert(0, Spoilt())
from proofroll.__main__ import main
main()
"""


@pytest.mark.drill
@pytest.mark.one_in(4)
@pytest.mark.drill_of("proofroll.files.scene_file-2")
@pytest.mark.parametrize(
    ("module", "number"),
    [
        ("typer", signal.SIGTERM),
        ("proofroll.running.case", signal.SIGTERM),
        ("proofroll.running.case", signal.SIGHUP),
        ("proofroll.files.scene_file", signal.SIGINT),
    ],
)
def test_a_signal_while_a_module_is_imported(module: str, number: int) -> None:
    """Any signal that ends a command gives one line and 130, whatever the import that it breaks off makes of it."""
    script = [sys.executable, "-c", BROKEN_OFF, module, str(int(number)), "run", "pendulum", "--engine", "mujoco"]
    done = subprocess.run(script, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (130, "")
    assert done.stderr.startswith("proofroll: interrupted")
    assert done.stderr.count("\n") == 1


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.nightly_of("arguments1")
@pytest.mark.drill_of("arguments0")
@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="the system has no /dev/full")
@pytest.mark.parametrize("arguments", [["scenes"], ["scenes", "--json"], ["--help"]])
def test_an_output_that_is_full(arguments: list[str]) -> None:
    """Standard output on a full disk gives one line, and not the exit code of success."""
    with open("/dev/full", "w") as full:
        command = [sys.executable, "-m", "proofroll", *arguments]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr == "proofroll: the output cannot be written (No space left on device)\n"
