"""Makes the environment of an engine in another version: a virtual environment with the engine and this proofroll."""

import base64
import contextlib
import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Callable, Sequence
from difflib import get_close_matches
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

from proofroll.core.entry_points import announced
from proofroll.core.errors import InputError, ProofrollError
from proofroll.core.plugins import GROUP, distribution_of, engine_names, release
from proofroll.running import environments
from proofroll.running.engine_questions import describe
from proofroll.running.environments import Environment
from proofroll.running.interpreters import OLDEST
from proofroll.running.process import environment_of_another

_PACKAGES = """
import json, platform
from importlib.metadata import distributions
found = sorted({f"{item.name}=={item.version}" for item in distributions()})
print(json.dumps([platform.python_version(), found]))
"""
_PINNED = re.compile(r"\s*([\w.-]+)(?:\[[^\]]*\])?\s*==\s*(\w[\w.+-]*)\s*")
_VERSIONS = re.compile(r"\(from versions: (?:[^)]*, )?((?:[^,)]+, ){2}[^,)]+)\)")  # in an error message of pip
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
        python: command or path of the Python; by default this one.
        tell: called with lines about the progress.

    Raises:
        InputError: an argument is invalid, or the label is taken.
        ProofrollError: the environment cannot be made; its folder was deleted.
    """
    tell = tell or (lambda _: None)
    if not re.fullmatch(r"[\w-]+", name):
        plain = re.split(r"\W", name.strip(), maxsplit=1)[0] or "NAME"
        advice = f"give the plain name of an engine: proofroll engines add {plain} --requirement {plain}==VERSION"
        raise InputError("engine", name, advice)
    if not requirements:
        raise InputError(
            "--requirement", "nothing", f"say what to install, e.g. --requirement {package_of(name) or name}==VERSION"
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
    base = _interpreter(python)
    with environments.making(folder):
        environments.delete(folder)  # a half that an interrupted process left
        try:
            made = _made(name, label, folder, base, requirements, tell)
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


def package_of(engine: str) -> str:
    """Requirement that installs an engine: of the extra with its name in the adapter's package; empty if unknown."""
    for point in announced(GROUP):
        if point.name != engine or point.dist is None:
            continue
        for text in point.dist.requires or []:
            if re.search(rf"extra\s*==\s*['\"]{re.escape(engine)}['\"]", text):
                return distribution_of(text)
    return ""


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
    name: str, label: str, folder: Path, base: Path, requirements: Sequence[str], tell: Callable[[str], None]
) -> Environment:
    venv = folder / "venv"
    with tempfile.TemporaryDirectory() as wheels:
        asked = [*_carried(name, Path(wheels)), *requirements]
        tell(f"making {venv}")
        uv = shutil.which("uv")
        try:
            if uv:
                _install_by_uv(uv, venv, base, asked, tell)
            else:
                raise ProofrollError("there is no uv")
        except ProofrollError as error:
            if uv:
                tell(f"{error}; trying pip")
            environments.delete(folder)
            folder.mkdir(parents=True)
            _install_by_pip(venv, base, asked, tell)
    tell(f"importing {name}")
    python = venv / "bin" / "python"
    try:
        version = describe(f"{name}@{python}").version
    except ProofrollError as error:
        reason = str(error).replace(f"{name}@{python}: ", "")
        raise ProofrollError(f"{name} does not work with {', '.join(requirements)}: {reason}") from None
    interpreter, packages = json.loads(_call([python, "-c", _PACKAGES]))
    return Environment(
        name=name,
        label=label,
        folder=folder,
        version=version,
        requirements=list(requirements),
        interpreter=interpreter,
        packages=packages,
    )


def _install_by_pip(venv: Path, base: Path, packages: Sequence[str], tell: Callable[[str], None]) -> None:
    """Installs packages into the environment by pip.

    The pip of this Python serves if the environment has the same Python; otherwise one is installed there first.
    """
    target = venv / "bin" / "python"
    if base == Path(sys.executable) and find_spec("pip"):
        _call([base, "-m", "venv", "--without-pip", venv])
        command: list[str | Path] = [base, "-m", "pip", "--python", target]
    else:  # pip does not serve Pythons newer than its own
        _call([base, "-m", "venv", venv])
        command = [target, "-m", "pip"]
    tell("installing by pip")
    _call([*command, "install", "--quiet", "--only-binary", ":all:", *packages])


