"""Cases on a Dask cluster: real schedulers and workers, as processes of this machine."""

from __future__ import annotations

import dataclasses
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from hostile import ENTRY_POINTS
from robot_templates import urdf

from proofroll.core.errors import InputError, ProofrollError
from proofroll.files.data_folders import data_folder
from proofroll.files.scene_file import load_scene, scene_folder
from proofroll.files.trajectory_file import read
from proofroll.papers.blajer_2006.slip.regimes import regime_map
from proofroll.running.case import Case, EngineFacts, Status
from proofroll.running.engine_questions import resolve
from proofroll.running.idle_workers import Workers
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll.studies.cases import case_of, single_case
from proofroll_benchmarks.cluster import idle
from proofroll_cluster import cluster
from proofroll_cluster.cluster import Cluster, _files
from proofroll_drill.processes import alive

HOST = socket.gethostname()
ASKED = Workers()
PLUGINS = Path(__file__).parents[2] / "plugins"


def case(engine: str, speed: float = 4.0, scene: str = "sphere_in_cylinder") -> Case:
    """A short case with the engine's own facts."""
    found = single_case(scene, {"speed": speed}, engine, until=0.1, every=0.05, time_limit=60.0, workers=ASKED)
    return dataclasses.replace(with_code(found), timed=True)


def with_code(found: Case) -> Case:
    """The case with the hash of its engine's code, as of a run that is stored."""
    formulation = {key: value for key, value in found.engine.settings.items() if key == "formulation"}
    (facts,) = resolve([(found.engine.name, formulation)], ASKED)
    assert isinstance(facts, EngineFacts)
    return dataclasses.replace(found, engine=dataclasses.replace(found.engine, code=facts.code))


def at_home(store: Store) -> Runner:
    """Runs cases here, in the processes that have been asked for facts: to start others costs more than the cases."""
    runner = Runner(store, jobs=1)
    runner.workers = ASKED
    return runner


def until(ready: Callable[[], object]) -> None:
    """Waits for something that other processes do."""
    deadline = time.monotonic() + 300
    while not ready():
        assert time.monotonic() < deadline
        time.sleep(0.05)


