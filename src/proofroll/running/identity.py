"""Identity of an engine, its settings, versions and code that decides its results, and of the worker that runs it."""

import contextlib
import dataclasses
import hashlib
import inspect
import json
import platform
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

import proofroll
from proofroll.core.certificate import Line, Standing
from proofroll.core.entry_points import announced
from proofroll.core.errors import InputError
from proofroll.core.formulations import added_by
from proofroll.core.plugins import ELEMENTS, place_of
from proofroll.core.scene import Scene
from proofroll.core.source_code import OWN, hash_of, package_of, with_imports
from proofroll.core.truth import load_truths
from proofroll.files.json_data import plain
from proofroll.running.case import EngineDescription, EngineFacts
from proofroll.running.program import path_of

# Folders whose code decides every result; reports and the command line do not.
FOUNDATION = ("core", "elements", "files", "running")
# Names of modules and folders, at any depth, that only show or explain results.
ASIDE = frozenset({"reproducer", "robot_reader", "report", "failure_program", "diagnosis"})


def describe(engine: str) -> dict[str, Any]:
    """Description of an engine (:class:`EngineDescription`), as a dictionary."""
    from proofroll.core.engine_abilities import (
        CannotLeaveOut,
        MadeFor,
        ServesAsReference,
        SupportsFrom,
        TellsDefaults,
        TellsLevels,
    )
    from proofroll.running.loading import load

    kind = load(engine)
    presets = {
        formulation: {preset: dataclasses.asdict(settings) for preset, settings in by_preset.items()}
        for formulation, by_preset in kind.presets.items()
    }
    inherent = kind.inherent.items() if isinstance(kind, CannotLeaveOut) else ()
    description = EngineDescription(
        name=engine,
        version=kind.version(),
        interpreter=sys.executable,
        provides={formulation: sorted(names) for formulation, names in kind.provides.items()},
        presets=presets,
        summary=(inspect.getdoc(kind) or "").split("\n", 1)[0],
        levels=dict(kind.levels) if isinstance(kind, TellsLevels) else {},
        terms=list(kind.terms) if isinstance(kind, TellsLevels) else [],
        inherent={key: dict(terms) for key, terms in inherent},
        defaults=plain(dict(kind.defaults())) if isinstance(kind, TellsDefaults) else {},
        oldest=kind.oldest if isinstance(kind, SupportsFrom) else "",
        made_for={key: sorted(names) for key, names in kind.made_for.items()} if isinstance(kind, MadeFor) else {},
        references=dict(kind.references) if isinstance(kind, ServesAsReference) else {},
    )
    return dataclasses.asdict(description)


def resolve(
    engine: str, options: dict[str, Any], requires: Sequence[str] = (), *, stored: bool = True
) -> dict[str, Any]:
    """Complete settings of an engine and further facts that decide its results (fields of :class:`EngineFacts`).

    ``stored``: False for a run that is not stored, which needs no hash of code.
    """
    if engine == "truth":
        if options:
            raise InputError("truth", ", ".join(options), "the truth has no settings; leave them out")
        return dataclasses.asdict(EngineFacts("truth", truth_version(), _code_of(*load_truths()), {}))
    from proofroll.core.engine import precision_of, scheme_of
    from proofroll.core.engine_abilities import (
        BringsAPart,
        HasTitle,
        LowersOrder,
        SharesEquations,
        TellsCaveats,
        TellsLevels,
        laws,
        title_of,
    )
    from proofroll.core.plugins import resolve_settings
    from proofroll.running.loading import load

    kind = load(engine)
    settings = resolve_settings(kind, options, requires)
    added = added_by(kind, settings.formulation)
    facts = EngineFacts(
        name=engine,
        version=kind.version(),
        code=_code_of(kind, *([added.build] if added else [])) if stored else "",
        settings=used(settings),
        resolution=settings.resolution,
        order=settings.order,
        lowered=dict(kind.lowered(settings)) if isinstance(kind, LowersOrder) else {},
        shares=list(kind.shares.get(settings.formulation, ())) if isinstance(kind, SharesEquations) else [],
        caveat=kind.caveat(settings) if isinstance(kind, TellsCaveats) else "",
        brought=kind.brought(settings) if isinstance(kind, BringsAPart) else "",
        families=laws(kind, settings),
        precision=precision_of(settings),
        scheme=scheme_of(settings),
        level=kind.levels.get(settings.formulation, "") if isinstance(kind, TellsLevels) else "",
        title=title_of(kind),
        witness=kind.witness if isinstance(kind, HasTitle) else False,
        provides={formulation: sorted(names) for formulation, names in kind.provides.items()},
        libraries=libraries(engine),
    )
    return dataclasses.asdict(facts)


def used(settings: Any) -> dict[str, Any]:
    """Settings without those that their formulation does not use."""
    unused = getattr(settings, "unused", ())
    return {name: value for name, value in dataclasses.asdict(settings).items() if name not in unused}


def truth_version() -> str:
    """Versions of proofroll and of the libraries that integrate the truth."""
    packages = {"proofroll": proofroll.__version__} | versions_of(("numpy", "scipy", "heyoka"), version_of)
    return ", ".join(f"{name} {version}" for name, version in packages.items())


