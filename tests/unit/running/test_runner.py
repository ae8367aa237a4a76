from __future__ import annotations

import dataclasses
import json
import os
import shutil
import statistics
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest
from hostile import ENTRY_POINTS

from proofroll.core.errors import InputError, Missing
from proofroll.files.trajectory_file import read
from proofroll.running.case import Case, EngineFacts, Result, Status
from proofroll.running.engine_questions import describe, resolve
from proofroll.running.idle_workers import Workers
from proofroll.running.process import WorkerDied
from proofroll.running.runner import Runner, run_one
from proofroll.running.store import Store
from proofroll.studies.cases import single_case

MakeCase = Callable[..., Case]


@pytest.fixture(autouse=True)
def hostile_engines(install_engines: Callable[[Mapping[str, str]], None]) -> None:
    """All engines of ``tests/plugins/hostile.py``."""
    install_engines(ENTRY_POINTS)


# What the row of an engine must say; what an engine does to its process is in tests/drill.
OUTCOMES = {
    "oracle": (Status.DONE, "reached 0.1 s"),
    "raises": (Status.CRASHED, "RuntimeError: matrix is singular at t = 0.0"),
    "not_a_number": (Status.DIVERGED, "v_WB is not finite"),
    "gives_up": (Status.DIVERGED, "step size fell to nothing"),
    "refuses": (Status.REFUSED, "no wheel, no ball"),
    "absent": (Status.MISSING, "absent is not installed here"),
    "misspelt": (Status.CRASHED, "NoSuchClass"),
    "judges_itself": (Status.CRASHED, "changed proofroll.core.certificate.Line.holds in its process"),
    "leaks": (Status.CRASHED, "Too many open files"),  # of the trajectory, or of a module that is read later
    "limits_files": (Status.CRASHED, "its process could not write a file any more (File too large)"),
    "moves_the_bar": (Status.CRASHED, "changed proofroll.core.certificate.EXACT in its process"),
    "signs_for_the_ball": (
        Status.CRASHED,
        "changed proofroll.elements.mechanism.run.certificate.certify in its process",
    ),
}


@pytest.mark.nightly
def test_each_engine_costs_its_own_case_alone(tmp_path: Path, make_case: MakeCase) -> None:
    """An exception, NaN, an engine that gives up, refuses or is lacking: each costs one case, said in a sentence."""
    cases = {name: make_case(name) for name in OUTCOMES}
    results = Runner(Store(tmp_path), jobs=2).run(cases.values())
    assert results.keys() == {case.key for case in cases.values()}
    for name, (status, words) in OUTCOMES.items():
        result = results[cases[name].key]
        assert (result.status, words in result.message) == (status, True), (name, result)
        assert "\n" not in result.message
        # a line of the adapter is named exactly where an exception is not the engine's answer
        assert ("(plugins/hostile.py:" in result.message) == (name == "raises"), result
    for name in ("oracle", "not_a_number", "gives_up"):
        dataset = read(Runner(Store(tmp_path)).store.trajectory(cases[name]))
        assert dataset.sizes["time"] == (3 if results[cases[name].key].status is Status.DONE else 2)


@pytest.mark.drill
def test_stored_results_are_reused(tmp_path: Path, make_case: MakeCase) -> None:
    """What is there is not run again; ``fresh`` runs it again; a crash is never reused."""
    cases = [make_case("oracle"), make_case("refuses"), make_case("exits")]
    first = Runner(Store(tmp_path), jobs=1)
    before = first.run(cases)
    assert first.reused == 0
    again = Runner(Store(tmp_path), jobs=1)
    after = again.run(cases)
    assert again.reused == 2
    assert after[cases[0].key] == before[cases[0].key]
    fresh = Runner(Store(tmp_path), jobs=1, fresh=True)
    fresh.run(cases[:1])
    assert fresh.reused == 0