def _install_by_uv(uv: str, venv: Path, base: Path, packages: Sequence[str], tell: Callable[[str], None]) -> None:
    _call([uv, "venv", "--quiet", "--python", base, venv])
    tell("installing by uv")
    target = str(venv / "bin" / "python")
    _call([uv, "pip", "install", "--quiet", "--python", target, "--only-binary", ":all:", *packages])


def _interpreter(python: str) -> Path:
    """Path of the Python from which an environment is made. Raises InputError if it is no Python or too old."""
    if not python:
        return Path(sys.executable)
    program = shutil.which(str(Path(python).expanduser()))
    if program is None:
        raise InputError("--python", python, "there is no such program; give the command or the path of a Python")
    try:
        # A command may be a script around the real one, as pyenv's are.
        output = _call(
            [program, "-c", "import sys; print(sys.executable); print(sys.version_info[0], sys.version_info[1])"]
        )
        executable, version = output.splitlines()[-2:]
        numbers = tuple(map(int, version.split()))
    except (ProofrollError, ValueError) as error:
        raise InputError("--python", python, f"it does not run as a Python: {error}") from None
    if numbers < OLDEST:
        least = ".".join(map(str, OLDEST))
        raise InputError(
            "--python", python, f"it is Python {version.replace(' ', '.')}; proofroll needs {least} or later"
        )
    return Path(executable)


def _carried(name: str, wheels: Path) -> list[str]:
    """Wheels of this proofroll and of the package of the engine's adapter: the environment gets the same code."""
    names = ["proofroll"]
    for point in announced(GROUP):
        if point.name == name and point.dist is not None and point.dist.name not in names:
            names.append(point.dist.name)
    return [str(_wheel(metadata.distribution(item), wheels)) for item in names]


def _wheel(item: metadata.Distribution, folder: Path) -> Path:
    """Wheel rebuilt from the files of an installed package (PEP 376, PEP 427).

    For a package in editable mode it contains the path of the source, which is then shared.
    """
    files = [file for file in item.files or () if ".." not in file.parts and "__pycache__" not in file.parts]
    info = next((file.parts[0] for file in files if file.parts[0].endswith(".dist-info")), None)
    if info is None:
        raise ProofrollError(f"{item.name} was installed without a list of its files; install it by pip")
    written = re.sub(r"[-_.]+", "_", item.name)
    path = folder / f"{written}-{item.version}-py3-none-any.whl"
    records = []
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in files:
            if file.parts[0] == info and file.name in {"RECORD", "INSTALLER", "REQUESTED", "direct_url.json"}:
                continue
            content = Path(str(item.locate_file(file))).read_bytes()
            archive.writestr(str(file), content)
            seal = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
            records.append(f"{file},sha256={seal},{len(content)}")
        archive.writestr(f"{info}/RECORD", "\n".join([*records, f"{info}/RECORD,,", ""]))
    return path


def _call(command: Sequence[str | Path]) -> str:
    """Output of a program; when this process is interrupted, the program and all that it started are killed."""
    try:
        process = subprocess.Popen(
            command,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            stdin=subprocess.DEVNULL,
            env=environment_of_another(),
            start_new_session=True,
            text=True,
            errors="replace",
        )
    except OSError as error:
        raise ProofrollError(f"{command[0]} cannot be started ({error.strerror or error})") from None
    try:
        printed, errors_printed = process.communicate()
    except BaseException:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        raise
    if process.returncode:
        errors = [line for line in errors_printed.splitlines() if line.startswith("ERROR:")]
        words = " ".join(" ".join(errors or errors_printed.splitlines() or printed.splitlines()).split())
        words = _VERSIONS.sub(r"(the last versions are \1)", words)[-_WORDS:]
        program = Path(str(command[0])).name
        what = " ".join(str(item) for item in command[1:4] if str(item).isascii() and len(str(item)) < 20)
        raise ProofrollError(f"{program} {what} failed ({process.returncode}): {words}")
    return printed
