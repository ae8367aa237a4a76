"""The worker process and its parent."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest
from hostile import ENTRY_POINTS

import proofroll
from proofroll.running import identity
from proofroll.running.case import Case

# A process between the test and the worker, in the middle of a case that hangs.
pytestmark = pytest.mark.own_workers

PARENT = """
import json, sys
from proofroll.running.process import Worker

with Worker() as worker:
    worker.ask({"do": "run", "case": json.loads(sys.argv[1]), "out": sys.argv[2]}, 600)
"""


def read_until(pipe: int, done: Callable[[bytes | None], bool], seconds: float) -> bytes | None:
    """What the pipe gives first that is as wanted (empty: nobody has it open for writing), or None in time."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        try:
            found: bytes | None = os.read(pipe, 100)
        except BlockingIOError:
            found = None
        if done(found):
            return found
        time.sleep(0.05)
    return None


@pytest.mark.drill
@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="named pipes are POSIX")
def test_a_worker_ends_with_its_parent(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    make_case: Callable[..., Case],
    install_engines: Callable[[Mapping[str, str]], None],
) -> None:
    """When the parent is killed in the middle of a case that hangs, the worker ends by itself."""
    install_engines(ENTRY_POINTS)
    name = tmp_path / "pipe"
    os.mkfifo(name)
    monkeypatch.setenv("HANGS_ALOUD", str(name))
    pipe = os.open(name, os.O_RDONLY | os.O_NONBLOCK)
    case = json.dumps(dataclasses.asdict(make_case("hangs_aloud", time_limit=600.0)))
    parent = subprocess.Popen([sys.executable, "-c", PARENT, case, str(tmp_path / "run.npz")])
    worker = 0
    try:
        said = read_until(pipe, bool, 300)
        assert said, "the worker did not come to its case"
        worker = int(said)
        assert read_until(pipe, lambda found: found == b"", 1.0) is None, "the worker ended while its parent lived"
        parent.kill()
        parent.wait()
        assert read_until(pipe, lambda found: found == b"", 300) == b"", "the worker lives on without its parent"
        worker = 0
    finally:
        os.close(pipe)
        parent.kill()
        parent.wait()
        if worker:
            with contextlib.suppress(ProcessLookupError):
                os.kill(worker, signal.SIGKILL)


def test_whatever_a_result_rests_on_decides_its_key() -> None:
    """What the foundation, our engines and the truth import is in the digest by which stored results are found."""
    root = Path(proofroll.__file__).parent
    decisive = {*identity.FOUNDATION, "engines", "truth"}
    resting = [file for name in sorted(decisive) for file in (root / name).rglob("*.py")]
    missing: dict[str, str] = {}
    for file in resting:
        if identity.ASIDE & set(file.with_suffix("").parts):
            continue  # shows results, and decides none
        for module in re.findall(
            r"^\s*from proofroll\.([\w.]+) import", file.read_text(encoding="utf-8"), re.MULTILINE
        ):
            if module.split(".")[0] not in decisive:
                missing.setdefault(module, file.name)
    assert missing == {}


@pytest.mark.drill
def test_all_of_an_engines_package_decides_its_key(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What lies beside the folder of somebody's adapter, in the same package, may be its method."""
    package = tmp_path / "somebodys"
    (package / "engines").mkdir(parents=True)
    for folder in (package, package / "engines"):
        (folder / "__init__.py").write_text("")
    (package / "engines" / "adapter.py").write_text(
        "from tiny import Tiny\n\nclass Theirs(Tiny):\n    name = 'theirs'\n"
    )
    info = tmp_path / "theirs-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: theirs\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[proofroll.engines]\ntheirs = somebodys.engines.adapter:Theirs\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    before = identity.resolve("theirs", {})["code"]
    (package / "method.py").write_text("order = 1")
    assert identity.resolve("theirs", {})["code"] != before


@pytest.mark.drill
def test_what_a_plug_in_of_one_file_imports_decides_its_key(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A change of a module that an engine of one file imports, at any depth, outdates its results."""
    files = {
        "of_one_file.py": "from tiny import Tiny\nfrom of_one_file_helper import ORDER\n\n"
        "class Theirs(Tiny):\n    name = 'theirs'\n",
        "of_one_file_helper.py": "import json\nORDER = 1\n\ndef later():\n    import of_one_file_depth.deep\n",
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    (tmp_path / "of_one_file_depth").mkdir()
    for name in ("__init__.py", "deep.py"):
        (tmp_path / "of_one_file_depth" / name).write_text("import of_one_file\n")  # round in a circle
    (tmp_path / "beside.py").write_text("")
    info = tmp_path / "theirs-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: theirs\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[proofroll.engines]\ntheirs = of_one_file:Theirs\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    codes = [identity.resolve("theirs", {})["code"]]
    for changed in ("of_one_file_helper.py", "of_one_file_depth/deep.py"):
        path = tmp_path / changed
        path.write_text(path.read_text() + "# changed\n")
        codes.append(identity.resolve("theirs", {})["code"])
    assert len(set(codes)) == 3
    (tmp_path / "beside.py").write_text("# nobody imports it\n")
    assert identity.resolve("theirs", {})["code"] == codes[-1]


def test_own_code_is_read_once_in_a_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Engines and truths of this package are resolved hundreds of times by one reading of its code."""
    first = [identity.resolve(name, {})["code"] for name in ("projection", "truth")]
    monkeypatch.setattr(identity, "digest", lambda _: pytest.fail("read again"))
    assert [identity.resolve(name, {})["code"] for name in ("projection", "truth")] == first


def test_a_program_for_a_bug_report_outdates_no_result(tmp_path: Path) -> None:
    """An adapter's digest changes with its code, but not with that which only writes reproducers."""
    package = tmp_path / "adapter"
    (package / "reproducer").mkdir(parents=True)
    (package / "adapter.py").write_text("x = 1")
    before = identity.digest([package])
    (package / "reproducer" / "text.py").write_text("y = 1")
    (package / "reproducer.py").write_text("y = 1")
    assert identity.digest([package]) == before
    (package / "adapter.py").write_text("x = 2")
    assert identity.digest([package]) != before
    assert identity.digest([package / "adapter.py"]) != before  # an adapter of one file
