"""Environments of engines in other versions, made by ``proofroll engines add`` in the user's data folder.

Each is a folder ``NAME/LABEL/`` with the virtual environment ``venv`` and the stamp ``engine.json``. The stamp is
written last: a folder without it is incomplete and is made anew. An environment is never changed in place, so that a
label keeps its meaning.
"""

import contextlib
import json
import os
import re
import shutil
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path

from proofroll.core.errors import InputError, ProofrollError, choices
from proofroll.core.plugins import place_of, plain_name

VARIABLE = "PROOFROLL_ENGINES"
STAMP = "engine.json"
_LABEL = r"\w[\w.+-]*"


@dataclass(frozen=True)
class Environment:
    """A complete environment.

    Attributes:
        name, label: of the engine ``NAME@LABEL``.
        folder: its folder.
        version: of the engine, read from the engine when the environment was made.
        requirements: list given to pip when it was made.
        interpreter: version of its Python.
        packages: all installed packages, ``name==version``.
    """

    name: str
    label: str
    folder: Path
    version: str = ""
    requirements: list[str] = field(default_factory=list)
    interpreter: str = ""
    packages: list[str] = field(default_factory=list)

    @property
    def python(self) -> Path:
        """Path of its Python."""
        return self.folder / "venv" / "bin" / "python"

    def stamp(self) -> None:
        """Writes its stamp, which makes it complete."""
        from proofroll.files.atomic import replacing

        content = asdict(self) | {"folder": str(self.folder)}
        with replacing(self.folder / STAMP) as temporary:
            temporary.write_text(json.dumps(content, indent=1), encoding="utf-8")


def root() -> Path:
    """Folder of environments: ``PROOFROLL_ENGINES``, or ``proofroll/engines`` below ``XDG_DATA_HOME``."""
    chosen = os.environ.get(VARIABLE)
    if chosen:
        return Path(chosen).expanduser().absolute()
    data = Path(os.environ.get("XDG_DATA_HOME", ""))
    # The XDG specification says to ignore a relative path.
    return (data if data.is_absolute() else Path.home() / ".local" / "share") / "proofroll" / "engines"


def remembered() -> list[Environment]:
    """All complete environments, sorted by name and label."""
    environments = (_read(stamp.parent) for stamp in sorted(root().glob(f"*/*/{STAMP}")))
    return [item for item in environments if item is not None]


def find(name: str, label: str) -> Environment | None:
    """The environment ``name@label``, or None if there is none."""
    return _read(folder_of(name, label)) if re.fullmatch(_LABEL, label) else None


def shown_name(engine: str) -> str:
    """Short ``NAME@PLACE``: a path of a Python becomes the label of its environment, or the name of its folder."""
    name, place = plain_name(engine), place_of(engine)
    if os.sep not in place:
        return engine
    path = Path(os.path.abspath(Path(place).expanduser()))
    labels = (item.label for item in remembered() if path in {item.python, item.folder / "venv"})
    folder = path.parent.parent if path.parent.name == "bin" else path
    return f"{name}@{next(labels, folder.name)}"


def folder_of(name: str, label: str) -> Path:
    """Folder of an environment. Raises InputError if the label cannot be the name of a folder."""
    if not re.fullmatch(_LABEL, label):
        raise InputError("label", label, "use letters, digits, dots, hyphens and plus signs, e.g. 3.8.1")
    return root() / name / label


def remove(engine: str) -> None:
    """Deletes the environment ``NAME@LABEL``, also an incomplete one.

    Raises:
        InputError: there is none.
        ProofrollError: the folder cannot be deleted.
    """
    labels = [f"{item.name}@{item.label}" for item in remembered()]
    folder = folder_of(plain_name(engine), place_of(engine)) if place_of(engine) else None
    if folder is None or not folder.is_dir():
        there_are = f"choose from {choices(labels)}" if labels else "there is none"
        raise InputError("environment", engine, f"no such environment is remembered; {there_are}")
    with making(folder):
        delete(folder)


def delete(folder: Path) -> None:
    """Deletes the folder of an environment, its stamp first, so that an incomplete rest is recognised.

    Raises:
        ProofrollError: the folder cannot be deleted.
    """
    try:
        (folder / STAMP).unlink(missing_ok=True)
        if folder.is_symlink():
            folder.unlink()
        elif folder.exists():
            shutil.rmtree(folder)
    except OSError as error:
        raise ProofrollError(f"{folder} cannot be deleted ({error.strerror or error})") from None
    with contextlib.suppress(OSError):
        folder.parent.rmdir()  # of the engine's last one


@contextlib.contextmanager
def making(folder: Path) -> Iterator[None]:
    """Context manager with a lock on an environment, so that no other process makes or deletes it.

    Raises:
        ProofrollError: another process has the lock, or the folder cannot be written.
    """
    import fcntl

    try:
        root().mkdir(parents=True, exist_ok=True)
        lock = os.open(root() / f".{folder.parent.name}@{folder.name}.lock", os.O_CREAT | os.O_RDWR, 0o644)
    except OSError as error:
        fault = f"{root()} cannot be written ({error.strerror or error}); choose another folder by {VARIABLE}"
        raise ProofrollError(fault) from None
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(lock)
        raise ProofrollError(f"{folder} is being made or deleted by another process; wait for it") from None
    try:
        yield
    finally:
        os.close(lock)  # the file stays: were it deleted, two processes could hold locks of the same name


def _read(folder: Path) -> Environment | None:
    try:
        content = json.loads((folder / STAMP).read_text(encoding="utf-8"))
        kept = {key: content[key] for key in ("version", "requirements", "interpreter", "packages")}
        return Environment(folder.parent.name, folder.name, folder, **kept)  # it may have been moved
    except (OSError, ValueError, KeyError, TypeError):
        return None
