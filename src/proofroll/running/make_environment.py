"""Makes environments with other versions of an engine and this proofroll, and installs packages of a checkout."""

import contextlib
import importlib.util
import json
import re
import shutil
import sys
import tomllib
from collections.abc import Callable, Sequence
from difflib import get_close_matches
from importlib import metadata
from pathlib import Path

from proofroll.core.entry_points import announced
from proofroll.core.errors import InputError, Missing, ProofrollError
from proofroll.core.plugins import GROUP, distribution_of, engine_names, package_of, release
from proofroll.core.source_code import OWN
from proofroll.running import environments
from proofroll.running.bound_program import printed_by
from proofroll.running.engine_questions import describe
from proofroll.running.environments import Environment
from proofroll.running.process import environment_of_another

_PINNED = re.compile(r"\s*([\w.-]+)(?:\[[^\]]*\])?\s*==\s*(\w[\w.+-]*)\s*")
_VERSIONS = re.compile(r"\(from versions: (?:[^)]*, )?((?:[^,)]+, ){2}[^,)]+)\)")  # in an error message of pip
_PACKAGES = "examples/engines"
_WORDS = 400  # length of the end of pip's message that is shown [characters]


def label_of(requirements: Sequence[str]) -> str:
    """Default label: the version that the first requirement pins; empty if it pins none."""
    pinned = _PINNED.fullmatch(requirements[0])
    return pinned[2] if pinned else ""


def add(
    name: str, requirements: Sequence[str], label: str = "", python: str = "", tell: Callable[[str], None] | None = None
) -> Environment:
    """Makes an environment, imports its engine there, and keeps it as ``NAME@LABEL``.

    Args:
        name: of the engine.
        requirements: as pip reads them, e.g. ``mujoco==3.8.1``.
        label: by default the version that the first requirement pins.
        python: its Python, as virtualenv finds it: a command, a path or a version; by default this one.
        tell: called with lines about the progress.

    Raises:
        InputError: an argument is invalid, or the label is taken.
        Missing: virtualenv is not installed.
        ProofrollError: the environment cannot be made; its folder was deleted.
    """
    tell = tell or (lambda _: None)
    if importlib.util.find_spec("virtualenv") is None:
        raise Missing("environments need virtualenv, not installed here: pip install 'proofroll[environments]'")
    if not re.fullmatch(r"[\w-]+", name):
        plain = re.split(r"\W", name.strip(), maxsplit=1)[0] or "NAME"
        advice = f"give the plain name of an engine: proofroll engines add {plain} --requirement {plain}==VERSION"
        raise InputError("engine", name, advice)
    if not requirements:
        raise InputError(
            "--requirement", None, f"say what to install, e.g. --requirement {package_of(name) or name}==VERSION"
        )
    for text in requirements:
        if text.lstrip().startswith("-"):
            raise InputError("--requirement", text, "give a requirement, e.g. mujoco==3.8.1, not an option of pip")
    _require_plausible(name, requirements)
    pinned = label_of(requirements) if requirements else ""
    label = label or pinned
    if not label:
        raise InputError("--label", label, "no version is pinned by ==; say by which label it shall be remembered")
    folder = environments.folder_of(name, label)
    taken = environments.find(name, label)
    if taken is not None:
        advice = f"it is there already ({', '.join(taken.requirements)}); proofroll engines remove {name}@{label} first"
        raise InputError("label", label, advice)
    _require_supported(name, requirements)
    with environments.making(folder):
        environments.delete(folder)  # a half that an interrupted process left
        try:
            made = _made(name, label, folder, python, requirements, tell)
            if pinned == label and release(made.version) != release(label):
                raise ProofrollError(f"{name} there is version {made.version}, not {label}; look at the requirements")
            made.stamp()
        except BaseException:
            environments.delete(folder)
            raise
    return made


def _require_plausible(name: str, requirements: Sequence[str]) -> None:
    """Raises InputError if a name is a known engine's, mistyped, so that no requirement will announce it.

    An engine that nothing here announces may come with a requirement; not with the package of a known engine.
    """
    names = engine_names()
    packages = {package_of(item) or item for item in names}
    if name in names or not (
        get_close_matches(name, names) or all(distribution_of(text.strip()) in packages for text in requirements)
    ):
        return
    advice = (
        f"there is no such engine; choose one of {', '.join(names)}, or install the package that announces it here, too"
    )
    raise InputError("engine", name, advice)


