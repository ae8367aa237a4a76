"""Forked workers: they begin as started ones do, and end in the same words."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from proofroll.running.forked import may_be_forked

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="workers are forked on Linux alone")

# Module of a worker: what it sees, and what ends it.
PROBE = """
import ctypes, os, signal, sys, threading, warnings

def seen():
    handlers = [str(signal.getsignal(number)) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)]
    variables = {name: value for name, value in os.environ.items() if name.endswith("_THREADS") or "MUJOCO" in name}
    found = {"path": sys.path, "folder": os.getcwd(), "handlers": handlers, "variables": variables}
    found |= {"leads": os.getsid(0) == os.getpid(), "input": sys.stdin.read(), "threads": threading.active_count()}
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    links = [f"/proc/self/fd/{number}" for number in os.listdir("/proc/self/fd")]
    files = [os.readlink(link) for link in links if os.path.lexists(link)]
    kinds = sorted(name.partition(":")[0] for name in files)
    return found | {"blocked": sorted(map(int, blocked)), "files": kinds, "safe": os.environ["PYTHONSAFEPATH"]}

def cry(how):
    print("the last word", file=sys.stderr)
    if how == "kill":
        os.kill(os.getpid(), signal.SIGSEGV)
    os._exit(3)
"""
PROGRAM = """
import json, signal, sys, tempfile, threading
from proofroll.running.forked import begin_template, may_be_forked
assert may_be_forked()
from proofroll.core.errors import ProofrollError
from proofroll.running.process import Worker
for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
    signal.signal(number, lambda *_: None)
opened = tempfile.TemporaryFile()
answers = []
for forked, requests in json.loads(sys.argv[1]):
    if forked:
        begin_template()
        threading.Thread(target=threading.Event().wait, daemon=True).start()
    with Worker() as worker:
        assert (type(worker._process).__name__ == "Forked") == forked
        for function, arguments in requests:
            try:
                ask = {"do": "call", "function": f"probe:{function}", "arguments": arguments}
                answers.append(worker.request(ask, 60))
            except ProofrollError as error:
                answers.append(str(error))
print(json.dumps(answers))
"""


LONE = """
import os
from proofroll.core.errors import ProofrollError
from proofroll.running.forked import begin_template
from proofroll.running.memory import descendants

begin_template()

from proofroll.running.process import Worker

killing = ["kill", "-9", str(descendants(os.getpid())[0])]
asked = {"do": "call", "function": "subprocess:run", "arguments": {"args": killing}}
with Worker() as worker:
    try:
        print(worker.request(asked, 60))
    except ProofrollError as error:
        print(error)
with Worker() as worker:
    print(worker.request({"do": "call", "function": "builtins:dict", "arguments": {"lives": 1}}, 60))
"""


def answers(folder: Path, *workers: tuple[bool, list[tuple[str, dict[str, str]]]]) -> list[object]:
    """What workers, forked or started, answer to requests from a process of its own in a folder."""
    (folder / "probe.py").write_text(PROBE)
    (folder / "work").mkdir()
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, json.dumps(workers)],
        cwd=folder / "work", env={"PYTHONPATH": str(folder), "MUJOCO_GL": "egl"}, stdin=subprocess.DEVNULL,
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    found: list[object] = json.loads(done.stdout)
    return found


@pytest.mark.drill
def test_a_forked_worker_begins_as_a_started_one(tmp_path: Path) -> None:
    """It has the path, folder, variables, signals, session and open files of a worker in a new interpreter.

    Also while other threads run in the process that asks for it.
    """
    started, *forked = answers(tmp_path, (False, [("seen", {})]), (True, [("seen", {})]), (True, [("seen", {})]))
    assert forked == [started, started]


@pytest.mark.drill
def test_a_forked_worker_ends_in_words(tmp_path: Path) -> None:
    """A crash or an exit of an engine is a sentence with what it printed, and a mistake leaves the worker alive."""
    ends = [("cry", {"how": "kill"})], [("cry", {"how": "exit"})], [("none", {}), ("seen", {})]
    killed, left, mistake, seen = answers(tmp_path, *((True, requests) for requests in ends))
    assert killed == "the engine's process was killed by SIGSEGV: the last word"
    assert left == "the engine's process ended with exit code 3: the last word"
    assert "AttributeError" in str(mistake)
    assert isinstance(seen, dict)


@pytest.mark.drill
def test_workers_start_anew_where_their_template_was_killed(tmp_path: Path) -> None:
    """Its workers end with it, in words, and those that are asked for later are started."""
    done = subprocess.run(
        [sys.executable, "-c", LONE], cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    first, second = done.stdout.splitlines()
    assert first.startswith("the engine's process was killed by SIGKILL")
    assert second == "{'lives': 1}"


def test_only_a_process_with_one_thread_forks() -> None:
    """A process that has numpy, whose libraries may have started threads, starts its workers."""
    import numpy as np

    assert np.zeros(1).size
    assert not may_be_forked()


@pytest.mark.drill
@pytest.mark.parametrize(
    "words",
    [
        "run pendulum --engine projection --until 0.1",
        "compare pendulum --engine projection --until 0.1",
        "recommend pendulum --engine projection",
        "watch pendulum --engine projection --once",
    ],
)
def test_a_command_starts_no_other_interpreter(tmp_path: Path, words: str) -> None:
    """It forks its workers from modules that it needs itself, which halves the cost of a comparison."""
    program = f"""
import subprocess, sys
from proofroll.cli import main

def refuse(*_, **__):
    raise OSError("an interpreter was started")

subprocess.Popen.__init__ = refuse
sys.argv = "proofroll {words}".split()
main()
"""
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "projection" in done.stdout + done.stderr