@pytest.mark.drill
def test_a_fresh_runner_runs_each_case_once(tmp_path: Path) -> None:
    """Studies that share a fresh runner share its cases: what it ran itself is not run again."""
    case = single_case(
        "sphere_in_cylinder", {}, "reduced[formulation=closed_form]", until=0.1, every=0.1, time_limit=60
    )
    Runner(Store(tmp_path), jobs=1).run([case])
    fresh = Runner(Store(tmp_path), jobs=1, fresh=True)
    fresh.run([case])
    assert fresh.reused == 0
    fresh.run([case])
    assert fresh.reused == 1


@pytest.mark.drill
def test_progress_is_told_of_every_case_once(tmp_path: Path, make_case: MakeCase) -> None:
    """Equal cases are run once, and progress is reported in the caller's thread, stored results included."""
    seen: list[tuple[str, Status, bool]] = []

    def progress(case: Case, result: Result) -> None:
        seen.append((case.engine.name, result.status, threading.current_thread() is threading.main_thread()))

    store = Store(tmp_path)
    Runner(store, jobs=1).run([make_case("oracle")])
    Runner(store, jobs=2).run([make_case("oracle"), make_case("oracle"), make_case("refuses")], progress)
    assert sorted(seen) == [("oracle", Status.DONE, True), ("refuses", Status.REFUSED, True)]


@pytest.mark.drill
def test_a_result_asks_for_further_cases(tmp_path: Path, make_case: MakeCase) -> None:
    """Each answer may ask for more, stored or not; what was asked for before is not run again; an end comes."""
    cases = [make_case("oracle", parameters={"speed": float(speed)}) for speed in (2, 3, 4, 5)]
    stored = cases[2]
    Runner(Store(tmp_path), jobs=1).run([stored])
    told: list[str] = []

    def then(case: Case, result: Result) -> list[Case]:
        assert result.status == Status.DONE
        told.append(case.key)
        return cases[: cases.index(case) + 2]  # those before are asked for again

    runner = Runner(Store(tmp_path), jobs=2)
    results = runner.follow(cases[:1], then)
    assert told == [case.key for case in cases]
    assert list(results) == told
    assert runner.reused == 1
    assert Runner(Store(tmp_path), jobs=2).follow([], then) == {}


@pytest.mark.drill
def test_a_case_that_makes_no_sense_costs_only_itself(tmp_path: Path, make_case: MakeCase) -> None:
    """A setting that does not exist is that case's refusal; the other cases arrive, and alone it is raised."""
    wrong, right = make_case("oracle", settings={"speed": 3}), make_case("oracle")
    results = Runner(Store(tmp_path), jobs=1).run([wrong, right])
    assert results[wrong.key].status is Status.REFUSED
    assert "no such setting" in results[wrong.key].message
    assert results[right.key].status is Status.DONE
    with pytest.raises(InputError, match=r"oracle: speed = .*no such setting"):
        run_one(wrong, tmp_path / "out.npz")


@pytest.mark.drill
def test_an_error_in_progress_ends_the_run(tmp_path: Path, make_case: MakeCase) -> None:
    """An interruption reaches the caller although an engine hangs, and leaves no process behind."""

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    runner = Runner(Store(tmp_path), jobs=2)
    with pytest.raises(KeyboardInterrupt):
        runner.run([make_case("hangs"), make_case("oracle")], interrupt)
    assert all(worker._ended() for worker in runner.workers._made)


@pytest.mark.drill
def test_a_damaged_result_says_so_once(tmp_path: Path, make_case: MakeCase) -> None:
    """A result that is not what was stored is made again, its row says why, and the next run finds it sound."""
    case, store = make_case("oracle"), Store(tmp_path)
    Runner(store, jobs=1).run([case])
    store.trajectory(case).write_bytes(b"half")
    runner = Runner(store, jobs=1)
    assert runner.run([case])[case.key].message == "reached 0.1 s; what was stored was damaged"
    assert runner.damaged == {case.key}
    again = Runner(store, jobs=1)
    assert again.run([case])[case.key].message == "reached 0.1 s"
    assert (again.reused, again.damaged) == (1, set())