class DaskCluster:
    """A scheduler and its workers, each a process as a person would start it, forked from one that has imported Dask.

    Attributes:
        processes: their numbers, the scheduler's first.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._file = folder / "scheduler.json"
        with (folder / "dask.log").open("wb") as log:
            self._forks = subprocess.Popen(
                [sys.executable, str(PLUGINS / "dask_processes.py")],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                text=True,
            )
        self.processes: list[int] = []
        self.scheduler = self._start("scheduler", "--port", "0", "--no-dashboard")
        until(self._announced)
        self.address = json.loads(self._file.read_text())["address"]

    def _announced(self) -> bool:
        """True once the scheduler has written its file to the end."""
        return self._file.exists() and self._file.read_text().rstrip().endswith("}")

    def worker(self) -> int:
        """One more worker of one thread."""
        return self._start("worker", "--nthreads", "1", "--no-nanny", "--no-dashboard")

    def _start(self, *words: str) -> int:
        assert self._forks.stdin
        assert self._forks.stdout
        self._forks.stdin.write(json.dumps([*words, "--scheduler-file", str(self._file)]) + "\n")
        self._forks.stdin.flush()
        self.processes.append(int(self._forks.stdout.readline()))
        return self.processes[-1]

    def one_worker(self) -> None:
        """At least one worker, whichever tests ran before."""
        if not any(map(alive, self.processes[1:])):
            self.worker()

    def close(self) -> None:
        """Ends all of it."""
        for process in filter(alive, self.processes):
            os.kill(process, signal.SIGKILL)
        self._forks.communicate()


def announce(site: Path, patch: pytest.MonkeyPatch) -> None:
    """Announces engines of ``tests/plugins``, to this process and to all that it starts."""
    info = site / "throwaway-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: throwaway\nVersion: 1.0\n")
    engines = ENTRY_POINTS | {"waiting": "waiting:Waiting"}
    lines = [f"{name} = {target}" for name, target in engines.items()]
    (info / "entry_points.txt").write_text("\n".join(["[proofroll.engines]", *lines, ""]))
    places = [str(site), str(PLUGINS), *filter(None, [os.environ.get("PYTHONPATH")])]
    patch.setenv("PYTHONPATH", os.pathsep.join(places))
    patch.syspath_prepend(str(site))


@pytest.fixture(scope="module")
def dask(tmp_path_factory: pytest.TempPathFactory) -> Iterator[DaskCluster]:
    """A cluster where the engines of ``tests/plugins`` are installed; it costs more than all that runs on it."""
    folder = tmp_path_factory.mktemp("dask")
    with pytest.MonkeyPatch.context() as patch:
        announce(folder / "site", patch)
        patch.setenv("WAITING_ROOM", str(folder))
        patch.setenv("DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED", "False")  # a hundred looks a second
        found = DaskCluster(folder)
        yield found
        found.close()
        ASKED.close()


@pytest.fixture(scope="module")
def shared(dask: DaskCluster) -> Cluster:
    """One command for several tests: each has processes of its own at every worker, and to start them costs most."""
    return Cluster(dask.address)


@pytest.fixture
def room(dask: DaskCluster) -> Path:
    """Where :class:`waiting.Waiting` waits, empty."""
    for file in [*dask.folder.glob("begun-*"), dask.folder / "go"]:
        file.unlink(missing_ok=True)
    return dask.folder


@pytest.mark.nightly
def test_a_worker_with_other_engines(dask: DaskCluster, shared: Cluster, tmp_path: Path) -> None:
    """A worker that has not the same versions and engines is refused, with what both have."""
    other = tmp_path / "other"
    shutil.copytree(dask.folder / "site" / "throwaway-1.0.dist-info", other / "throwaway-2.0.dist-info")
    text = (other / "throwaway-2.0.dist-info" / "METADATA").read_text()
    (other / "throwaway-2.0.dist-info" / "METADATA").write_text(text.replace("Version: 1.0", "Version: 2.0"))
    dask.one_worker()
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(other))
        runner = Runner(Store(tmp_path / "store"), cluster=Cluster(dask.address))
        with pytest.raises(ProofrollError, match=r"other versions: here throwaway 2\.0; there throwaway 1\.0;"):
            runner.run([case("oracle")])
    # The same packages, another code of the adapter: the case would have another key there.
    asked = dataclasses.replace(case("oracle"), engine=dataclasses.replace(case("oracle").engine, code="other"))
    with pytest.raises(ProofrollError, match=r"here oracle 1 \(code other\); there oracle 1 \(code \w+\)"):
        Runner(Store(tmp_path / "store"), cluster=shared).run([asked])
    asked = dataclasses.replace(case("oracle"), scene_digest="other")
    with pytest.raises(ProofrollError, match=r"here scene sphere_in_cylinder other; there scene"):
        Runner(Store(tmp_path / "store"), cluster=shared).run([asked])


@pytest.mark.nightly
def test_results_are_those_of_home(dask: DaskCluster, shared: Cluster, tmp_path: Path, room: Path) -> None:
    """One worker, two, and one that is lost in the middle give what home gives, stored once, but for speeds."""
    shutil.copytree(data_folder("models") / "sphere_in_cylinder", tmp_path / "mine" / "my_plane")
    own = str(tmp_path / "mine" / "my_plane")
    robot = tmp_path / "arm.urdf"
    robot.write_text(urdf(kinds=("revolute", "fixed", "fixed")), encoding="utf-8")
    some = [case("oracle"), case("exits"), case("oracle", 1.5, own)]
    of_robot = single_case(str(robot), {}, "projection", until=0.02, every=0.01, time_limit=60.0, workers=ASKED)
    some += [with_code(of_robot)]
    waiting = [case("waiting", speed) for speed in (3.0, 3.5)]
    home, away = Store(tmp_path / "home"), Store(tmp_path / "away")

    dask.one_worker()
    first = Runner(away, cluster=shared).run(some)
    lost = dask.worker()
    thread = threading.Thread(target=lambda: first.update(Runner(away, cluster=shared).run(waiting)))
    thread.start()
    until(lambda: list(room.glob(f"begun-{lost}-*")) and len(list(room.glob("begun-*"))) == 2)
    os.kill(lost, signal.SIGKILL)
    (room / "go").touch()
    thread.join()

    expected = at_home(home).run([*some, *waiting])
    assert first.keys() == expected.keys()
    for one in [*some, *waiting]:
        here, there = expected[one.key], first[one.key]
        assert (there.status, there.message, there.certificate) == (here.status, here.message, here.certificate)
        assert there.seconds_per_second is None
        if there.trajectory is not None:
            assert there.host == HOST
            assert read(away.trajectory(one)).equals(read(home.trajectory(one)))
    names = [sorted(path.name for path in store.folder.iterdir()) for store in (home, away)]
    assert names[0] == names[1]

    again = Runner(away, cluster=shared)
    again.run(waiting)
    assert again.reused == len(waiting)
    measured = at_home(away).run([some[0]])[some[0].key]
    assert (measured.host, measured.seconds_per_second is not None) == ("", True)

    assert [found for _, found in shared.map(partial(np.add, 1), [1, 2, 3])] == [2, 3, 4]
    with pytest.raises(ProofrollError, match="ZeroDivisionError"):
        list(shared.map(partial(divmod, 1), [1, 0]))
    grid = partial(regime_map, load_scene("sphere_in_cylinder"), [2.0, 4.0], [0.1, 0.9], until=0.2)
    one, other = grid(), grid(cluster=shared)
    assert other.equals(one)
    assert (one.attrs["ran_on"], other.attrs["ran_on"]) == ("", HOST)


@pytest.mark.nightly
def test_runs_one_after_another(dask: DaskCluster, tmp_path: Path) -> None:
    """Each run has its own results, though Dask tells of the last of a run when the next has begun."""
    dask.one_worker()
    runner = Runner(Store(tmp_path / "store"), cluster=Cluster(dask.address, idle))
    facts = EngineFacts("idle", "1", "none", {"seconds": 0.0})
    for number in range(4):
        cases = [Case("", {"speed": 100.0 * number + item}, "none", facts, 1.0, 0.1) for item in range(10)]
        assert runner.run(cases).keys() == {case.key for case in cases}


@pytest.mark.nightly
def test_a_scene_that_cannot_be_read(
    dask: DaskCluster, shared: Cluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is refused with its reason, as at home; the cluster goes on with the others."""
    dask.one_worker()
    folder = tmp_path / "my_plane"
    shutil.copytree(data_folder("models") / "sphere_in_cylinder", folder)
    lost, sound = case("oracle", 1.5, str(folder)), case("oracle")
    (folder / "scene.toml").unlink()
    (folder / "scene.toml").symlink_to("scene.toml")  # cannot be read, by the superuser either
    monkeypatch.setattr(cluster, "scene_folder", lambda name: folder if name == str(folder) else scene_folder(name))
    found = Runner(Store(tmp_path / "store"), cluster=shared).run([lost, sound])
    assert found[sound.key].status is Status.DONE
    assert found[lost.key].status is Status.REFUSED
    assert re.search(r"scene.toml cannot be read: Too many", found[lost.key].message)