def _require_supported(name: str, requirements: Sequence[str]) -> None:
    """Raises InputError if a requirement pins a version older than the adapter of the engine supports.

    The oldest version is asked from the engine that is installed here; without it nothing is checked.
    """
    package = package_of(name) or name
    pinned = [match for text in requirements if (match := _PINNED.fullmatch(text)) and match[1] == package]
    oldest = ""
    with contextlib.suppress(ProofrollError):  # the engine is not installed here
        oldest = describe(name).oldest if pinned else ""
    for match in pinned:
        if oldest and release(match[2]) < release(oldest):
            advice = f"the adapter of {name} supports {oldest} and later; nothing was installed"
            raise InputError("--requirement", match[0], advice)


def _made(
    name: str, label: str, folder: Path, base: str, requirements: Sequence[str], tell: Callable[[str], None]
) -> Environment:
    venv = folder / "venv"
    python = venv / "bin" / "python"
    tell(f"making {venv}")
    try:
        output_of([sys.executable, "-m", "virtualenv", "--quiet", "--python", base or sys.executable, venv])
    except ProofrollError as error:
        raise InputError("--python", base or sys.executable, f"no environment can be made from it: {error}") from None
    carried = _carried(name, next(venv.glob("lib/python*/site-packages")))
    tell("installing by pip")
    output_of([python, "-m", "pip", "install", "--quiet", "--only-binary", ":all:", *carried, *requirements])
    tell(f"importing {name}")
    try:
        version = describe(f"{name}@{python}").version
    except ProofrollError as error:
        reason = str(error).replace(f"{name}@{python}: ", "")
        raise ProofrollError(f"{name} does not work with {', '.join(requirements)}: {reason}") from None
    inspected = json.loads(output_of([python, "-m", "pip", "inspect"]))
    return Environment(
        name=name,
        label=label,
        folder=folder,
        version=version,
        requirements=list(requirements),
        interpreter=inspected["environment"]["python_full_version"],
        packages=sorted("{name}=={version}".format_map(item["metadata"]) for item in inspected["installed"]),
    )


def _carried(name: str, site: Path) -> list[str]:
    """Requirements for this proofroll and the package of the engine's adapter, whose files are copied to ``site``.

    For a package in editable mode these name the path of the source, which is then shared.
    """
    adapters = (point.dist.name for point in announced(GROUP) if point.name == name and point.dist is not None)
    requirements = []
    for item in map(metadata.distribution, dict.fromkeys(["proofroll", *adapters])):
        if item.files is None:
            raise ProofrollError(f"{item.name} was installed without a list of its files; install it by pip")
        for file in item.files:
            if ".." not in file.parts and "__pycache__" not in file.parts:
                (site / file).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(file.locate(), site / file)
        requirements.append(f"{item.name}=={item.version}")
    return requirements


def output_of(command: Sequence[str | Path]) -> str:
    """Output of a program; when this process is interrupted, the program and all that it started are killed."""
    try:
        code, printed, errors_printed = printed_by(command, environment_of_another())
    except OSError as error:
        raise ProofrollError(f"{command[0]} cannot be started ({error.strerror or error})") from None
    if code:
        errors = [line for line in errors_printed.splitlines() if line.startswith("ERROR:")]
        words = " ".join(" ".join(errors or errors_printed.splitlines() or printed.splitlines()).split())
        words = _VERSIONS.sub(r"(the last versions are \1)", words)[-_WORDS:]
        program = Path(str(command[0])).name
        what = " ".join(str(item) for item in command[1:4] if str(item).isascii() and len(str(item)) < 20)
        raise ProofrollError(f"{program} {what} failed ({code}): {words}")
    return printed


def example_packages(source: Path = OWN.parents[1]) -> dict[str, Path]:
    """Name of an engine -> folder of its package below a checkout of the source; empty where there is no checkout."""
    folders: dict[str, Path] = {}
    for file in sorted(source.glob(f"{_PACKAGES}/*/pyproject.toml")):
        points = tomllib.loads(file.read_text(encoding="utf-8"))["project"].get("entry-points", {})
        folders |= dict.fromkeys(points.get(GROUP, {}), file.parent)
    return folders


def install(name: str, packages: dict[str, Path]) -> tuple[str, Path]:
    """Installs the package of an engine into this Python: version of the engine, and folder of the package.

    Raises:
        InputError: there is no such package here.
        ProofrollError: pip refused it, or the engine does not start.
    """
    if name not in packages:
        choices = (
            f"choose one of {', '.join(packages)}" if packages else "a checkout of the source has packages of more"
        )
        advice = f"{choices} ({_PACKAGES}), or say by --requirement what to install"
        raise InputError("engine", name, advice)
    output_of([sys.executable, "-m", "pip", "install", "--quiet", str(packages[name])])
    return describe(f"{name}@{sys.executable}").version, packages[name]