FILL = """
import json, sys
from pathlib import Path
from proofroll.core.errors import Unwritable
from proofroll.running.case import Case
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll.running.idle_workers import Workers

store, cases = Store(Path(sys.argv[1])), [Case.from_dict(content) for content in json.loads(sys.argv[2])]
said, kept = [], []
for fresh in (False, True):
    try:
        Runner(store, jobs=1, fresh=fresh).run(cases)
    except Unwritable as error:
        said.append(str(error))
    kept.append([store.get(case) is not None for case in cases])
print(json.dumps([said, *kept]))
"""


@pytest.mark.nightly
def test_a_disk_that_is_really_full(tmp_path: Path, make_case: MakeCase) -> None:
    """A full disk ends the run with one line; what fits is stored, and running all again loses nothing."""
    cases = [dataclasses.asdict(make_case("oracle", parameters={"speed": speed})) for speed in (3.0, 4.0, 5.0)]
    (tmp_path / "disk").mkdir()
    mount = 'mount -t tmpfs -o size=64k tmpfs "$1" && shift && exec "$@"'
    command = ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c", mount, "sh", str(tmp_path / "disk")]
    if not shutil.which("unshare") or subprocess.run([*command, "true"], check=False, capture_output=True).returncode:
        pytest.skip("this system lets nobody mount a small disk")
    fill = [sys.executable, "-c", FILL, str(tmp_path / "disk"), json.dumps(cases)]
    done = subprocess.run([*command, *fill], check=True, capture_output=True, text=True)
    said, kept, still = json.loads(done.stdout)
    assert 0 < sum(kept) < len(cases)
    assert still == kept
    assert len(said) == 2
    for message in said:
        assert "No space left on device" in message
        assert "incoming" not in message


@pytest.mark.drill
def test_timed_runs(tmp_path: Path, make_case: MakeCase) -> None:
    """Speed is measured in runs of their own, at least one, and given per simulated second."""
    result = run_one(make_case("oracle", timed=True), tmp_path / "run.npz")
    assert 1 <= len(result.timings) <= 5
    assert result.seconds_per_second == pytest.approx(statistics.median(result.timings))
    assert run_one(make_case("oracle"), tmp_path / "run.npz").seconds_per_second is None


def test_manifest(tmp_path: Path, make_case: MakeCase) -> None:
    """A trajectory says how it was made: engine, settings, parameters, versions, machine."""
    case = make_case("oracle", settings={"dt": 5e-3}, parameters={"speed": 5.0})
    result = run_one(case, tmp_path / "run.npz")
    attributes = read(tmp_path / "run.npz").attrs
    assert json.loads(attributes["settings"])["dt"] == 5e-3
    assert json.loads(attributes["parameters"])["speed"] == 5.0
    assert json.loads(attributes["versions"]) == result.versions
    assert {"engine", "status", "message", "machine", "scene", "scene_digest"} <= set(attributes)
    assert attributes["engine"] == "oracle"
    assert result.versions.keys() == {"oracle", "proofroll", "python", "numpy", "scipy"}
    assert all(line["holds"] for line in result.certificate)


@pytest.mark.drill
def test_manifest_of_the_truth(tmp_path: Path, make_case: MakeCase) -> None:
    """The truth's file says how it was made as an engine's does, and carries its error bars."""
    facts = resolve([("truth", {})])[0]
    assert isinstance(facts, EngineFacts)
    case = dataclasses.replace(make_case("oracle", parameters={"speed": 5.0}), engine=facts)
    result = run_one(case, tmp_path / "run.npz")
    dataset = read(tmp_path / "run.npz")
    assert dataset.attrs["engine"] == "truth"
    assert json.loads(dataset.attrs["settings"]) == {}
    assert json.loads(dataset.attrs["parameters"])["speed"] == 5.0
    assert json.loads(dataset.attrs["versions"]) == result.versions
    assert dataset["gamma"].attrs["error_bar"] > 0