def test_what_a_scene_needs_travels(tmp_path: Path) -> None:
    """A scene's folder is sent as its scene.toml and the files that it names, without what else lies there."""
    folder = tmp_path / "own"
    shutil.copytree(data_folder("models") / "sphere_in_cylinder", folder)
    (folder / "run.nc").write_bytes(b"x" * 1000)
    (folder / "other.xml").write_text("<mujoco/>")
    engine = EngineFacts("projection", "1", "code", {})
    sent = _files(case_of(str(folder), load_scene(str(folder)), (), engine, 1.0, 0.1))
    assert sorted(sent) == ["mujoco_chart.xml", "scene.toml"]


@pytest.mark.drill
def test_a_scheduler_that_ends(dask: DaskCluster, shared: Cluster, tmp_path: Path, room: Path) -> None:
    """One line says so; what was finished is stored, and the next run makes the rest alone."""
    dask.one_worker()
    store = Store(tmp_path / "store")
    done, rest = case("oracle"), case("waiting")
    runner = Runner(store, cluster=shared)

    def then(*_: object) -> list[Case]:
        threading.Thread(target=end).start()
        return [rest]

    def end() -> None:
        until(lambda: list(room.glob("begun-*")))
        os.kill(dask.scheduler, signal.SIGKILL)

    with pytest.raises(ProofrollError, match=r"scheduler at tcp://\S+ is gone; finished runs are kept") as found:
        runner.follow([done], lambda asked, _: then() if asked is done else [])
    assert "\n" not in str(found.value)
    (room / "go").touch()
    assert store.get(done) is not None
    assert at_home(store).run([rest])[rest.key].status is Status.DONE


def test_an_address_that_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is no address, and where nothing answers, is one line; the tracker of processes says nothing."""
    told: list[list[str]] = []
    monkeypatch.setattr(cluster.resource_tracker, "ensure_running", lambda: told.append([*sys.warnoptions]))
    monkeypatch.setattr(cluster, "_PATIENCE", 1.0)
    with pytest.raises(InputError, match="give the address of a Dask scheduler"):
        Cluster("nowhere")
    with pytest.raises(InputError, match="no Dask scheduler answers there"):
        Cluster("tcp://127.0.0.1:1")
    assert [options[-1] for options in told] == ["ignore"]
    assert sys.warnoptions[-1:] != ["ignore"]


@pytest.mark.nightly
def test_ctrl_c(tmp_path: Path, room: Path) -> None:
    """Ctrl-C ends the command, its cluster and the process of the case, with one line."""
    (tmp_path / "waits.toml").write_text(
        'title = "t"\nquestion = "q"\nscene = "sphere_in_cylinder"\nuntil = 0.1\nevery = 0.05\n'
        '[tolerances.a]\nbecause = "b"\nz = "1 %"\n'
        '[[rows]]\nengine = "waiting"\ntolerance = "a"\nexpect = ["unconfirmed"]\nbecause = "c"\nladder = [1]\n'
    )
    start = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
    words = ["compare", str(tmp_path / "waits.toml"), "--scheduler", "local:1", "--out", str(tmp_path / "out")]
    process = subprocess.Popen(
        [sys.executable, "-c", f"{start}from proofroll.__main__ import main; main()", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        until(lambda: list(room.glob("begun-*")) or process.poll() is not None)
        os.killpg(process.pid, signal.SIGINT)
        out, err = process.communicate(timeout=120)
    finally:
        process.kill()
    progress = (" of 2, ", " of 2 runs, ", " done after ")
    lines = [line for line in err.splitlines() if not any(part in line for part in progress)]
    assert (process.returncode, out) == (130, "")
    assert lines == ["proofroll: interrupted; cases that were finished and stored will be reused"]
    (begun,) = room.glob("begun-*")
    until(lambda: not Path(f"/proc/{begun.name.split('-')[2]}").exists())
