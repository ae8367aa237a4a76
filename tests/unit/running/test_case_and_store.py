from __future__ import annotations

import dataclasses
import hashlib
import json
import os
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from proofroll.core.errors import ProofrollError
from proofroll.running.case import Case, Result, Status
from proofroll.running.store import Store, alone_in, write_text

MakeCase = Callable[..., Case]


@pytest.fixture
def stored(tmp_path: Path, make_case: MakeCase) -> tuple[Store, Case, Result]:
    """A store with one finished case."""
    store, case = Store(tmp_path / "cases"), make_case("oracle")
    store.trajectory(case).write_bytes(b"a trajectory")
    result = Result(Status.DONE, "reached 2 s", 0.5, 0.1, 0.25, [0.5], [{"quantity": "mass"}], {"oracle": "1"}, "x.npz")
    return store, case, store.put(case, result)


def test_a_result_comes_back(stored: tuple[Store, Case, Result]) -> None:
    """What was stored is found again, equal in every field."""
    store, case, result = stored
    assert store.get(case) == result
    assert Store(store.folder).get(case) == result


def test_absent(tmp_path: Path, make_case: MakeCase) -> None:
    """An empty store has nothing."""
    assert Store(tmp_path).get(make_case("oracle")) is None


@pytest.mark.parametrize("suffix", [".json", ".npz"])
@pytest.mark.parametrize("damage", ["absent", "empty", "truncated", "tampered"])
def test_what_is_not_what_was_stored_counts_as_absent(
    stored: tuple[Store, Case, Result], suffix: str, damage: str
) -> None:
    """A record or trajectory that is gone, cut off or changed is not reused."""
    store, case, _ = stored
    path = store.folder / f"{case.key}{suffix}"
    content = path.read_bytes()
    match damage:
        case "absent":
            path.unlink()
        case "empty":
            path.write_bytes(b"")
        case "truncated":
            path.write_bytes(content[:-5])
        case "tampered":
            path.write_bytes(content.replace(b"done", b"dome").replace(b"trajectory", b"trajectorY", 1))
    assert store.get(case) is None


@pytest.mark.parametrize("text", ["null", "[]", '"done"', "{}", '{"result": null}', '{"result": {"status": "done"}}'])
def test_records_of_another_form_count_as_absent(stored: tuple[Store, Case, Result], text: str) -> None:
    """A record that is JSON but not a record is not reused."""
    store, case, _ = stored
    (store.folder / f"{case.key}.json").write_text(text)
    assert store.get(case) is None


def test_a_number_changed_by_hand_is_not_believed(stored: tuple[Store, Case, Result]) -> None:
    """The record's own numbers are guarded as the trajectory is."""
    store, case, _ = stored
    path = store.folder / f"{case.key}.json"
    record = json.loads(path.read_text())
    record["result"]["seconds_per_second"] = 1e-9
    path.write_text(json.dumps(record))
    assert store.get(case) is None


@pytest.mark.parametrize("status", list(Status))
def test_only_lasting_results_are_kept(tmp_path: Path, make_case: MakeCase, status: Status) -> None:
    """A crash, a hang or a missing engine is tried again next time; an engine's own answer is kept."""
    store, case = Store(tmp_path), make_case("oracle")
    store.put(case, Result(status, "sentence"))
    answers = {Status.DONE, Status.DIVERGED, Status.REFUSED, Status.WRONG_MODEL}
    assert (store.get(case) is not None) == (status in answers)


