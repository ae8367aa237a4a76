"""Random one-token faults in every function that runs between a scene file and its truth; a process for each."""

from __future__ import annotations
import __future__

import ast
import copy
import importlib
import inspect
import multiprocessing
import random
import sys
import types
from collections.abc import Callable, Iterator, Mapping
from functools import cache, partial
from itertools import islice
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import proofroll.truth.plug_in
import proofroll.truth.truth_of_mechanism  # noqa: F401 -- imported once, before processes are made
from proofroll.core.errors import ProofrollError
from proofroll.core.truth import truth
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.files.scene_file import load_scene
from proofroll_drill.own_reader import misread

# Scene and its last time [s]: together they have contacts, joints, drives, springs, loops, stops and closed forms.
SCENES: Mapping[str, float] = {
    "bouncing_ball": 0.8,
    "stop": 0.8,
    "slide_to_roll": 0.5,
    "sled": 0.4,
    "rolling_stop": 0.6,
    "double_pendulum": 0.5,
    "heavy_top": 0.3,
    "arm_pd": 0.4,
    "servo": 0.5,
    "saturated_servo": 0.5,
    "driven_four_bar": 0.3,
    "pendulum_friction": 0.5,
    "spring_friction": 0.5,
    "gear_pair": 0.4,
    "joint_bench": 0.3,
    "engine_on_mounts": 0.3,
}
COUNT = 9  # samples of each
_LONGEST = 60  # wall seconds of one truth, after which it counts as refused
_WIDER = 10.0  # bars by which a value with a fault may be off
_CHECKS = ("proofroll.truth.check",)  # a fault in what checks is no fault of an answer
_SWAPS: Mapping[type[ast.AST], type[ast.AST]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult,
    ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.And: ast.Or, ast.Or: ast.And, ast.USub: ast.UAdd, ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip
_NAMES = {"min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum", "sin": "cos", "cos": "sin"}


class RandomFault(NamedTuple):
    """A fault: address of the function, number of its place there, what was and is, a scene, and if it reads that."""

    function: str
    place: int
    words: str
    scene: str
    reads: bool


class FaultOutcome(NamedTuple):
    """Outcome of a fault, "refused", "within the bar", "changes nothing" or "silent", and its reason."""

    kind: str
    detail: str


def drawn_faults(seed: int, count: int) -> list[RandomFault]:
    """First faults of a seed, each in another function."""
    return list(islice(_faults(seed), count))


def _faults(seed: int) -> Iterator[RandomFault]:
    """Faults of a seed; functions that come or go move none of the others'."""
    runs = {scene: functions_of(scene) for scene in SCENES}
    reading = set[str]().union(*(reading_functions(scene) for scene in SCENES))
    for function in sorted(set().union(*runs.values()), key=lambda function: _number(seed, function)):
        places = range(len(_places(_tree(function))))
        if not places:
            continue
        place = min(places, key=lambda place: _number(seed, function, place))
        scenes = [scene for scene in SCENES if function in runs[scene]]
        scene = min(scenes, key=lambda scene: _number(seed, function, scene))
        words = _words(function, place)
        yield RandomFault(function=function, place=place, words=words, scene=scene, reads=function in reading)


def _number(seed: int, *place: str | int) -> float:
    """Random number in [0, 1) of a seed and a place alone."""
    return random.Random(" ".join(map(str, (seed, *place)))).random()


@cache
def functions_of(scene: str) -> frozenset[str]:
    """Addresses of the functions that run between a scene file and its truth."""
    return frozenset(_in_child(partial(_traced, partial(_run, scene))))


@cache
def reading_functions(scene: str) -> frozenset[str]:
    """Addresses of those that run before the scene is read: checks take its numbers from them."""
    return frozenset(_in_child(partial(_traced, partial(load_scene, scene))))


def outcome(fault: RandomFault) -> FaultOutcome:
    """Outcome of a truth with a fault."""
    right = _honest(fault.scene)
    try:
        kind, wrong = _in_child(partial(_faulty, fault))
    except TimeoutError:
        return FaultOutcome("refused", f"no end within {_LONGEST} s")
    except EOFError:
        return FaultOutcome("refused", "the process ended")
    if kind != "values":
        return FaultOutcome("refused", wrong)
    return compared(right, wrong)


def compared(right: Mapping[str, Any], wrong: Mapping[str, Any]) -> FaultOutcome:
    """Outcome from the values and bars of a truth with and without a fault."""
    worst, name = 0.0, ""
    changed = sorted(right.keys() ^ wrong.keys())
    if changed:
        return FaultOutcome("silent", f"other variables: {changed[0]}")
    for key, (values, bar) in right.items():
        others, other_bar = wrong[key]
        if values.dtype.kind not in "fi":
            if not np.array_equal(values, others):
                return FaultOutcome("silent", f"{key} differs")
            continue
        if values.shape != others.shape:
            return FaultOutcome("silent", f"{key} has another shape")
        known = np.isfinite(values) & np.isfinite(others)
        off = float(np.abs(values - others)[known].max(initial=0.0))
        room = bar + other_bar + 1e-14 * float(np.abs(values[known]).max(initial=0.0))
        if off and off / max(room, sys.float_info.min) > worst:
            worst, name = off / max(room, sys.float_info.min), key
    if not worst:
        return FaultOutcome("changes nothing", "")
    return FaultOutcome("within the bar" if worst <= _WIDER else "silent", f"{name} off by {worst:.2g} bars")


@cache
def _honest(scene: str) -> Mapping[str, Any]:
    kind, values = _in_child(partial(_run, scene))
    assert kind == "values", values
    return values  # type: ignore[no-any-return]


def _run(scene: str) -> tuple[str, Any]:
    """Values and bars of a truth, or why there is none."""
    try:
        read = load_scene(scene)
        for element in read.elements:
            assert isinstance(element, MechanismElement)
            if wrong := misread(scene, element.mechanism)[0]:
                return "refused", f"the file says otherwise: {', '.join(wrong)}"
        found = truth(read, np.linspace(0.0, SCENES[scene], COUNT))
    except Exception as error:
        told = "" if isinstance(error, ProofrollError) else f"{type(error).__name__}: "
        return "refused", told + str(error)
    for key in ("ended", "ill_posed"):
        if found.attrs.get(key):
            return "refused", str(found.attrs[key])
    return "values", values_and_bars(found)


def values_and_bars(found: Any) -> dict[str, Any]:
    """Values and bar of each variable of a truth."""
    return {str(name): (np.array(item.values), _bar(str(name), item, found)) for name, item in found.variables.items()}


def _bar(name: str, item: Any, found: Any) -> float:
    """Error bar of a variable; of the times of events half their brackets."""
    if name.startswith("event_") and name in {"event_time", "event_low", "event_high"}:
        return float(np.max(found["event_high"].values - found["event_low"].values, initial=0.0))
    return float(item.attrs.get("error_bar", 0.0))


def _faulty(fault: RandomFault) -> tuple[str, Any]:
    function = _function(fault.function)
    tree = _tree(fault.function)
    _mutate(_places(tree)[fault.place])
    names = dict(function.__globals__)
    flags = __future__.annotations.compiler_flag
    code = compile(ast.fix_missing_locations(tree), "<fault>", "exec", flags=flags)
    found = next(item for item in code.co_consts if isinstance(item, types.CodeType))
    try:
        if found.co_freevars or function.__code__.co_freevars:
            return "refused", "not planted: a closure"
        exec(code, names)  # the source of the suite alone
        function.__code__ = names[function.__name__].__code__
    except (ValueError, KeyError) as error:
        return "refused", f"not planted: {error}"
    return _run(fault.scene)


def _in_child(task: Callable[[], Any]) -> Any:
    """Result of a task in a process of its own, which knows nothing of what ran in this one: its caches are empty.

    Raises:
        TimeoutError: the task takes too long.
        EOFError: the process ends before it.
    """
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([__name__])
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_send, args=(theirs, task), daemon=True)
    process.start()
    theirs.close()
    try:
        if not ours.poll(_LONGEST):
            raise TimeoutError
        return ours.recv()
    finally:
        process.kill()
        process.join()


