"""Policies: callables that turn an observation of a mechanism into an action; their names, observations and answers."""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import inspect
import sys
from collections.abc import Callable, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, Protocol

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.entry_points import announced
from proofroll.core.errors import InputError, ProofrollError

GROUP = "proofroll.policies"


@dataclass(frozen=True)
class Observation:
    """State of a mechanism for a policy, SI units; W is the world, B the frame of the base.

    The base is the body of the first free joint; without one it is the world.

    Attributes:
        time: of the instant [s].
        q, v: coordinates and rates of the joints that the policy drives, in its order [rad or m, per s].
        p_WB: origin of the base in the world [m], shape (3,).
        R_WB: rotation of the base, world = R_WB @ body, shape (3, 3).
        v_WB_W: velocity of the base's origin, in world axes [m/s], shape (3,).
        w_WB_B: angular velocity of the base, in its own axes [rad/s], shape (3,).
        gravity_B: unit vector along gravity, in the axes of the base, shape (3,); zero without gravity.
        last: action of the instant before, zero at the first.
    """

    time: float
    q: FloatArray
    v: FloatArray
    p_WB: FloatArray
    R_WB: FloatArray
    v_WB_W: FloatArray
    w_WB_B: FloatArray
    gravity_B: FloatArray
    last: FloatArray


class Policy(Protocol):
    """Protocol of a policy. A method ``reset()``, if it has one, is called before each run."""

    def __call__(self, observation: Observation) -> Any:
        """Action for an observation, one number for each joint in the policy's order."""


class PolicySource:
    """Maker of a policy, by name.

    Attributes:
        name: ``module:make``, or the name of an entry point of the group ``proofroll.policies``.
        folder: of modules that go before installed ones; None: no folder.
    """

    def __init__(self, name: str, folder: Path | None = None, make: Callable[[list[str]], Any] | None = None) -> None:
        """Finds the maker, unless ``make`` is it.

        Raises:
            InputError: there is no such module, attribute or entry point.
        """
        self.name, self.folder = name, folder
        self._make = _found(name, folder) if make is None else make
        self._code = _code(self._make)

    def __deepcopy__(self, _: Any) -> PolicySource:
        return self

    def __str__(self) -> str:
        """Name with a hash of the source, which decides what a stored result depends on."""
        return f"{self.name} {self._code}"

    def made(self, joints: Sequence[str]) -> Callable[[Observation], FloatArray]:
        """Policy for these joints, before its first observation; it answers with an array of floats.

        Raises:
            InputError: the maker fails, or makes no callable.
        """
        with _errors(self.name, "make"):
            policy = self._make(list(joints))
        if not callable(policy):
            raise InputError("policy.call", self.name, f"it made a {type(policy).__name__}; it has to make a callable")
        if hasattr(policy, "reset"):
            with _errors(self.name, "reset"):
                policy.reset()
        count = len(joints)

        def answer(observation: Observation) -> FloatArray:
            with _errors(self.name, f"at t = {observation.time:g} s"):
                action = np.asarray(policy(observation), dtype=np.float64)
            if action.shape != (count,):
                advice = f"its action has shape {action.shape}; it drives {count} joints, so give shape ({count},)"
                raise InputError("policy.call", self.name, advice)
            return action.copy()

        return answer


@contextmanager
def _errors(name: str, place: str) -> Any:
    """Context in which whatever a policy raises becomes one line."""
    try:
        yield
    except ProofrollError:
        raise
    except Exception as error:
        line = " ".join(str(error).split())[:200]
        raise InputError("policy.call", name, f"it failed ({place}): {type(error).__name__}: {line}") from error


def _found(name: str, folder: Path | None) -> Callable[[list[str]], Any]:
    module_name, colon, attribute = name.partition(":")
    if not colon:
        points = {point.name: point for point in announced(GROUP)}
        if name not in points:
            alternatives = f", or one of {', '.join(sorted(points))}" if points else ""
            raise InputError("policy.call", name, f"give module:make{alternatives}")
        with _errors(name, "import"):
            return points[name].load()  # type: ignore[no-any-return]
    file = None if folder is None else folder / (module_name.replace(".", "/") + ".py")
    with _errors(name, "import"):
        try:
            module = _of_file(file) if file is not None and file.is_file() else importlib.import_module(module_name)
        except ModuleNotFoundError as error:
            if error.name and not f"{module_name}.".startswith(f"{error.name}."):
                raise
            place = "" if folder is None else f" beside the controller's file ({folder}) or"
            raise InputError("policy.call", name, f"there is no module {module_name}{place} among packages") from None
    item: Any = module
    for part in attribute.split("."):
        item = getattr(item, part, None)
    if not callable(item):
        raise InputError("policy.call", name, f"the module {module_name} has no callable {attribute!r}")
    return item  # type: ignore[no-any-return]


def _of_file(file: Path) -> ModuleType:
    """Module of a file, loaded once for each content under a name of its own; it may import its neighbours."""
    content = str(file.resolve()).encode() + file.read_bytes()
    key = f"_proofroll_policy_{hashlib.sha256(content).hexdigest()[:16]}"
    if key in sys.modules:
        return sys.modules[key]
    spec = importlib.util.spec_from_file_location(key, file)
    assert spec is not None  # of a path that ends in .py
    assert spec.loader is not None
    module = sys.modules[key] = importlib.util.module_from_spec(spec)
    path = list(sys.path)
    try:
        sys.path.insert(0, str(file.parent.resolve()))
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[key]
        raise
    finally:
        sys.path[:] = path
    return module


def _code(make: Callable[..., Any]) -> str:
    """Hash of the file that a maker is written in; empty if it has none."""
    try:
        source = inspect.getsourcefile(make) or ""
        return hashlib.sha256(Path(source).read_bytes()).hexdigest()[:16]
    except (TypeError, OSError):
        return ""