def test_key_follows_all_that_decides_the_result(make_case: MakeCase) -> None:
    """Another engine, version, adapter, setting, scene or time grid is another case; another time limit is not."""
    case = make_case("oracle")
    others = [
        make_case("other"),
        make_case("oracle", settings={"dt": 1e-3}),
        make_case("oracle", parameters={"speed": 5.0}),
        make_case("oracle", until=0.2),
        make_case("oracle", every=0.01),
        make_case("oracle", timed=True),
        dataclasses.replace(case, engine=dataclasses.replace(case.engine, version="2")),
        dataclasses.replace(case, engine=dataclasses.replace(case.engine, code="other")),
        dataclasses.replace(case, scene_digest="other"),
        dataclasses.replace(case, asks=("orientation",)),
    ]
    assert len({case.key, *(other.key for other in others)}) == 1 + len(others)
    assert make_case("oracle", time_limit=1.0).key == case.key


def test_the_rung_of_an_engine_decides_no_result(make_case: MakeCase) -> None:
    """A formulation that is moved to another rung of the ladder keeps its stored results."""
    case = make_case("oracle")
    assert dataclasses.replace(case, engine=dataclasses.replace(case.engine, level="engine contact")).key == case.key


def test_case_and_result_survive_json(make_case: MakeCase) -> None:
    """A case and a result are the same after a trip through JSON."""
    case = make_case("oracle", settings={"dt": 1e-3, "formulation": "free"}, parameters={"speed": 5.0})
    assert Case.from_dict(json.loads(json.dumps(dataclasses.asdict(case)))) == case
    result = Result(Status.DIVERGED, "at 1 s", timings=[1.0], trajectory="x.npz", checksum="abc")
    assert Result.from_dict(json.loads(json.dumps(dataclasses.asdict(result)))) == result


def test_text_is_written_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A failure before the last moment leaves the old text and no scraps."""
    path = tmp_path / "record.json"
    write_text(path, "old")

    def refuse(self: Path, target: Path) -> None:  # noqa: ARG001 -- stands in for a method
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", refuse)
    with pytest.raises(ProofrollError, match="No space left on device"):
        write_text(path, "new")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_files_can_be_read_by_others(tmp_path: Path) -> None:
    """A result has the permissions of an ordinary file, not those of a temporary one."""
    write_text(tmp_path / "record.json", "text")
    (tmp_path / "ordinary").write_text("text")
    modes = {(tmp_path / name).stat().st_mode for name in ("record.json", "ordinary")}
    assert len(modes) == 1


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_without_permission(tmp_path: Path) -> None:
    """A folder that may not be written is refused before anything is run."""
    tmp_path.chmod(0o500)
    with pytest.raises(ProofrollError, match="choose another folder with --out"):
        Store(tmp_path / "cases")
    tmp_path.chmod(0o700)


def test_a_folder_that_is_a_file(tmp_path: Path) -> None:
    """A file where the folder should be is refused before anything is run."""
    (tmp_path / "cases").write_text("")
    with pytest.raises(ProofrollError, match="choose another folder with --out"):
        Store(tmp_path / "cases")


@pytest.mark.nightly_of("True")
@pytest.mark.drill
@pytest.mark.parametrize("there", [False, True])
def test_a_wrong_name_leaves_no_folder(tmp_path: Path, there: bool) -> None:
    """A command that ends before anything is stored takes the folders away that it made, and no others."""
    out = tmp_path / "new"
    if there:
        out.mkdir()
    command = [sys.executable, "-m", "proofroll", "ladder", "nosuch", "--out", str(out / "results")]
    assert subprocess.run(command, capture_output=True, check=False).returncode == 2
    assert list(tmp_path.rglob("*")) == [out] * there


def made(store: Store, case: Case, content: bytes) -> Result:
    """A trajectory that was made in a folder of its own, and put in place."""
    with store.incoming(case) as written:
        written.write_bytes(content)
        result = Result(Status.DONE, content.decode(), trajectory=written.name)
        return store.put(case, result, written)


def test_a_trajectory_is_put_in_place_with_its_record(tmp_path: Path, make_case: MakeCase) -> None:
    """What was made elsewhere is found again under the case's name, and nothing else is left in the folder."""
    store, case = Store(tmp_path), make_case("oracle")
    result = made(store, case, b"motion")
    assert store.get(case) == result
    assert store.trajectory(case).read_bytes() == b"motion"
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"{case.key}.json", f"{case.key}.npz"]


