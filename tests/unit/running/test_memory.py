from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator

import pytest

from proofroll.core.errors import InputError
from proofroll.running.memory import VARIABLE, descendants, memory_limit, resident_gb

# A process with a child of 200 MB, which tells when it is there.
FAMILY = """
import subprocess, sys
subprocess.run([sys.executable, "-c", "x = b'x' * 200_000_000; print('there', flush=True); input()"])
"""

proc = pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="the system has no /proc")


@pytest.fixture
def family() -> Iterator[subprocess.Popen[str]]:
    """A process and its child."""
    process = subprocess.Popen([sys.executable, "-c", FAMILY], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "there\n"
    yield process
    process.communicate("\n")


@pytest.mark.drill
@proc
def test_children_count(family: subprocess.Popen[str]) -> None:
    """The memory of a process is that of its children too, at any depth."""
    assert len(descendants(family.pid)) == 1
    assert 0.2 < resident_gb(family.pid) < 0.4
    assert set(descendants(os.getpid())) >= {family.pid, *descendants(family.pid)}


def test_a_process_that_is_gone() -> None:
    """What has ended has no memory and no children; asking is no error."""
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    assert (resident_gb(process.pid), descendants(process.pid)) == (0, [])


def test_usual_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    """A worker may have 4 GB, and on a small machine half of what is there."""
    monkeypatch.delenv(VARIABLE, raising=False)
    sizes = {"SC_PAGE_SIZE": 4096, "SC_PHYS_PAGES": 16 * 10**9 // 4096}
    monkeypatch.setattr(os, "sysconf", sizes.__getitem__)
    assert memory_limit() == 4.0
    sizes["SC_PHYS_PAGES"] = 10**9 // 4096
    assert memory_limit() == pytest.approx(0.5, rel=1e-4)


def test_limit_of_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    """The environment may say how much."""
    monkeypatch.setenv(VARIABLE, "12.5")
    assert memory_limit() == 12.5


@pytest.mark.parametrize("text", ["", "much", "0", "-1", "nan"])
def test_a_limit_that_is_none(monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    """A limit that is no positive number gives one line with the variable's name."""
    monkeypatch.setenv(VARIABLE, text)
    with pytest.raises(InputError, match=r"PROOFROLL_MEMORY = .*positive number of GB"):
        memory_limit()
