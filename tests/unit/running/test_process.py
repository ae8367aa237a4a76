"""The parent's side of a worker: what it must survive that no case of the runner's tests shows."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from proofroll.core.errors import ProofrollError
from proofroll.running import process
from proofroll.running.case import Status
from proofroll.running.process import Worker, WorkerDied, end_all, processor_seconds
from proofroll_drill.processes import alive

# Where a worker stands is read from /proc; without it memory is not watched either.
pytestmark = [
    pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="the system has no /proc"),
    pytest.mark.own_workers,
]

HEAD = """
import json, os, signal, subprocess, sys, time

def answer(text):
    os.write(int(sys.argv[1]), text)

first = json.loads(sys.stdin.readline())
"""

Pretend = Callable[[str], None]


@pytest.fixture
def pretend(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Pretend:
    """Puts other code in the place of the worker's; there ``answer(text)`` writes to the pipe of the answers."""

    def install(code: str) -> None:
        script = tmp_path / "worker.py"
        head = (
            "import json, os, signal, subprocess, sys, time\ndef answer(text):\n    os.write(int(sys.argv[1]), text)\n"
        )
        script.write_text(head + "first = json.loads(sys.stdin.readline())\n" + textwrap.dedent(code))
        popen = subprocess.Popen

        def start(command: list[str], **options: object) -> subprocess.Popen[str]:
            bare = [sys.executable, "-I", "-S", str(script)]  # nothing of any package is wanted
            changed = [*bare, *command[3:]] if "proofroll.running.worker" in command else command
            return popen(changed, **options)  # type: ignore[call-overload,no-any-return]  # passed on as they are

        monkeypatch.setattr(process.subprocess, "Popen", start)

    return install


def died(time_limit: float = 60.0, memory: float | None = None) -> WorkerDied:
    """How a worker that is asked once dies; closing it a second time does no harm."""
    with Worker(memory) as worker:
        with pytest.raises(WorkerDied) as found:
            worker.ask({"do": "nothing"}, time_limit)
        worker.close()
    return found.value


@pytest.mark.parametrize(
    "text",
    [b"no JSON\\n", b"\\xff\\xfe\\n", b"[1]\\n", b'{"status": "done"}\\n', b'{"number": 2}\\n', b"x" * (1 << 23)],
    ids=["text", "bytes", "list", "without number", "another's number", "endless"],
)
def test_answers_that_are_none(pretend: Pretend, text: bytes) -> None:
    """Whatever else is written into the pipe of the answers ends the worker with a sentence."""
    pretend(f"for piece in range(0, {len(text)}, 65536):\n    answer(b'{text[:65536].decode()}')\ntime.sleep(600)")
    error = died()
    assert (error.status, "wrote into the answers" in str(error)) == (Status.CRASHED, True)


def test_an_answer_belongs_to_its_question(pretend: Pretend) -> None:
    """What an engine wrote behind a true answer is not taken for the answer to the next question."""
    pretend("""answer(b'{"number": 1}\\n{"status": "done"}\\n'); time.sleep(600)""")
    with Worker() as worker:
        assert worker.ask({"do": "nothing"}, 60) == {}
        with pytest.raises(WorkerDied, match="wrote into the answers"):
            worker.ask({"do": "nothing"}, 60)


def test_last_words_are_of_the_request_that_failed(pretend: Pretend) -> None:
    """A crash without a word is not explained by what the process had printed for an earlier request."""
    pretend("""
        print("all is well so far", file=sys.stderr, flush=True)
        answer(b'{"number": 1}\\n')
        sys.stdin.readline()
        os._exit(3)
    """)
    with Worker() as worker:
        assert worker.ask({"do": "nothing"}, 60) == {}
        with pytest.raises(WorkerDied) as found:
            worker.ask({"do": "nothing"}, 60)
    assert str(found.value) == "the engine's process ended with exit code 3"


def test_a_child_that_keeps_the_pipes_open(pretend: Pretend) -> None:
    """A worker that has ended is noticed although its child holds its pipes, and the child ends with it."""
    pretend("""
        child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"], close_fds=False)
        print("the child is", child.pid, flush=True)
        os._exit(3)
    """)
    error = str(died())
    assert "ended with exit code 3: the child is" in error
    deadline = time.monotonic() + 300
    while alive(int(error.rsplit(maxsplit=1)[-1])):
        assert time.monotonic() < deadline, "the child lives on"
        time.sleep(0.05)