def _send(pipe: Connection, task: Callable[[], Any]) -> None:
    pipe.send(task())


def _traced(task: Callable[[], Any]) -> set[str]:
    """Addresses of the functions that a task calls."""
    codes = set[types.CodeType]()

    def profile(frame: types.FrameType, event: str, _: Any) -> None:
        if event == "call":
            codes.add(frame.f_code)

    sys.setprofile(profile)
    try:
        task()
    finally:
        sys.setprofile(None)
    known = _addresses()
    return {known[code] for code in codes if code in known}


def _addresses() -> dict[types.CodeType, str]:
    """Address of each function of the loaded modules, by its code."""
    found = dict[types.CodeType, str]()
    for name, module in list(sys.modules.items()):
        if not name.startswith("proofroll.") or name.startswith(_CHECKS) or module is None:
            continue
        for key, value in list(vars(module).items()):
            items = {key: value} if not inspect.isclass(value) else {f"{key}.{k}": v for k, v in vars(value).items()}
            for path, item in items.items():
                plain = _plain(item)
                if not isinstance(plain, types.FunctionType) or plain.__qualname__ != path:
                    continue
                if plain.__code__.co_filename == module.__file__:
                    found[plain.__code__] = f"{name}:{path}"
    return found


def _plain(item: Any) -> Any:
    for inner in ("fget", "func", "__func__", "__wrapped__"):
        item = getattr(item, inner, item)
    return item


