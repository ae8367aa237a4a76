"""Plug-ins: engines and kinds of elements as entry points, loaded when they are needed."""

import dataclasses
import re
from collections.abc import Collection, Mapping, Sequence, Set
from contextlib import suppress
from functools import cache
from importlib.metadata import Distribution, EntryPoint, PackageNotFoundError, version
from importlib.util import find_spec
from typing import Any

from proofroll.core.element import ElementKind
from proofroll.core.engine_abilities import MadeFor, ServesAsReference, SupportsFrom, offered, stepped
from proofroll.core.entry_points import announced, loaded
from proofroll.core.errors import InputError, Missing, ProofrollError, raised_at, require_known
from proofroll.core.formulations import extended

GROUP = "proofroll.engines"
ELEMENTS = "proofroll.elements"
# Members required of an engine's class; the others belong to the object that `build` returns.
_OF_AN_ENGINE = ("name", "provides", "settings", "presets", "version", "build")


def engine_names(group: str = GROUP) -> list[str]:
    """Sorted names of all engines that installed packages announce in a ``group`` of entry points."""
    return sorted({point.name for point in announced(group)})


def plain_name(name: str) -> str:
    """Name of an engine without its place: ``mujoco`` for ``mujoco`` and ``mujoco@3.8.1``."""
    return name.partition("@")[0]


def place_of(name: str) -> str:
    """Place of an engine, the part after ``@``: another interpreter or a program; empty: this interpreter."""
    return name.partition("@")[2]


# Engine -> its title for readers, from the answers of processes in which engines run.
KNOWN_TITLES: dict[str, str] = {}


def load_engine(name: str) -> Any:
    """Class of an engine with the formulations that packages add to it, loaded into this process.

    Raises:
        InputError: no installed package announces such an engine, or it belongs to another interpreter.
        Missing: a package that it needs is not installed, or is older than its adapter supports.
        ProofrollError: its entry point or an import names something that does not exist or is no engine.
    """
    if place_of(name):
        advice = "an engine of another interpreter cannot be loaded into this one; use the command line, or leave @ out"
        raise InputError("engine", name, advice)
    point = _entry_point(name)
    try:
        kind = point.load()
    except ModuleNotFoundError as error:
        raise _not_found(point, error) from None
    except AttributeError as error:
        if raised_at(error):  # arose inside the adapter
            raise
        raise ProofrollError(f"{name} is announced as {point.value}, but {error}: correct the entry point") from None
    if lacking := lacking_of(kind):
        raise ProofrollError(
            f"{name} is announced as {point.value}, which is no engine: it has no {', '.join(lacking)}"
        )
    oldest = kind.oldest if isinstance(kind, SupportsFrom) else ""
    if oldest and release(kind.version()) < release(oldest):
        fault = f"{name} {kind.version()} is older than its adapter supports, {oldest}"
        raise Missing(f"{fault}; install a later {name}")
    return extended(kind)


def lacking_of(kind: object, *besides: str) -> list[str]:
    """Required members of an engine's class, and of those in ``besides``, that an object lacks."""
    return [name for name in (*_OF_AN_ENGINE, *besides) if not hasattr(kind, name)]


def release(version: str) -> tuple[int, ...]:
    """Numbers of a version without trailing zeros, for comparison: ``1.13.6.dev1`` -> (1, 13, 6)."""
    numbers = [int(part) for part in re.match(r"[\d.]*", version)[0].split(".") if part]  # type: ignore[index]  # matches ""
    while numbers and numbers[-1] == 0:
        numbers.pop()
    return tuple(numbers)


def _not_found(point: EntryPoint, error: ModuleNotFoundError) -> ProofrollError:
    """Error for a missing module: not installed, or misspelt."""
    module, line = error.name or str(error), raised_at(error)
    whole = f"imports {module} ({line})" if line else f"is announced as {point.value}"
    top = module.partition(".")[0]
    if top != module and find_spec(top) is not None:
        return ProofrollError(f"{point.name} {whole}; {top} is installed, but has no such module: correct the name")
    if point.value.startswith("proofroll."):
        return Missing(
            f"{point.name} is not installed here ({module} is missing): pip install 'proofroll[{point.name}]'"
        )
    lacking = [text for text in (point.dist.requires if point.dist else None) or [] if not _installed(text)]
    if lacking:
        needed = " ".join(f"'{text}'" for text in lacking)
        return Missing(f"{point.name} is not installed here ({module} is missing): pip install {needed}")
    return Missing(
        f"{point.name} {whole}, which is not installed here: correct the name if it is misspelt, or pip install what "
        f"has {module} and name that in the dependencies of {point.dist.name if point.dist else 'the package'}"
    )


def distribution_of(requirement: str) -> str:
    """Name of the distribution in a requirement, ``mujoco`` of ``mujoco>=3.2; extra == 'mujoco'``."""
    return re.split(r"[\s;<>=!~\[(]", requirement, maxsplit=1)[0]


def package_of(engine: str) -> str:
    """Package that brings an engine: of the extra with its name in the adapter's package; empty if there is none."""
    for text in getattr(_adapters_package(engine), "requires", None) or ():
        if re.search(rf"extra\s*==\s*['\"]{re.escape(engine)}['\"]", text):
            return distribution_of(text)
    return ""


def _adapters_package(engine: str) -> Distribution | None:
    """Installed package that announces an engine."""
    return next((point.dist for point in announced(GROUP) if point.name == engine), None)


def installed_package(engine: str) -> tuple[str, str]:
    """Package of an engine, or that of its adapter, and its version as packages tell it; empty: not installed."""
    name = package_of(engine) or getattr(_adapters_package(engine), "name", "")
    try:
        return name, version(name)
    except PackageNotFoundError:
        return name, ""