def libraries(engine: str) -> dict[str, str]:
    """Versions of libraries that decide the last digits of an engine's results.

    In another interpreter all packages count, in one hash, for engines bring libraries of their own. For an engine that
    is a program, the hash of the program counts instead.
    """
    program = path_of(engine)
    if program is not None:
        return {"program": hashlib.sha256(program.read_bytes()).hexdigest()[:12]}
    versions = {"python": platform.python_version()} | versions_of(("numpy", "scipy"), version_of)
    if place_of(engine):
        packages = sorted({f"{item.name}=={item.version}" for item in metadata.distributions()})
        versions["packages"] = hashlib.sha256("\n".join(packages).encode()).hexdigest()[:12]
    return versions


def digest(sources: Iterable[Path]) -> str:
    """Hash of the code that decides every result, and of further sources: those of an engine or a truth.

    Code that only shows results (:data:`ASIDE`) is left out.
    """
    return hash_of([*(OWN / name for name in FOUNDATION), *_folders_of_elements(), *sources], ASIDE)


def _folders_of_elements() -> list[Path]:
    """Folders of this package outside the foundation that hold kinds of elements, sorted."""
    modules = [point.value.partition(":")[0].split(".") for point in announced(ELEMENTS)]
    inside = [names for names in modules if names[0] == OWN.name and names[1] not in FOUNDATION]
    return sorted({OWN.joinpath(*names[1:-1]) for names in inside})


def _code_of(*kinds: Any) -> str:
    """Hash of the code that decides the results of engines or truths."""
    return _code_of_ours(*kinds) if {package_of(kind) for kind in kinds} == {OWN} else _digest_of(*kinds)


def _digest_of(*kinds: Any) -> str:
    return digest(sorted({source for kind in kinds for source in _of(kind)}))


# Cached for engines of this package: to read all files takes as long as a short run.
_code_of_ours = cache(_digest_of)


def _of(kind: Any) -> list[Path]:
    """Sources of an engine or a truth.

    Its folder or module if it is in this package; otherwise its whole package and all that this imports.
    """
    if (whole := package_of(kind)) != OWN:
        return with_imports(whole or Path(inspect.getfile(kind)))
    _, *inside = kind.__module__.split(".")
    source = OWN.joinpath(*inside[: 1 if inside[0] == "truth" else 2])
    return [source if source.is_dir() else source.with_suffix(".py")]


# Version of the protocol of requests and answers; see docs/worker_protocol.md.
PROTOCOL = 2


def identify_and_settle(place: str) -> dict[str, Any]:
    """Identity of this worker, which from now on serves only engines ``NAME@place``."""
    from proofroll.running import loading

    loading.serve_place(place)
    return own() | {"interpreter": sys.executable, "python": platform.python_version()}


@cache
def own() -> dict[str, Any]:
    """Version of the protocol, and version and code hash of this proofroll."""
    return {"protocol": PROTOCOL, "proofroll": proofroll.__version__, "code": digest([])}


def mismatch(answer: Mapping[str, Any]) -> str:
    """Reason why a worker with this identity cannot serve this process; empty: it can.

    Its code must be the same, not only its version, as the worker reads scenes, certifies and records.
    """
    mine = own()
    if answer.get("protocol") != PROTOCOL:
        return f"speaks protocol {answer.get('protocol')} of workers, and this proofroll speaks {PROTOCOL}"
    if answer.get("proofroll") != mine["proofroll"]:
        return f"has proofroll {answer.get('proofroll')}, and this is {mine['proofroll']}"
    if answer.get("code") != mine["code"]:
        return f"has other code of proofroll {mine['proofroll']} than this one"
    return ""


def versions(engine: str, version: str) -> dict[str, str]:
    """Versions of the engine, of proofroll, Python, numpy and scipy."""
    packages = {"proofroll": proofroll.__version__, "python": platform.python_version()}
    return {engine: version} | packages | {name: version_of(name) for name in ("numpy", "scipy")}


# Version of an installed package; cached, as reading it takes a millisecond and every run needs it.
version_of = cache(metadata.version)


def versions_of(names: Iterable[str], read: Callable[[str], str] = metadata.version) -> dict[str, str]:
    """Versions of those of the named packages that are installed, each by ``read``."""
    found_versions = {}
    for name in names:
        with contextlib.suppress(metadata.PackageNotFoundError):
            found_versions[name] = read(name)
    return found_versions


def manifest(
    engine: str,
    settings: Mapping[str, Any],
    scene: Scene,
    made_with: Mapping[str, str],
    certificate: Iterable[Line] = (),
) -> dict[str, str]:
    """Attributes of a trajectory: engine, settings, parameters [SI], versions, interpreter and machine.

    Settings, parameters and versions are JSON. ``not_reported`` lists quantities of the certificate that the engine
    does not report, if there are any.
    """
    silent = ", ".join(line.quantity for line in certificate if line.standing is Standing.NOT_REPORTED)
    return ({"not_reported": silent} if silent else {}) | {
        "engine": engine,
        "settings": json.dumps(dict(settings), sort_keys=True),
        "parameters": json.dumps(dict(scene.parameters)),
        "versions": json.dumps(dict(made_with)),
        "interpreter": sys.executable,
        "machine": f"{platform.machine()} {platform.system()}",
    }
