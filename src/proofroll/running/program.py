"""Engines that are programs in any language: ``NAME@program:PATH``. See docs/worker_protocol.md."""

import dataclasses
import json
import math
import os
import subprocess
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np

from proofroll.core.element import described_by
from proofroll.core.engine import Sample, fixed_step, whole_steps
from proofroll.core.errors import Diverged, InputError, ProofrollError, Refused
from proofroll.core.multi_element import REQUIRED
from proofroll.core.plugins import place_of, plain_name
from proofroll.core.scene import Scene
from proofroll.files.json_data import plain
from proofroll.running.bound_program import BoundProgram

PREFIX = "program:"
PROTOCOL = 1
# Lengths of an invalid answer that is shown, and of the longest that is read [characters].
_SHOWN, _LONGEST = 80, 2**26


def path_of(name: str) -> Path | None:
    """Path of the program of an engine ``NAME@program:PATH``; None: it is no such engine.

    Raises:
        InputError: there is no such program.
    """
    place = place_of(name)
    if not place.startswith(PREFIX):
        return None
    path = Path(os.path.abspath(Path(place.removeprefix(PREFIX)).expanduser()))
    if not path.is_file() or not os.access(path, os.X_OK):
        raise InputError("engine", name, f"{path} is no program; give the path of one that can be executed")
    return path


# Names of the setting that trades speed for accuracy, in order of preference.
_RESOLUTIONS = ("dt", "rtol")


class Pipe:
    """A running program: it reads one request a line and writes one answer a line.

    It runs in a session of its own, and ends with all that it started.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        try:
            self._process = BoundProgram([path], stdin=subprocess.PIPE)
        except OSError as error:
            raise ProofrollError(f"{path} cannot be started ({error.strerror or error})") from None

    def ask(self, request: Mapping[str, Any]) -> dict[str, Any]:
        """Answer to one request.

        Raises:
            Refused, Diverged: the program answers so.
            ProofrollError: the program ended, or its line is no JSON object.
        """
        process = self._process
        assert process.stdin is not None  # both were opened with pipes
        assert process.stdout is not None
        try:
            process.stdin.write(json.dumps(request) + "\n")
            process.stdin.flush()
            line = process.stdout.readline(_LONGEST)
        except (OSError, ValueError):
            line = ""
        if not line:
            code = process.wait()
            raise ProofrollError(f"{self._path.name} ended ({code}) instead of answering {request['do']}")
        try:
            answer = json.loads(line)
        except (ValueError, RecursionError):
            answer = None
        if not isinstance(answer, dict):
            shown = line.strip()[:_SHOWN]
            raise ProofrollError(f"{self._path.name} answered {request['do']} with {shown!r}, which is no JSON object")
        if "refused" in answer:
            raise Refused(str(answer["refused"]))
        if "diverged" in answer:
            raise Diverged(str(answer["diverged"]))
        return answer

    def close(self) -> None:
        """Ends the program with all that it started; what still holds its pipe is not waited for."""
        self._process.end()


def _in_arrays(record: Mapping[str, Any]) -> dict[str, Any]:
    return {key: np.asarray(value, dtype=float) if isinstance(value, list) else value for key, value in record.items()}


class _Built:
    """Model as the program reports it; fields that it does not report are None."""

    regularised: ClassVar[Mapping[str, Any]] = {}

    def __init__(self, report: Mapping[str, Any]) -> None:
        values = _in_arrays(report)
        self.terms = frozenset(values.pop("terms")) if "terms" in values else None
        self.__dict__.update(values)

    def __getattr__(self, name: str) -> None:
        if name.startswith("__"):
            raise AttributeError(name)


class Program:
    """Engine protocol, spoken through a pipe; :func:`engine` makes a subclass for each program."""

    name: ClassVar[str]
    path: ClassVar[Path]
    told: ClassVar[Mapping[str, Any]]
    provides: ClassVar[Mapping[str, frozenset[str]]]
    settings: ClassVar[type[Any]]
    presets: ClassVar[Mapping[str, Mapping[str, Any]]]

    @classmethod
    def version(cls) -> str:
        """Version as the program gives it."""
        return str(cls.told["version"])

    @classmethod
    def build(cls, scene: Scene, settings: Any) -> Self:
        """Starts the program anew and sends it the scene and the settings."""
        return cls(scene, settings)

    def __init__(self, scene: Scene, settings: Any) -> None:
        self._pipe, self._step = Pipe(self.path), fixed_step(settings)
        (element,) = scene.elements  # elements of a scene with several are built one by one
        self._sample_type = element.sample_type
        content = {"kind": described_by(element), "name": element.name} | plain(dataclasses.asdict(element))  # type: ignore[call-overload]  # elements are dataclasses
        try:
            request = {"do": "build", "scene": content, "asks": scene.asks, "settings": dataclasses.asdict(settings)}
            self._last = self._pipe.ask(request)
            self._built = _Built(self._last.get("built") or {})
            self.sample()
        except BaseException:
            self._pipe.close()
            raise

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`; a program is never asked for a time between its steps."""
        if self._step is not None:
            whole_steps(0.0, t, self._step)
        self._last = self._pipe.ask({"do": "advance", "to": t})

    def sample(self) -> Sample:
        """Sample that came with the last answer. Raises ProofrollError if it is incomplete."""
        sample = self._last.get("sample")
        names = [item.name for item in dataclasses.fields(self._sample_type)]
        if not isinstance(sample, dict) or not set(REQUIRED) <= sample.keys() <= set(names):
            raise ProofrollError(
                f"{self.path.name} gave no sample with p_WB, v_WB, w_WB, and of {', '.join(names)} only"
            )
        return self._sample_type(**_in_arrays(sample))

    def built(self) -> _Built:
        """Report of the program on the model it built."""
        return self._built

    def __del__(self) -> None:
        if hasattr(self, "_pipe"):
            self._pipe.close()


