"""What an engine is, and what decides its results: its settings, its versions and the code that they rest on."""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import inspect
from importlib import metadata
from pathlib import Path
from typing import Any

import proofroll
from proofroll.case import EngineFacts
from proofroll.errors import InputError

# Everything whose change may change a result; reports and command line are not among it.
FOUNDATION = (
    "case.py",
    "case_run.py",
    "certificate.py",
    "clean_runs.py",
    "closed_form.py",
    "compiled/library.py",
    "compiled/projection.py",
    "compiled/rolling.py",
    "compiled/series.py",
    "engine.py",
    "events.py",
    "mechanics.py",
    "motion.py",
    "recording.py",
    "resting.py",
    "rolling_equations.py",
    "scene.py",
    "scene_file.py",
    "surfaces.py",
    "toml_file.py",
    "trajectory.py",
)


def describe(engine: str) -> dict[str, Any]:
    """What an engine is and provides, and where its formulations stand on the ladder of models."""
    from proofroll.engine import CannotLeaveOut, TellsLevels
    from proofroll.registry import load_engine

    kind = load_engine(engine)
    presets = {
        formulation: {preset: dataclasses.asdict(settings) for preset, settings in by_preset.items()}
        for formulation, by_preset in kind.presets.items()
    }
    return {
        "name": engine,
        "version": kind.version(),
        "provides": sorted(kind.provides),
        "presets": presets,
        "summary": (inspect.getdoc(kind) or "").split("\n", 1)[0],
        "levels": dict(kind.levels) if isinstance(kind, TellsLevels) else {},
        "terms": [dataclasses.asdict(term) for term in kind.terms] if isinstance(kind, TellsLevels) else [],
        "inherent": {key: dict(terms) for key, terms in kind.inherent.items()}
        if isinstance(kind, CannotLeaveOut)
        else {},
    }


def resolve(engine: str, options: dict[str, Any]) -> dict[str, Any]:
    """Complete settings of an engine, and what else decides its results."""
    if engine == "truth":
        if options:
            raise InputError("truth", ", ".join(options), "the truth has no settings; leave them out")
        code = digest([Path(proofroll.__file__).parent / "truth"])
        return dataclasses.asdict(EngineFacts("truth", _truth_version(), code, {}))
    from proofroll.registry import load_engine, resolve_settings

    kind = load_engine(engine)
    settings = resolve_settings(kind, options)
    source = Path(inspect.getfile(kind))
    package = (source.parent / "__init__.py").is_file() and source.parent.name != "engines"
    facts = EngineFacts(
        name=engine,
        version=kind.version(),
        code=digest([source.parent if package else source]),
        settings=dataclasses.asdict(settings),
        resolution=settings.resolution,
        order=settings.order,
    )
    return dataclasses.asdict(facts)


def _truth_version() -> str:
    """Of proofroll, and of the libraries by which the truth is integrated."""
    found = [f"proofroll {proofroll.__version__}"]
    for name in ("numpy", "scipy", "heyoka"):
        with contextlib.suppress(metadata.PackageNotFoundError):
            found.append(f"{name} {metadata.version(name)}")
    return ", ".join(found)


def digest(sources: list[Path]) -> str:
    """Hash of the adapter's files and of the modules that every result rests on.

    What no result hangs on is left out of an adapter: a module or folder ``reproducer``, which writes bug reports, and
    modules ``robot_…``, which read robot files.
    """
    root = Path(proofroll.__file__).parent
    files = [root / name for name in FOUNDATION if (root / name).is_file()]
    for source in sources:
        if not source.is_dir():
            files.append(source)
            continue
        for file in sorted(source.rglob("*.py")):
            parts = file.relative_to(source).with_suffix("").parts
            if "reproducer" not in parts and not parts[-1].startswith("robot_"):
                files.append(file)
    content = hashlib.sha256()
    for file in files:
        content.update(file.read_bytes())
    return content.hexdigest()[:16]