def _function(address: str) -> Any:
    module, _, path = address.partition(":")
    found: Any = importlib.import_module(module)
    for name in path.split("."):
        found = inspect.getattr_static(found, name)
    return _plain(found)


def _tree(address: str) -> ast.Module:
    """Source of a function as its file says, as a tree without its decorators."""
    module, _, path = address.partition(":")
    node: ast.Module | ast.ClassDef | ast.FunctionDef = _parsed(module)
    for name in path.split("."):
        named = (item for item in node.body if isinstance(item, (ast.ClassDef, ast.FunctionDef)))
        node = next(item for item in reversed(list(named)) if item.name == name)
    assert isinstance(node, ast.FunctionDef)
    function = copy.deepcopy(node)
    function.decorator_list = []
    return ast.Module(body=[function], type_ignores=[])


@cache
def _parsed(module: str) -> ast.Module:
    file = importlib.import_module(module).__file__
    assert file is not None
    return ast.parse(Path(file).read_text(encoding="utf-8"))


def _places(tree: ast.Module) -> list[tuple[ast.AST, str, int | None]]:
    """Places of one token each that a fault may change: a node, its field and, of a list, the index."""
    function = tree.body[0]
    assert isinstance(function, ast.FunctionDef)
    places = list[tuple[ast.AST, str, int | None]]()
    for statement in function.body:
        for node in _walked(statement):
            if isinstance(node, (ast.BinOp, ast.BoolOp, ast.UnaryOp)) and type(node.op) in _SWAPS:
                places.append((node, "op", None))
            elif isinstance(node, ast.Compare):
                places += [(node, "ops", k) for k, sign in enumerate(node.ops) if type(sign) in _SWAPS]
            elif isinstance(node, ast.Constant) and type(node.value) in {int, float, bool}:
                places.append((node, "value", None))
            elif isinstance(node, ast.Attribute) and node.attr in _NAMES:
                places.append((node, "attr", None))
            elif isinstance(node, ast.Name) and node.id in _NAMES:
                places.append((node, "id", None))
    return places


def _walked(node: ast.AST) -> Iterator[ast.AST]:
    """Nodes below a node, without those of annotations and raised errors."""
    yield node
    for name, value in ast.iter_fields(node):
        if name in {"annotation", "returns"} or isinstance(node, (ast.Raise, ast.Assert, ast.JoinedStr)):
            continue
        for item in value if isinstance(value, list) else [value]:
            if isinstance(item, ast.AST):
                yield from _walked(item)


def _mutate(place: tuple[ast.AST, str, int | None]) -> None:
    node, name, index = place
    value = getattr(node, name)
    if index is not None:
        value[index] = _SWAPS[type(value[index])]()
    elif name == "op":
        setattr(node, name, _SWAPS[type(value)]())
    elif name in {"attr", "id"}:
        setattr(node, name, _NAMES[value])
    elif isinstance(value, bool):
        setattr(node, name, not value)
    else:
        setattr(node, name, value + 1 if isinstance(value, int) else value * 1.001 if value else 1e-3)


def _words(address: str, place: int) -> str:
    """The line with the fault, as it is and as it becomes."""
    tree = _tree(address)
    before = ast.unparse(_places(tree)[place][0])
    changed = copy.deepcopy(tree)
    spot = _places(changed)[place]
    _mutate(spot)
    return f"{before} -> {ast.unparse(spot[0])}"