@cache
def engine(name: str) -> type[Program]:
    """Class of an engine ``NAME@program:PATH``, from the program's description of itself.

    Raises:
        InputError: there is no such program, or it has another name.
        ProofrollError: its description is invalid.
    """
    path = path_of(name)
    assert path is not None  # the caller checked
    pipe = Pipe(path)
    try:
        told = pipe.ask({"do": "describe", "protocol": PROTOCOL})
    finally:
        pipe.close()
    if told.get("protocol") != PROTOCOL:
        raise ProofrollError(
            f"{path.name} speaks protocol {told.get('protocol')}, and this proofroll speaks {PROTOCOL}"
        )
    if not isinstance(told.get("name"), str):
        raise ProofrollError(f"{path.name} does not say its name, as docs/worker_protocol.md says")
    if told["name"] != plain_name(name):
        raise InputError("engine", name, f"{path.name} is {told['name']}; write {told['name']}@{place_of(name)}")
    try:
        for formulation, item in told["formulations"].items():
            for preset, values in item["presets"].items():
                _require_values(f"{path.name}: preset {preset} of {formulation}", values)
        settings = _settings(told["formulations"])
        return type(
            "Program",
            (Program,),
            {
                "__module__": __name__,
                "name": plain_name(name),
                "path": path,
                "told": {"version": told["version"]},
                "provides": {key: frozenset(item["provides"]) for key, item in told["formulations"].items()},
                "settings": settings,
                "presets": {
                    key: {preset: settings(key, preset, **values) for preset, values in item["presets"].items()}
                    for key, item in told["formulations"].items()
                },
            },
        )
    except (KeyError, TypeError, AttributeError, StopIteration) as error:
        wrong = f"{type(error).__name__}: {error}"
        raise ProofrollError(
            f"{path.name} does not describe itself as docs/worker_protocol.md says ({wrong})"
        ) from None


def _require_values(place: str, values: Mapping[str, Any]) -> None:
    """Raises ProofrollError for the first invalid setting of a preset."""
    for key, value in values.items():
        if not isinstance(value, (bool, int, float, str)):
            raise ProofrollError(f"{place}: {key} = {json.dumps(value)}: give a number, a text, true or false")
        if key in _RESOLUTIONS and (isinstance(value, (bool, str)) or not 0 < value < math.inf):
            raise ProofrollError(f"{place}: {key} = {json.dumps(value)}: give a positive number")


def _settings(formulations: Mapping[str, Any]) -> type[Any]:
    """Class of a program's settings: formulation, preset, and every setting named in its presets."""
    values: dict[str, Any] = {}
    for item in formulations.values():
        for preset in item["presets"].values():
            values |= preset
    orders = {key: item.get("order") for key, item in formulations.items()}
    usual = next(iter(formulations))
    fields: list[Any] = [("formulation", str, usual), ("preset", str, next(iter(formulations[usual]["presets"])))]
    fields += [
        (key, float if isinstance(value, (int, float)) and not isinstance(value, bool) else type(value), value)
        for key, value in values.items()
    ]
    resolution = next((key for key in _RESOLUTIONS if key in values), None)
    members = {"resolution": resolution, "order": property(lambda self: orders[self.formulation])}
    return dataclasses.make_dataclass("Settings", fields, frozen=True, namespace=members)