def test_what_is_left_of_a_case_is_removed(tmp_path: Path, make_case: MakeCase) -> None:
    """A case that fails in the middle leaves neither its trajectory nor what a process wrote beside it."""
    store = Store(tmp_path)

    def fail() -> None:
        with store.incoming(make_case("oracle")) as written:
            written.write_bytes(b"half")
            written.with_name(".scrap").write_bytes(b"half of a half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("failing", ["write_text", "replace"])
def test_a_result_that_cannot_be_stored_costs_no_other(
    tmp_path: Path, make_case: MakeCase, monkeypatch: pytest.MonkeyPatch, failing: str
) -> None:
    """Where the disk is full when a case is run again, the result that was there before is still whole."""
    store, case = Store(tmp_path), make_case("oracle")
    before = made(store, case, b"old")

    def refuse(self: Path, *_: object, **__: object) -> None:  # noqa: ARG001 -- stands in for a method
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(Path, failing, refuse)
        with pytest.raises(ProofrollError, match="No space left on device"):
            made(store, case, b"new")
    assert store.get(case) == before
    assert len(list(tmp_path.iterdir())) == 2


def test_a_trajectory_that_is_not_there(tmp_path: Path, make_case: MakeCase) -> None:
    """A result whose trajectory was promised and not written is refused with one line."""
    store, case = Store(tmp_path), make_case("oracle")
    with store.incoming(case) as written, pytest.raises(ProofrollError, match="cannot be read"):
        store.put(case, Result(Status.DONE, "done", trajectory=written.name), written)
    assert not store.has(case)


@pytest.mark.drill
def test_two_writers_and_a_reader(tmp_path: Path, make_case: MakeCase) -> None:
    """Whoever looks while two runs replace the same result finds one of both, whole, and never none."""
    case = make_case("oracle")
    made(Store(tmp_path), case, b"0")
    script = (
        "import json, sys\nfrom pathlib import Path\nfrom proofroll.running.case import Case, Result, Status\n"
        "from proofroll.running.store import Store\n"
        "store, case = Store(Path(sys.argv[1])), Case.from_dict(json.loads(sys.argv[2]))\n"
        "for number in range(150):\n"
        "    with store.incoming(case) as written:\n"
        "        written.write_text(f'{sys.argv[3]} {number}' * 1000)\n"
        "        store.put(case, Result(Status.DONE, f'{sys.argv[3]} {number}', trajectory=written.name), written)\n"
    )
    content = json.dumps(dataclasses.asdict(case))
    writers = [subprocess.Popen([sys.executable, "-c", script, str(tmp_path), content, name]) for name in "ab"]
    store, seen = Store(tmp_path), set()
    while any(writer.poll() is None for writer in writers):
        result = store.get(case)
        assert result is not None
        seen.add(result.message)
    assert [writer.returncode for writer in writers] == [0, 0]
    assert len(seen) > 2
    last = store.get(case)
    assert last is not None
    assert store.trajectory(case).read_text() == last.message * 1000


@pytest.mark.drill
def test_scraps_are_swept(tmp_path: Path, make_case: MakeCase) -> None:
    """What a killed process left is removed by the next; what another writes into, and what is not ours, stays."""
    (tmp_path / ".other").mkdir()
    (tmp_path / ".incoming-old").mkdir()
    script = (
        "import json, os, signal, sys\nfrom pathlib import Path\nfrom proofroll.running.case import Case\n"
        "from proofroll.running.store import Store\n"
        "case = Case.from_dict(json.loads(sys.argv[2]))\n"
        "with Store(Path(sys.argv[1])).incoming(case) as written:\n"
        "    written.write_text('half')\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    content = json.dumps(dataclasses.asdict(make_case("oracle")))
    subprocess.run([sys.executable, "-c", script, str(tmp_path), content], check=False)
    assert len(list(tmp_path.glob(".incoming-*"))) == 1  # it swept the old one, and left its own
    with Store(tmp_path).incoming(make_case("oracle")) as written:
        Store(tmp_path)
        assert [path.name for path in tmp_path.glob(".incoming-*")] == [written.parent.name]
    assert [path.name for path in tmp_path.iterdir()] == [".other"]


def test_alone_in_a_folder(tmp_path: Path) -> None:
    """Who comes second says so once, and waits until the first is done."""
    said: list[str] = []
    inside = threading.Event()

    def second() -> None:
        with alone_in(tmp_path, lambda: (said.append("waits"), inside.set())):
            said.append("in")

    other = threading.Thread(target=second)
    with alone_in(tmp_path, lambda: said.append("not this one")):
        other.start()
        assert inside.wait(60)
        said.append("first done")
    other.join()
    assert said == ["waits", "first done", "in"]


def test_a_case_that_asks_nothing_keeps_its_key(make_case: MakeCase) -> None:
    """The key is the hash of what it was before a case could ask, so that stored results are found."""
    case = make_case("oracle")
    later = {"time_limit", "asks", "turns", "between", "without_events"}
    content = {key: value for key, value in dataclasses.asdict(case).items() if key not in later}
    for words in ("level", "title", "witness", "provides", "brought", "steps"):
        del content["engine"][words]
    assert case.key == hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:24]
    assert dataclasses.replace(case, turns=True).key != case.key
    asking = dataclasses.replace(case, asks=("orientation",))
    assert Case.from_dict(json.loads(json.dumps(dataclasses.asdict(asking)))) == asking


def test_a_result_belongs_to_its_case(tmp_path: Path, make_case: MakeCase) -> None:
    """Two results whose files were swapped are believed for neither case."""
    store = Store(tmp_path)
    cases = [make_case("oracle", parameters={"speed": speed}) for speed in (3.0, 4.0)]
    for case in cases:
        made(store, case, case.key.encode())
    for suffix in (".json", ".npz"):
        one, other = (tmp_path / f"{case.key}{suffix}" for case in cases)
        one.rename(tmp_path / "aside")
        other.rename(one)
        (tmp_path / "aside").rename(other)
    assert [store.get(case) for case in cases] == [None, None]
    assert all(store.has(case) for case in cases)


def nested(path: Path) -> None:
    """Deeper than any reader of JSON goes."""
    path.write_text("[" * 100_000)


def link_to_device(path: Path) -> None:
    """A file without end."""
    path.symlink_to("/dev/zero")


def folder(path: Path) -> None:
    """A folder that is not empty."""
    (path / "inside").mkdir(parents=True)


@pytest.mark.parametrize("suffix", [".json", ".npz"])
@pytest.mark.parametrize("put", [nested, os.mkfifo, link_to_device, folder])
def test_what_is_no_file_is_damage(tmp_path: Path, make_case: MakeCase, suffix: str, put: Callable[..., None]) -> None:
    """A pipe, a device, a folder or endless nesting is neither waited for nor believed; a new result replaces it."""
    store, case = Store(tmp_path), make_case("oracle")
    made(store, case, b"motion")
    path = tmp_path / f"{case.key}{suffix}"
    path.unlink()
    put(path)
    assert store.get(case) is None
    assert store.has(case)
    result = made(store, case, b"motion")
    assert store.get(case) == result
    assert path.is_file()
    assert not path.is_symlink()


def test_a_link_that_leads_nowhere_is_damage(tmp_path: Path, make_case: MakeCase) -> None:
    """A record that is a broken link is there, and is no result."""
    store, case = Store(tmp_path), make_case("oracle")
    (tmp_path / f"{case.key}.json").symlink_to(tmp_path / "nowhere")
    assert store.has(case)
    assert store.get(case) is None
