"""Reading of a file by an engine in a separate process: request and answer, both sides of the pipe."""

import contextlib
import copy
import dataclasses
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np

from proofroll.core.entry_points import announced
from proofroll.core.errors import InputError, Missing, Refused, require_known
from proofroll.core.plugins import KNOWN_TITLES, engine_names, plain_name
from proofroll.files.json_data import plain
from proofroll.robots.files.robot_file import RobotFile
from proofroll.robots.model import Cord, Mimic, Robot, RobotActuator, RobotBody, RobotJoint, RobotLoop, Tie
from proofroll.robots.protocol import GROUP, Reading, Request, Whole
from proofroll.robots.states import RobotStates
from proofroll.running.loading import local_name
from proofroll.running.process import Worker

_BY_JOINT = ("mass", "com", "inertia", "position", "rotation")
# Exceptions that come from a mistake in a reader, not from an importer.
_OF_A_READER = (AttributeError, TypeError, NameError, LookupError, ImportError)
_ARRAYS = ("M", "g", "h", "inverse", "forward")


def require_reader(name: str) -> None:
    """Raises InputError if no installed package announces a reader for this engine."""
    require_known("engine", name, engine_names(GROUP), "it reads no robot files; choose one of")


def load_reader(name: str) -> Any:
    """Instance of an engine's reader.

    Raises:
        InputError: no installed package announces one for this engine.
        Missing: a package that it needs is not installed.
    """
    require_reader(name)
    point = next(point for point in announced(GROUP) if point.name == name)
    try:
        reader = point.load()()
        reader.version()
    except ModuleNotFoundError as error:
        raise Missing(f"{name} is not installed here ({error.name or error} is missing)") from None
    return reader


@dataclasses.dataclass(frozen=True)
class ReaderAnswer:
    """Answer of a reader.

    Attributes:
        version: version of the engine.
        says, tolerances, fed: see :class:`proofroll.robots.protocol.RobotReader`.
        reading: model that the engine holds; None: it refused.
        refused: reason of the refusal, in the engine's words.
    """

    version: str
    says: str
    tolerances: dict[str, float]
    reading: Reading | None
    refused: str
    fed: bool = False


class AsWritten(NamedTuple):
    """Totals that an engine reads from the unchanged file; or None, and the reason of its refusal."""

    whole: Whole | None
    refused: str


def ask(worker: Worker, engine: str, request: Request, folder: Path, time_limit: float) -> ReaderAnswer:
    """Asks the worker to read a file and to evaluate it.

    Raises:
        WorkerDied: the process crashed or took longer than ``time_limit`` [s].
        InputError, Missing: see :func:`load_reader`; or the engine has no such option.
    """
    asked, arrays = folder / "request.json", folder / "answer.npz"
    asked.write_text(json.dumps(plain(request) | {"path": str(request.path)}), encoding="utf-8")
    answer = worker.request(call(read_robot, engine=engine, asked=str(asked), arrays=str(arrays)), time_limit)
    if answer["title"]:  # without it, readers of the answer load the engine for its name
        KNOWN_TITLES[plain_name(engine)] = answer["title"]
    reading = None
    if not answer["refused"]:
        with np.load(arrays, allow_pickle=False) as stored:
            values: dict[str, Any] = {name: stored[name] if name in stored.files else None for name in _ARRAYS}
            for name in _BY_JOINT:
                values[name] = dict(zip(answer[name], stored[name], strict=True))
        values |= {name: tuple(answer[name]) for name in ("joints", "dofs", "coupled", "remarks")}
        reading = Reading(**values)
    about = (answer["version"], answer["says"], answer["tolerances"])
    return ReaderAnswer(*about, reading, answer["refused"], answer["fed"])


def read_robot(engine: str, asked: str, arrays: str) -> dict[str, Any]:
    """Worker's side of :func:`ask`: reads the file, evaluates the model, and writes arrays to the file ``arrays``."""
    from proofroll.running.worker import one_line

    reader, request = load_reader(local_name(engine)), _request(asked)
    for option in request.options:
        value = request.options[option]
        require_known(f"{engine}: {option}", option, reader.options, "there is no such option; it has", value)
    if request.kind not in reader.kinds:
        raise Missing(f"{engine} reads no {request.kind.upper()}")
    answer: dict[str, Any] = {"version": reader.version(), "says": reader.says, "tolerances": dict(reader.tolerances)}
    answer |= {"fed": getattr(reader, "fed", False), "title": getattr(reader, "title", "")}
    try:
        with contextlib.chdir(Path(arrays).parent):  # where an engine may leave its log
            reading = reader.read(request)
        _require_whole(reading, request.states.count)
    except Refused as error:
        return answer | {"refused": str(error)}
    except _OF_A_READER as error:
        return {"error": "crashed", "message": f"the reader of {engine} failed: {one_line(error)}"}
    except _Flawed as error:
        return {"error": "crashed", "message": f"the answer of {engine} has no meaning: {error}"}
    except Exception as error:  # whatever an importer raises is its refusal
        return answer | {"refused": one_line(error)}
    parts: dict[str, Any] = {name: np.array(list(getattr(reading, name).values()), dtype=float) for name in _BY_JOINT}
    parts |= {name: getattr(reading, name) for name in _ARRAYS if getattr(reading, name) is not None}
    np.savez(arrays, **parts)
    names = {name: list(getattr(reading, name)) for name in (*_BY_JOINT, "joints", "dofs", "coupled", "remarks")}
    return answer | {"refused": ""} | names