def test_a_process_that_closes_its_answers_and_stays(pretend: Pretend, monkeypatch: pytest.MonkeyPatch) -> None:
    """A process that closes the pipe and does not end is ended after a while, and nobody waits for ever."""
    monkeypatch.setattr(process, "_GRACE", 0.5)
    pretend("os.close(int(sys.argv[1])); time.sleep(600)")
    assert str(died()) == "the engine's process closed its answers without ending"


def test_a_process_may_take_its_time_to_end(pretend: Pretend, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a process says while it ends is still heard."""
    monkeypatch.setattr(process, "_GRACE", 300.0)
    pretend("os.close(int(sys.argv[1])); time.sleep(0.5); print('x' * 200_000); sys.exit('the last word')")
    assert str(died()) == "the engine's process ended with exit code 1: the last word"


def test_a_flood_is_not_kept(pretend: Pretend) -> None:
    """Of what a worker prints only the end is kept, however much it is, and nothing of it goes to a disk."""
    pretend("""
        for _ in range(2000):
            os.write(1, b"this is printed again and again\\n" * 512)
        answer(b'{"number": 1, "well": true}\\n')
        time.sleep(600)
    """)
    with Worker() as worker:
        assert worker.ask({"do": "nothing"}, 60) == {"well": True}
        assert len(worker._said) <= 4096
        open_files = [os.readlink(f"/proc/{worker._process.pid}/fd/{number}") for number in (1, 2)]
    assert all(name.startswith("pipe:") for name in open_files)


def test_a_flood_does_not_outlast_the_limit(pretend: Pretend) -> None:
    """A worker that prints without end is ended at its time limit like any other."""
    pretend("while True:\n    os.write(1, b'again ' * 10000)")
    assert died(time_limit=0.3).status is Status.TIMEOUT


@pytest.mark.drill
def test_too_much_memory(pretend: Pretend) -> None:
    """A worker whose memory grows is ended, and the sentence says how much it was allowed."""
    pretend("""
        hoard = []
        for _ in range(40):  # 0.4 GB, and no more where nobody watches
            hoard.append(b'x' * 10_000_000)
            time.sleep(0.01)
        time.sleep(60)
        answer(b'{"number": 1}\\n')
    """)
    assert (
        str(died(time_limit=300, memory=0.2))
        == "needed more than 0.2 GB of memory and was ended; PROOFROLL_MEMORY allows more"
    )


def test_address_space_is_not_memory(pretend: Pretend) -> None:
    """A worker may reserve as much as it likes, as compilers and arenas do."""
    pretend("""
        import mmap
        space = mmap.mmap(-1, 8_000_000_000)
        time.sleep(0.5)
        answer(b'{"number": 1}\\n')
    """)
    with Worker(memory=0.2) as worker:
        assert worker.ask({"do": "nothing"}, 60) == {}


def test_a_kill_from_outside(pretend: Pretend) -> None:
    """A worker that the system ends says what that usually means."""
    pretend("os.kill(os.getpid(), signal.SIGKILL)")
    assert str(died()) == "the engine's process was killed by SIGKILL, as by a system that runs out of memory"


@pytest.mark.drill
def test_all_workers_can_be_ended_at_once(pretend: Pretend) -> None:
    """From a signal handler every worker is ended, so that whoever waits for one goes on."""
    pretend("time.sleep(600)")
    others = set(process._living)  # idle ones of studies that nobody has collected yet
    found: list[WorkerDied] = []
    threads = [threading.Thread(target=lambda: found.append(died())) for _ in range(2)]
    for thread in threads:
        thread.start()
    while threads[0].is_alive() or threads[1].is_alive():
        end_all()
        threads[0].join(0.05)
        threads[1].join(0.05)
    assert [error.status for error in found] == [Status.CRASHED] * 2
    assert process._living <= others


def test_processor_time_of_workers_counts(pretend: Pretend) -> None:
    """Each answer says what the process has used so far, of which only what is new is added."""
    pretend("""
        for used in (2.0, 5.0):
            answer(json.dumps({"number": first["number"], "used": used}).encode() + b"\\n")
            first = json.loads(sys.stdin.readline())
    """)
    before, own = processor_seconds(), time.process_time()
    with Worker() as worker:
        assert worker.ask({"do": "describe"}, 60.0) == {}
        assert worker.ask({"do": "describe"}, 60.0) == {}
    assert processor_seconds() - before == pytest.approx(5.0 + time.process_time() - own, abs=1e-2)


@pytest.mark.drill
def test_a_worker_volunteers_and_reads_nothing() -> None:
    """In a real worker standard input is empty, no core is left, and the kernel ends it before its parent."""
    with Worker() as worker:
        assert worker.ask({"do": "describe", "engine": "no_such_engine"}, 60)["error"] == "input"
        pid = worker._process.pid
        assert os.readlink(f"/proc/{pid}/fd/0") == os.devnull
        assert Path(f"/proc/{pid}/oom_score_adj").read_text().strip() == "1000"
        limits = Path(f"/proc/{pid}/limits").read_text().splitlines()
        assert next(line for line in limits if line.startswith("Max core")).split()[4] == "0"


def test_no_process_can_be_started(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the system starts no more processes, one line says so."""

    def refuse(*_: object, **__: object) -> None:
        raise OSError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(process.subprocess, "Popen", refuse)
    with pytest.raises(ProofrollError, match="a worker process cannot be started: Resource temporarily unavailable"):
        Worker()


@pytest.fixture
def crowded() -> Iterator[int]:
    """A processor on which three others compute all the time."""
    core = min(os.sched_getaffinity(0))
    code = f"import os\nos.sched_setaffinity(0, {{{core}}})\nwhile True: pass"
    others = [subprocess.Popen([sys.executable, "-I", "-S", "-c", code], start_new_session=True) for _ in range(3)]
    yield core
    for other in others:
        other.kill()
        other.wait()


@pytest.mark.drill
@pytest.mark.skipif(not Path("/proc/self/schedstat").exists(), reason="the system does not count waiting")
def test_time_in_which_others_had_the_processor_does_not_count(pretend: Pretend, crowded: int) -> None:
    """A worker that needs half of its limit in seconds of the processor answers, however many compute beside it."""
    pretend(
        f"""
        os.sched_setaffinity(0, {{{crowded}}})
        began = time.monotonic()
        while time.process_time() < 0.2: pass
        answer(json.dumps({{"number": 1, "took": time.monotonic() - began}}).encode() + b"\\n")
        """
    )
    with Worker() as worker:
        assert worker.ask({"do": "nothing"}, 0.4)["took"] > 0.4


@pytest.mark.drill
@pytest.mark.skipif(not Path("/proc/self/schedstat").exists(), reason="the system does not count waiting")
def test_who_computes_without_end_is_ended_beside_others_too(pretend: Pretend, crowded: int) -> None:
    """The limit of time is met by a worker that shares its processor: it is only met later."""
    pretend(f"os.sched_setaffinity(0, {{{crowded}}})\nwhile True: pass")
    assert died(time_limit=0.3).status is Status.TIMEOUT


@pytest.mark.drill
def test_modules_of_the_working_folder_are_not_imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A worker beside files named as modules of Python, of ours and of engines runs none of them."""
    for name in ("random", "numpy", "mujoco", "proofroll"):
        (tmp_path / f"{name}.py").write_text(f"open({str(tmp_path / 'executed')!r}, 'a').write({name!r})")
    monkeypatch.chdir(tmp_path)
    with Worker() as worker:
        answer = worker.request({"do": "hello", "place": ""}, 60)
    assert answer["proofroll"]
    assert not (tmp_path / "executed").exists()


@pytest.mark.drill
def test_the_time_of_a_worker_that_is_ended_counts(pretend: Pretend) -> None:
    """What a worker computed before it was ended at its limit is processor time of this process, too."""
    pretend("while True: pass")
    before, own = processor_seconds(), time.process_time()
    assert died(time_limit=0.4).status is Status.TIMEOUT
    assert processor_seconds() - before - (time.process_time() - own) > 0.2