@pytest.mark.drill
def test_the_time_of_the_truth_has_an_account(tmp_path: Path, make_case: MakeCase) -> None:
    """The truth's time is its own; clean-up, loading and writing are what they are of any run."""
    (facts,) = resolve([("truth", {})])
    assert isinstance(facts, EngineFacts)
    result = run_one(dataclasses.replace(make_case("oracle"), engine=facts), tmp_path / "run.npz")
    assert {"loading", "truth", "writing", "clean-up"} < set(result.spent)
    assert result.processor["truth"] > result.processor["clean-up"]


def test_capabilities_are_checked_before_anything_is_built(tmp_path: Path, make_case: MakeCase) -> None:
    """A scene that needs what the engine does not provide is refused by the words of what is lacking."""
    case = make_case("oracle", parameters={"rolling_resistance": 1e-4})
    result = run_one(case, tmp_path / "run.npz")
    assert result.status is Status.REFUSED
    assert result.message.startswith(
        "needs friction of contacts against rolling and spinning; no formulation of oracle's adapter has"
    )


def test_describe() -> None:
    """An engine is described by itself, from a process of its own."""
    found = describe("oracle")
    assert found.version == "1"
    of_contact = ["contact between bodies", "contact of spheres", "contact with bores"]
    assert found.provides == {"only": [*of_contact, "contacts that never slip (friction = inf)"]}
    assert found.presets == {"only": {"matched": {"formulation": "only", "preset": "matched", "dt": 1e-2}}}
    assert found.summary.startswith("Well-behaved")


def test_describe_what_cannot_be_described() -> None:
    """A missing, a broken and an unknown engine are told apart."""
    with pytest.raises(Missing, match="absent"):
        describe("absent")
    with pytest.raises(WorkerDied, match="NoSuchClass"):
        describe("misspelt")
    with pytest.raises(InputError, match="no such engine"):
        describe("unheard_of")


@pytest.mark.drill
def test_resolve_gives_each_answer_in_its_place() -> None:
    """Settings of several engines come back in the order asked, each as facts or as its own error."""
    found = resolve(
        [("oracle", {"dt": "5e-3"}), ("absent", {}), ("oracle", {"dt": "x"}), ("truth", {}), ("truth", {"dt": 1})]
    )
    assert [type(item) for item in found] == [EngineFacts, Missing, InputError, EngineFacts, InputError]
    assert isinstance(found[0], EngineFacts)
    assert found[0].settings == {"formulation": "only", "preset": "matched", "dt": 5e-3}
    assert found[0].resolution == "dt"


@pytest.mark.drill
@pytest.mark.own_workers
def test_code_hash_follows_the_adapter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A change in the adapter's file changes the hash, so that no stored result outlives it."""
    text = Path(__file__).parents[2].joinpath("plugins", "hostile.py").read_text(encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}{os.pathsep}{os.environ['PYTHONPATH']}")
    hashes = []
    for content in (text, text + "\n# changed\n"):
        (tmp_path / "hostile.py").write_text(content, encoding="utf-8")
        facts = resolve([("oracle", {})])[0]
        assert isinstance(facts, EngineFacts)
        hashes.append(facts.code)
    assert hashes[0] != hashes[1]


@pytest.mark.drill
def test_what_an_engine_does_to_its_judge_reaches_no_other_row(tmp_path: Path, make_case: MakeCase) -> None:
    """A row whose engine changed what judges it is not believed, and its process judges no further one."""
    bent, honest = make_case("judges_itself"), make_case("oracle")
    workers = Workers()
    with workers.lend("oracle") as worker:
        first = worker._process.pid
    workers.rename("oracle", "judges_itself")  # they may serve one distribution
    results = Runner(Store(tmp_path), jobs=1, workers=workers).run([bent, honest])
    assert [results[case.key].status for case in (bent, honest)] == [Status.CRASHED, Status.DONE]
    with workers.lend("oracle") as worker:
        assert worker._process.pid != first
    workers.close()
