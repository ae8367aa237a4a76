"""Engines in other interpreters: they are the ones that were asked for, or there is a line that says why not."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from other_pythons import announce, bare, script, seeing, site_of

from proofroll.core.errors import InputError, Missing, ProofrollError
from proofroll.core.plugins import load_engine, release
from proofroll.files.scene_file import load_scene
from proofroll.running import interpreters
from proofroll.running.case import Case, EngineFacts, Status
from proofroll.running.engine_questions import describe, resolve
from proofroll.running.identity import mismatch, own
from proofroll.running.idle_workers import Workers
from proofroll.running.process import WorkerDied
from proofroll.running.runner import Runner, run_one
from proofroll.running.simulation import simulate
from proofroll.running.store import Store
from proofroll.studies.cases import single_case

SHORT = {"until": 0.02, "every": 0.01, "time_limit": 60.0}


@pytest.fixture(scope="module")
def old(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A Python that has the engine in version 1.0."""
    return seeing(tmp_path_factory.mktemp("old") / "venv", "1.0")


@pytest.fixture
def new(tmp_path: Path) -> Path:
    """A Python that has the engine in version 2.0."""
    return seeing(tmp_path / "new", "2.0")


def case_in(python: Path, workers: Workers | None = None) -> Case:
    """A short run of the engine there."""
    return single_case("sphere_in_cylinder", {}, f"aged@{python}", workers=workers, **SHORT)  # type: ignore[arg-type]