def _request(asked: str) -> Request:
    """Request from its file, written by :func:`ask`."""
    content = json.loads(Path(asked).read_text(encoding="utf-8"))
    content["path"], content["gravity"] = Path(content["path"]), np.array(content["gravity"])
    content["states"], content["robot"] = states_from(content["states"]), robot_from(content["robot"])
    content["torques"] = {name: np.array(rows) for name, rows in content["torques"].items()}
    return Request(**content)


class _Flawed(Exception):  # noqa: N818 -- becomes the row of the engine
    pass


def _require_whole(reading: Reading, states: int) -> None:
    """Raises _Flawed unless names are unique and every array has the shape that :class:`Reading` documents."""
    if repeated := [name for name in reading.joints if reading.joints.count(name) > 1]:
        raise _Flawed(f"two joints are called {repeated[0]!r}")
    n = sum(reading.dofs)
    shapes: dict[str, tuple[int, ...]] = {"com": (3,), "inertia": (3, 3), "position": (states, 3)}
    shapes |= {"mass": (), "rotation": (states, 3, 3), "M": (states, n, n)}
    for name in (*_BY_JOINT, *_ARRAYS):
        value, shape = getattr(reading, name), shapes.get(name, (states, n))
        for joint, array in value.items() if isinstance(value, dict) else [("", value)]:
            if array is not None and np.shape(array) != shape:
                raise _Flawed(f"{name} {joint}".strip() + f" has shape {np.shape(array)}, not {shape}")


def ask_as_written(
    worker: Worker, engine: str, request: Request, original: Path, folder: Path, time_limit: float
) -> AsWritten | None:
    """Asks the worker to read the user's unchanged file; None: the reader does not offer that.

    Raises:
        WorkerDied: the process crashed or took longer than ``time_limit`` [s].
    """
    asked = folder / "as_written.json"
    asked.write_text(json.dumps(plain(request) | {"path": str(original.resolve())}), encoding="utf-8")
    answer = worker.request(call(read_as_written, engine=engine, asked=str(asked)), time_limit)
    if "whole" not in answer:
        return None
    return AsWritten(Whole(*answer["whole"]) if answer["whole"] else None, answer["refused"])


def read_as_written(engine: str, asked: str) -> dict[str, Any]:
    """Worker's side of :func:`ask_as_written`: totals of the unchanged file."""
    reader = load_reader(local_name(engine))
    if not hasattr(reader, "as_written"):
        return {}
    try:
        with contextlib.chdir(Path(asked).parent):  # where an engine may leave its log
            whole = reader.as_written(_request(asked))
    except Exception as error:  # whatever an importer raises is its refusal
        return {"whole": None, "refused": words_of(error)}
    return {"whole": [whole.velocities, whole.mass], "refused": ""}


def words_of(error: BaseException) -> str:
    """Type and text of an exception in one line of at most 400 characters."""
    return f"{type(error).__name__}: {' '.join(str(error).split())}"[:400]


def write(file: RobotFile, folder: Path) -> Path:
    """Writes the copy that engines read into ``folder``; returns its path."""
    target = folder / f"robot.{'urdf' if file.kind == 'urdf' else 'xml'}"
    root = copy.deepcopy(file.root)
    ElementTree.indent(root)  # PyBullet 3.2.7 cuts lines at 8 kB
    target.write_bytes(ElementTree.tostring(root, encoding="utf-8"))
    return target


def options_of(written: Mapping[str, Any], engine: str) -> dict[str, bool]:
    """Options of an engine as booleans. Raises InputError if a value is neither true nor false."""
    options = {}
    for key, value in written.items():
        if str(value).lower() not in {"true", "false"}:
            raise InputError(
                f"{engine}: {key}", value, "nothing is run here; an option of an importer is true or false"
            )
        options[key] = str(value).lower() == "true"
    return options


def call(function: Callable[..., dict[str, Any]], **arguments: Any) -> dict[str, Any]:
    """Request to a worker to call a function of a module."""
    return {"do": "call", "function": f"{function.__module__}:{function.__name__}", "arguments": arguments}


def robot_from(data: Mapping[str, Any]) -> Robot:
    """Robot from its data by :func:`proofroll.files.json_data.plain`; its ``sources`` stay plain."""
    return Robot(
        name=data["name"],
        bodies={name: RobotBody(**_arrays(body)) for name, body in data["bodies"].items()},
        joints=tuple(RobotJoint(**_arrays(joint)) for joint in data["joints"]),
        mimics=tuple(Mimic(**mimic) for mimic in data["mimics"]),
        gravity=np.array(data["gravity"]),
        sources=data["sources"],
        loops=tuple(RobotLoop(**_arrays(loop)) for loop in data["loops"]),
        ties=tuple(
            Tie(tie["name"], tuple(tie["joints"]), tuple(tie["coefficients"]), tie["value"]) for tie in data["ties"]
        ),
        cords=tuple(Cord(**_arrays(cord)) for cord in data["cords"]),
        further=tuple(data["further"]),
        actuators=tuple(
            RobotActuator(**item | {"ends": item["ends"] and tuple(item["ends"])}) for item in data["actuators"]
        ),
    )


def states_from(data: Mapping[str, Any]) -> RobotStates:
    """States from their data by :func:`proofroll.files.json_data.plain`."""
    return RobotStates(**{field: _arrays(by_joint) for field, by_joint in data.items()})


def _arrays(values: Mapping[str, Any]) -> dict[str, Any]:
    return {key: np.array(item, dtype=float) if isinstance(item, list) else item for key, item in values.items()}
