"""Side of a Dask worker: runs one case in the same kind of watched process as a local run."""

import base64
import collections
import dataclasses
import pickle
import platform
import re
import socket
import tempfile
import threading
from collections.abc import Callable, Mapping
from importlib.metadata import requires
from pathlib import Path
from typing import Any

import proofroll
from proofroll.core.entry_points import announced
from proofroll.core.errors import InputError, ProofrollError
from proofroll.core.plugins import GROUP, distribution_of
from proofroll.files.scene_file import load_scene
from proofroll.files.trajectory_file import STORED
from proofroll.running.case import Case, EngineFacts
from proofroll.running.engine_questions import resolve
from proofroll.running.identity import digest, versions_of
from proofroll.running.idle_workers import Workers
from proofroll.running.process import WorkerDied
from proofroll.running.runner import result_without_answer, run_one

# Engines and commands for which a Dask worker keeps processes between cases.
_ENGINES, _COMMANDS = 2, 3
# Time limit of a function in its process [s].
_HANGS = 3600.0

_lock = threading.Lock()
_workers: collections.OrderedDict[str, Workers] = collections.OrderedDict()
_same: set[tuple[str, str, str]] = set()


class Unfit(ProofrollError):  # noqa: N818 -- a fact about a worker, which ends the command that met it
    """A Dask worker's installation differs from that of the command's machine, so its results would differ."""


@dataclasses.dataclass(frozen=True)
class Asked:
    """Request of a command to every Dask worker.

    Attributes:
        command: unique name of the command, under which its processes are kept and ended.
        installed: versions that decide results on the command's machine, see :func:`installed`.
        memory: limit for each process [GB]; None: the default of the worker's machine.
    """

    command: str
    installed: Mapping[str, str]
    memory: float | None = None


def installed() -> dict[str, str]:
    """Versions of Python, proofroll (with a hash of its code), engines and all packages that they need.

    They are read from the metadata of packages; no engine is imported.
    """
    engines = announced(GROUP)
    extras = {point.name for point in engines} | {"fast"}
    names = {point.dist.name for point in engines if point.dist is not None}
    for text in [text for name in sorted(names) for text in requires(name) or []]:
        extra = re.search(r"extra == ['\"](\w+)['\"]", text)
        if extra is None or extra[1] in extras:
            names.add(distribution_of(text))
    root = Path(proofroll.__file__).parent
    packages = {"python": platform.python_version(), "proofroll's code": digest([root / "engines", root / "truth"])}
    return packages | dict.fromkeys(sorted(names, key=str.lower), "absent") | versions_of(names)


def run_case(asked: Asked, content: dict[str, Any], files: Mapping[str, bytes]) -> tuple[dict[str, Any], bytes | None]:
    """Runs a case; returns its result as a dictionary, and the bytes of its trajectory or None.

    Args:
        asked: request of the command.
        content: the case as a dictionary.
        files: files of a scene that is not part of proofroll, by name: of its folder, or the robot file itself.

    Raises:
        Unfit: results here would differ from those of the command's machine.
    """
    case = Case.from_dict(content)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if files:
            scene = folder / Path(case.scene).name
            if scene.name not in files:  # a folder, and not the file of a robot
                scene.mkdir()
            for file, text in files.items():
                (scene / file if scene.is_dir() else scene).write_bytes(text)
            case = dataclasses.replace(case, scene=str(scene))
        workers = _workers_of(asked)
        _check(asked, case, workers)
        out = folder / f"run{STORED}"
        try:
            result = run_one(case, out, workers)
        except InputError as error:
            result = result_without_answer(case, error)
        content = dataclasses.asdict(dataclasses.replace(result, host=socket.gethostname()))
        return content, out.read_bytes() if result.trajectory is not None else None


def call(asked: Asked, function: Callable[[Any], Any], item: Any) -> tuple[str, Any]:
    """The machine's name and the result of a function for an item, computed in a watched process.

    Raises:
        Unfit: as :func:`run_case`.
        ProofrollError: the process ended, or the function raised it.
    """
    workers = _workers_of(asked)
    text = base64.b64encode(pickle.dumps((function, item))).decode()
    request = {"do": "call", "function": f"{__name__}:computed", "arguments": {"text": text}}
    try:
        with workers.lend("") as worker:
            answer = worker.request(request, _HANGS)
    except ProofrollError as error:  # subclasses with further arguments cannot be unpickled
        raise ProofrollError(str(error)) from None
    return socket.gethostname(), pickle.loads(base64.b64decode(answer["text"]))


def computed(text: str) -> dict[str, str]:
    """Part of :func:`call` that runs in the watched process."""
    function, item = pickle.loads(base64.b64decode(text))
    return {"text": base64.b64encode(pickle.dumps(function(item))).decode()}


def end(command: str) -> None:
    """Ends all processes of a command on this machine, also those that run a case."""
    with _lock:
        workers = _workers.pop(command, None)
    if workers is not None:
        workers.kill()


def _workers_of(asked: Asked) -> Workers:
    """Processes of a command, after its versions were compared; closes those of the longest unused commands."""
    with _lock:
        is_running = asked.command in _workers
    if not is_running:
        present = installed()
        differing = [name for name in {**asked.installed, **present} if asked.installed.get(name) != present.get(name)]
        if differing:
            sides = (asked.installed, present)
            raise unfit(*({name: versions.get(name, "absent") for name in differing} for versions in sides))
    with _lock:
        workers = _workers.setdefault(asked.command, Workers(asked.memory, _ENGINES))
        _workers.move_to_end(asked.command)
        surplus = [_workers.popitem(last=False)[1] for _ in range(len(_workers) - _COMMANDS)]
    for old in surplus:
        old.close()
    return workers


def _check(asked: Asked, case: Case, workers: Workers) -> None:
    """Raises Unfit unless the engine, with all that decides its results, and the scene are the same on this machine."""
    engine = case.engine
    key = asked.command, engine.name, engine.code
    if key not in _same:
        (facts,) = resolve([(engine.name, engine.settings)], workers)
        if isinstance(facts, EngineFacts):
            worker_versions = {engine.name: f"{facts.version} (code {facts.code})"}
        elif isinstance(facts, WorkerDied):
            return  # a crash of the engine becomes its result, as in a local run
        else:
            worker_versions = {engine.name: f"none ({facts})"}
        command_versions = {engine.name: f"{engine.version} (code {engine.code})"}
        if command_versions != worker_versions:
            raise unfit(command_versions, worker_versions)
        _same.add(key)
    digest = load_scene(case.scene, asks=case.asks, **case.parameters).digest
    if digest != case.scene_digest:
        raise unfit({f"scene {case.scene}": case.scene_digest}, {f"scene {case.scene}": digest})


def unfit(command_versions: Mapping[str, str], worker_versions: Mapping[str, str]) -> Unfit:
    """Error that names the differing versions, of the command's machine and of this one."""
    sides = command_versions, worker_versions
    here_text, there_text = (", ".join(f"{name} {value}" for name, value in side.items()) for side in sides)
    fault = (
        f"a worker of the cluster, on {socket.gethostname()}, has other versions: here {here_text}; there {there_text}"
    )
    return Unfit(f"{fault}; install the same on both")