@pytest.mark.nightly
def test_an_engine_runs_where_its_name_says(
    old: Path, new: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Versions, interpreter and numbers are of the other Python, whatever PYTHONPATH and the working folder hold."""
    decoy = tmp_path / "decoy"
    (decoy / "proofroll").mkdir(parents=True)
    (decoy / "proofroll" / "__init__.py").write_text("raise RuntimeError('the wrong proofroll')")
    announce(decoy, "9.9")
    monkeypatch.setenv("PYTHONPATH", str(decoy))
    monkeypatch.setenv("PYTHONHOME", str(decoy))
    monkeypatch.chdir(decoy)
    runner = Runner(Store(tmp_path / "out"), jobs=1)
    first, second = case_in(old, runner.workers), case_in(new, runner.workers)
    assert (first.engine.version, first.engine.order) == ("1.0", 1)
    assert (second.engine.version, second.engine.order) == ("2.0", 2)
    assert first.key != second.key
    assert first.engine.libraries.keys() == {"python", "numpy", "scipy", "packages"}
    results = runner.run([first, second])
    for case, python in ((first, old), (second, new)):
        result = results[case.key]
        assert result.status == Status.DONE, result.message
        assert result.versions["aged"] == case.engine.version
        assert result.interpreter == str(python)
    files = [runner.store.trajectory(case).read_bytes() for case in (first, second)]
    assert files[0] != files[1]


@pytest.mark.nightly
def test_a_place_is_no_part_of_a_result(old: Path, tmp_path: Path) -> None:
    """The same packages at another path make the same case, so that what is stored is used; other packages do not."""
    other = seeing(tmp_path / "copy", "1.0")
    assert case_in(other).key == case_in(old).key
    info = site_of(other) / "more-1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: more\nVersion: 1\n")
    assert case_in(other).key != case_in(old).key


@pytest.mark.nightly
@pytest.mark.own_workers
def test_an_environment_that_changed_is_a_row(old: Path, tmp_path: Path) -> None:
    """An engine upgraded, or deleted, after it was asked fails with both versions; all other rows arrive."""
    upgraded, deleted = (seeing(tmp_path / name, "1.0") for name in ("upgraded", "deleted"))
    runner = Runner(Store(tmp_path / "out"), jobs=1)
    cases = [case_in(upgraded), case_in(deleted), case_in(old, runner.workers)]
    announce(site_of(upgraded), "2.0")
    cases[1] = Case(**{**vars(cases[1]), "until": 0.04})  # or it would be the same as the last one
    shutil.rmtree(tmp_path / "deleted")
    results = runner.run([Case(**{**vars(cases[0]), "until": 0.03}), *cases[1:]])
    first, second, third = results.values()
    by_status = {result.status: result.message for result in (first, second, third)}
    assert by_status.keys() == {Status.CRASHED, Status.MISSING, Status.DONE}
    assert "is version 2.0 here, and was 1.0 when it was asked" in by_status[Status.CRASHED]
    assert "there is no" in by_status[Status.MISSING]


@pytest.mark.nightly
def test_another_scene_there_is_a_row(old: Path, tmp_path: Path) -> None:
    """A case whose scene reads otherwise where the engine runs is no result."""
    case = Case(**{**vars(case_in(old)), "scene_digest": "other"})
    result = run_one(case, tmp_path / "run.npz")
    assert result.status == Status.CRASHED
    assert "is another scene where" in result.message


@pytest.mark.nightly
def test_a_worker_that_echoes_another_version_is_no_result(old: Path, tmp_path: Path) -> None:
    """What ran is compared with what had answered, also on this side of the pipe."""
    case = case_in(old)

    class Liar:
        waited = 0.0

        def request(self, *_: object) -> dict[str, object]:
            return {"status": "done", "message": "", "versions": {"aged": "3.0"}}

    from proofroll.running import runner

    with pytest.raises(WorkerDied, match=r"version 3.0 of aged ran, and 1.0 had answered"):
        runner._ask(Liar(), case, 60.0, tmp_path / "run.npz")  # type: ignore[arg-type]


def writes(text: str) -> Callable[[Path], Path]:
    """Makes a program of the shell in a folder."""
    return lambda folder: script(folder / "program", text)


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.nightly_of("too-old")
@pytest.mark.parametrize(
    ("make", "error", "says"),
    [
        (lambda folder: folder / "absent" / "python", InputError, "there is no .*absent/python"),
        (lambda folder: folder, InputError, "there is no .*bin/python"),
        (lambda folder: folder / "text", InputError, "is no program"),
        (lambda folder: bare(folder / "bare"), Missing, r"\(Python 3\.\d+\.\d+\) has no proofroll; proofroll engines"),
        (lambda folder: seeing(folder / "venv"), Missing, "there is no such engine"),
        (lambda folder: seeing(folder / "venv", "0.9.1"), Missing, r"0\.9\.1 is older than its adapter supports, 1\.0"),
        (writes("sleep 100"), WorkerDied, "did not answer within 0.5 s"),
        (writes("""echo '{"protocol": 1}'; echo noise >&2"""), WorkerDied, "did not answer as a Python with proofroll"),
        (writes("echo no such version >&2; exit 127"), WorkerDied, "127: no such version"),
        (writes("echo '[[3, 8, 18], null]'"), Missing, "is Python 3.8.18, and proofroll needs 3.11"),
    ],
    ids=["absent", "folder", "text", "bare", "no-engine", "too-old", "hangs", "prints", "shim", "python-3.8"],
)
def test_what_does_not_serve_says_why(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    make: Callable[[Path], Path],
    error: type[ProofrollError],
    says: str,
) -> None:
    """Every wrong place gives one line that names it."""
    (tmp_path / "text").write_text("no program")
    place = make(tmp_path)
    if "0.5 s" in says:
        monkeypatch.setattr(interpreters, "HELLO_TIME_LIMIT", 0.5)
    with pytest.raises(error, match=says) as caught:
        describe(f"aged@{place}")
    assert str(place) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.drill
def test_another_proofroll_is_not_trusted(tmp_path: Path) -> None:
    """A worker of another proofroll is refused at once, by protocol, version or code."""
    mine = own()
    assert mismatch(mine) == ""
    assert "speaks protocol 0 of workers" in mismatch(mine | {"protocol": 0})
    assert "has proofroll 0.0.1, and this is" in mismatch(mine | {"proofroll": "0.0.1"})
    python = seeing(tmp_path / "venv", "1.0")
    site = site_of(python)
    (site / "patch.py").write_text("import proofroll.running.identity as h; h.own = lambda o=h.own(): o | {'code': ''}")
    (site / "z.pth").write_text("import sys; 'proofroll.running.worker' in sys.orig_argv and __import__('patch')\n")
    (found,) = resolve([(f"aged@{python}", {})])
    assert isinstance(found, Missing)
    assert "has other code of proofroll" in str(found)


@pytest.mark.nightly
def test_noise_is_not_an_answer(tmp_path: Path) -> None:
    """A Python that prints when it starts serves nevertheless."""
    python = seeing(tmp_path / "venv", "1.0")
    (site_of(python) / "noise.pth").write_text("import sys; print('noise'); print('noise', file=sys.stderr)\n")
    assert describe(f"aged@{python}").version == "1.0"


@pytest.mark.drill
def test_no_engine_of_another_interpreter_is_loaded_here(old: Path) -> None:
    """What runs in this process refuses a place instead of running its own version under that label."""
    with pytest.raises(InputError, match="cannot be loaded into this one"):
        load_engine(f"mujoco@{old}")
    with pytest.raises(InputError, match="cannot be loaded into this one"):
        simulate(load_scene("sphere_in_cylinder"), f"mujoco@{old}")
    with Workers().lend(f"aged@{old}") as worker, pytest.raises(Missing, match="cannot be loaded"):
        worker.request({"do": "describe", "engine": "aged@elsewhere"}, 60)


@pytest.mark.drill
def test_a_worker_names_what_it_knows(old: Path) -> None:
    """A request that a worker does not know is answered, and it goes on."""
    with Workers().lend(f"aged@{old}") as worker:
        with pytest.raises(InputError, match="this worker knows hello, describe"):
            worker.request({"do": "dance"}, 60)
        assert worker.request({"do": "describe", "engine": f"aged@{old}"}, 60)["interpreter"] == str(old)


@pytest.mark.parametrize(
    ("text", "numbers"),
    [("4.0.0", (4,)), ("1.13.6.dev1", (1, 13, 6)), ("3.10.0rc1", (3, 10)), ("3.9", (3, 9)), ("unknown", ())],
)
def test_releases(text: str, numbers: tuple[int, ...]) -> None:
    """Versions are compared by their numbers, of any length."""
    assert release(text) == numbers


@pytest.mark.nightly
def test_the_command_line_takes_a_place(old: Path, proofroll: Callable[..., Any], tmp_path: Path) -> None:
    """Run, and compare with the rows of an engine moved there."""
    code, out, _ = proofroll("run", "sphere_in_cylinder", "--engine", f"aged@{old}", "--until", "0.02", "--json")
    assert (code, json.loads(out)["versions"]["aged"]) == (0, "1.0")
    claim = tmp_path / "claim.toml"
    claim.write_text(
        'title = "t"\nquestion = "q?"\nscene = "sphere_in_cylinder"\nuntil = 0.1\nevery = 0.05\ntimed = false\n'
        '[tolerances.close]\nbecause = "a look"\nz = "1 %"\n'
        f'[[rows]]\nengine = "aged@{old}"\ntolerance = "close"\n'
        '[[rows]]\nengine = "projection"\ntolerance = "close"\n'
    )
    engines = [f"aged@{old}", f"projection@{old}"]
    chosen = [word for name in engines for word in ("--engine", name)]
    _, out, _ = proofroll("compare", str(claim), *chosen, "--out", str(tmp_path / "out"), "--json")
    rows = json.loads(out)["rows"]
    assert [row["engine"] for row in rows] == engines
    assert all(row["verdict"] != "failed" for row in rows)


def test_facts_say_where() -> None:
    """Facts of engines in this interpreter have its libraries, and no hash of packages."""
    (found,) = resolve([("projection", {})])
    assert isinstance(found, EngineFacts)
    assert found.libraries["python"] == ".".join(map(str, sys.version_info[:3]))
    assert found.libraries.keys() == {"python", "numpy", "scipy"}
