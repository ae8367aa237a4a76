"""Worker of a Dask cluster: one case in the same watched process that would run it at home."""

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
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from typing import Any

import proofroll
from proofroll.core.announced import announced
from proofroll.core.errors import InputError, ProofrollError
from proofroll.core.plugins import GROUP
from proofroll.files.scene_file import load_scene
from proofroll.files.trajectory_file import STORED
from proofroll.running.asking import resolve
from proofroll.running.case import Case, EngineFacts, Status
from proofroll.running.identity import digest
from proofroll.running.process import WorkerDied
from proofroll.running.runner import ended, run_one
from proofroll.running.worker_pool import Workers

# Processes are kept between the cases of a command, in each Dask worker for so many engines and commands.
_ENGINES, _COMMANDS = 2, 3
# A function that takes longer in its process [s] hangs.
_HANGS = 3600.0

_lock = threading.Lock()
_workers: collections.OrderedDict[str, Workers] = collections.OrderedDict()
_same: set[tuple[str, str, str]] = set()


class Unfit(ProofrollError):  # noqa: N818 -- a fact about a worker, which ends the command that met it
    """Error: a Dask worker differs from this machine's installation, so that cases would have other results."""


@dataclasses.dataclass(frozen=True)
class Asked:
    """Request of a command to every Dask worker.

    Attributes:
        command: a name of its own, under which its processes are kept and ended.
        installed: versions on which results hang, where the command runs; see :func:`installed`.
        memory: limit for each process [GB]; None: what the worker's own machine has by default.
    """

    command: str
    installed: Mapping[str, str]
    memory: float | None = None


def installed() -> dict[str, str]:
    """Versions of Python, of proofroll with a hash of its code, of every engine and of what engines and truths need.

    It comes from the metadata of packages: no engine is imported.
    """
    engines = announced(GROUP)
    extras = {point.name for point in engines} | {"fast"}
    names = {point.dist.name for point in engines if point.dist is not None}
    for text in [text for name in sorted(names) for text in requires(name) or []]:
        extra = re.search(r"extra == ['\"](\w+)['\"]", text)
        if extra is None or extra[1] in extras:
            names.add(re.split(r"[\s;<>=!~\[(]", text, maxsplit=1)[0])
    root = Path(proofroll.__file__).parent
    versions_of = {"python": platform.python_version(), "proofroll's code": digest([root / "engines", root / "truth"])}
    for name in sorted(names, key=str.lower):
        try:
            versions_of[name] = version(name)
        except PackageNotFoundError:
            versions_of[name] = "absent"
    return versions_of


def run_case(asked: Asked, content: dict[str, Any], files: Mapping[str, bytes]) -> tuple[dict[str, Any], bytes | None]:
    """Runs a case; its result as a dictionary, with the machine's name, and the file of its trajectory, if any.

    Where the scene does not come with proofroll, ``files`` has those of its folder by name, or the one that is it.

    Raises:
        Unfit: results here are not those of the command's own machine.
    """
    case = Case.from_dict(content)
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        if files:
            scene = place / Path(case.scene).name
            if scene.name not in files:  # a folder, and not the file of a robot
                scene.mkdir()
            for file, text in files.items():
                (scene / file if scene.is_dir() else scene).write_bytes(text)
            case = dataclasses.replace(case, scene=str(scene))
        workers = _workers_of(asked)
        _check(asked, case, workers)
        out = place / f"run{STORED}"
        try:
            result = run_one(case, out, workers)
        except InputError as error:
            result = ended(case, Status.REFUSED, error)
        said = dataclasses.asdict(dataclasses.replace(result, host=socket.gethostname()))
        return said, out.read_bytes() if result.trajectory is not None else None


def call(asked: Asked, function: Callable[[Any], Any], item: Any) -> tuple[str, Any]:
    """Result of a function for an item, computed in a watched process, after the machine's name.

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
    except ProofrollError as error:  # those with further arguments do not survive pickling
        raise ProofrollError(str(error)) from None
    return socket.gethostname(), pickle.loads(base64.b64decode(answer["text"]))


def computed(text: str) -> dict[str, str]:
    """The watched process's side of :func:`call`."""
    function, item = pickle.loads(base64.b64decode(text))
    return {"text": base64.b64encode(pickle.dumps(function(item))).decode()}


def end(command: str) -> None:
    """Ends all processes of a command here, also those that run a case."""
    with _lock:
        workers = _workers.pop(command, None)
    if workers is not None:
        workers.kill()


def _workers_of(asked: Asked) -> Workers:
    """The processes of a command; of commands that have not been heard of for longest, idle ones are ended."""
    with _lock:
        known = asked.command in _workers
    if not known:
        here = installed()
        other = [name for name in {**asked.installed, **here} if asked.installed.get(name) != here.get(name)]
        if other:
            raise unfit(*({name: workers.get(name, "absent") for name in other} for workers in (asked.installed, here)))
    with _lock:
        workers = _workers.setdefault(asked.command, Workers(asked.memory, _ENGINES))
        _workers.move_to_end(asked.command)
        surplus = [_workers.popitem(last=False)[1] for _ in range(len(_workers) - _COMMANDS)]
    for old in surplus:
        old.close()
    return workers


def _check(asked: Asked, case: Case, workers: Workers) -> None:
    """Checks that the case is the same here: its engine with all that decides its results, and its scene."""
    engine = case.engine
    known = asked.command, engine.name, engine.code
    if known not in _same:
        (facts,) = resolve([(engine.name, engine.settings)], workers)
        if isinstance(facts, EngineFacts):
            there = {engine.name: f"{facts.version} (code {facts.code})"}
        elif isinstance(facts, WorkerDied):
            return  # as at home: what the engine does is a row
        else:
            there = {engine.name: f"none ({facts})"}
        here = {engine.name: f"{engine.version} (code {engine.code})"}
        if here != there:
            raise unfit(here, there)
        _same.add(known)
    digest = load_scene(case.scene, asks=case.asks, **case.parameters).digest
    if digest != case.scene_digest:
        raise unfit({f"scene {case.scene}": case.scene_digest}, {f"scene {case.scene}": digest})


def unfit(here: Mapping[str, str], there: Mapping[str, str]) -> Unfit:
    """The error that names what differs, as the command's own machine and this one have it."""
    one, other = (", ".join(f"{name} {value}" for name, value in versions.items()) for versions in (here, there))
    said = f"a worker of the cluster, on {socket.gethostname()}, has other versions: here {one}; there {other}"
    return Unfit(f"{said}; install the same on both")