def _installed(requirement: str) -> bool:
    """True if a required distribution is installed; requirements of extras count as installed."""
    with suppress(PackageNotFoundError):
        return "extra" in requirement.partition(";")[2] or bool(version(distribution_of(requirement)))
    return False


@cache
def load_element_kinds() -> tuple[type[ElementKind], ...]:
    """Every kind of element that installed packages announce, by name."""
    return tuple(kind for _, kind in loaded(ELEMENTS, like=ElementKind))


def installed_steps(requires: Set[str]) -> list[str]:
    """Installed engines of a reference by steps and its witness, see :func:`proofroll.core.engine_abilities.stepped`.

    It loads all engines, where :func:`proofroll.running.engine_questions.on_scene` asks their processes.
    """
    declared = {}
    for name in engine_names():
        with suppress(ProofrollError):
            kind = load_engine(name)
            declared[name] = (kind.references if isinstance(kind, ServesAsReference) else {}, kind.provides)
    return stepped(declared, requires)


def require_engine(name: str, *besides: str) -> None:
    """Raises InputError unless an installed package announces an engine of this name; loads none.

    Engines of other interpreters are not checked.

    Args:
        name: of the engine.
        besides: further names that may stand in its place, which the error offers, too.
    """
    if not place_of(name):
        _entry_point(name, besides)


def _entry_point(name: str, besides: Sequence[str] = ("truth",)) -> EntryPoint:
    for point in announced(GROUP):
        if point.name == name:
            return point
    if name != "truth":
        require_known("engine", name, [*besides, *engine_names()], "there is no such engine; choose one of")
    raise InputError("engine", name, "engines are held against it; name an engine")


@dataclasses.dataclass(frozen=True)
class EngineSpec:
    """An engine as the user writes it, ``mujoco[formulation=chart,dt=1e-4]``.

    Attributes:
        name: of the engine, perhaps with a place, ``mujoco@3.8.1``.
        options: the given settings, as text or numbers.
    """

    name: str
    options: Mapping[str, Any]

    def __str__(self) -> str:
        """Text of the engine as the user writes it."""
        inner = ",".join(f"{key}={value}" for key, value in self.options.items())
        return f"{self.name}[{inner}]" if inner else self.name

    def means(self, engine: str, settings: Mapping[str, Any]) -> bool:
        """True if an engine with these settings is of this name and has all of the given settings."""
        return engine == self.name and all(_same(settings.get(key), value) for key, value in self.options.items())


def _same(value: object, text: object) -> bool:
    """True if a setting has a value that the user wrote as text, as a number or as a word."""
    try:
        return float(value) == float(text)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return str(value).lower() == str(text).lower()


def parse_engine(text: str) -> EngineSpec:
    """Reads ``name`` or ``name[key=value,…]``; ``name@place`` runs in another interpreter.

    Raises:
        InputError: the text has another form.
    """
    match = re.fullmatch(
        r"\s*([\w-]+(?:@[^\s\[\]@](?:[^\[\]@]*[^\s\[\]@])?)?)\s*(?:\[(.*)\])?\s*", text, flags=re.DOTALL
    )
    if match is None:
        advice = "write name or name[key=value,key=value]"
        if "@" in text:
            advice = "write name@PYTHON or name@LABEL, then [key=value,key=value]; the place has no @ and no brackets"
        raise InputError("engine", text, advice)
    options: dict[str, str] = {}
    for part in filter(None, (piece.strip() for piece in (match[2] or "").split(","))):
        key, equals, value = part.partition("=")
        if not equals:
            raise InputError("engine", text, f"write key=value instead of {part!r}")
        if key.strip() in options:
            raise InputError("engine", text, f"{key.strip()} is given twice; give it once")
        options[key.strip()] = value.strip()
    return EngineSpec(match[1], options)


def resolve_settings(engine: Any, options: Mapping[str, Any], requires: Collection[str] = ()) -> Any:
    """Complete settings of an engine: a preset of a formulation, overridden by the given options.

    Without a given formulation it is the first that lacks least of what the scene ``requires``; one that is made for
    such scenes goes first.

    Raises:
        InputError: unknown or ill-typed option, or one that the formulation does not use.
    """
    from proofroll.core.validation import strict, validated  # pydantic takes a while to import

    complete = [settings for presets in engine.presets.values() for settings in presets.values()]
    kinds = dict.fromkeys([engine.settings, *map(type, complete)])
    fields = dict.fromkeys(field.name for kind in kinds for field in dataclasses.fields(kind))
    for key, value in options.items():
        require_known(f"{engine.name}: {key}", key, fields, "there is no such setting; choose from", value)
    purposes = engine.made_for if isinstance(engine, MadeFor) else {}

    def misfit(formulation: str) -> tuple[int, bool]:
        return len(set(requires) - engine.provides[formulation]), not offered(formulation, requires, purposes)

    formulation = options.get("formulation") or min(engine.presets, key=misfit)
    require_known(f"{engine.name}: formulation", formulation, engine.presets)
    presets = engine.presets[formulation]
    preset = options.get("preset", "matched" if "matched" in presets else next(iter(presets)))
    require_known(f"{engine.name}: preset", preset, presets, f"{formulation} has")
    kind, values = type(presets[preset]), dataclasses.asdict(presets[preset])
    for key in (name for name in options if name not in values):
        raise InputError(f"{engine.name}: {key}", options[key], f"{formulation} does not use it; leave it out")
    strict(kind, finite=True)
    settings = validated(kind, {**values, **options}, engine.name)
    for key in (name for name in options if name in getattr(settings, "unused", ())):
        raise InputError(f"{engine.name}: {key}", options[key], f"{formulation} does not use it here; leave it out")
    return settings
