"""Results on disk: one trajectory and one record per case, named by the case's key and written atomically."""

import atexit
import contextlib
import dataclasses
import fcntl
import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import ClassVar
from weakref import WeakValueDictionary

from proofroll.core.errors import ProofrollError, Unwritable
from proofroll.files.atomic import ordinary_content, replacing
from proofroll.files.trajectory_file import STORED, StoredTrajectory
from proofroll.running.case import LASTING, Case, Result


def write_text(path: Path, text: str) -> None:
    """Writes a text file atomically.

    Raises:
        ProofrollError: the folder cannot be written.
    """
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


# Prefix of the folder of an unfinished trajectory, which its process has locked.
_INCOMING = ".incoming-"


class Store:
    """Results under one folder.

    Attributes:
        opened: True in a process that has opened such a folder.
    """

    opened: ClassVar[bool] = False

    def __init__(self, folder: Path) -> None:
        self.folder, Store.opened = folder, True
        self._held: WeakValueDictionary[str, StoredTrajectory] = WeakValueDictionary()
        absolute = folder.absolute()
        if made := [missing for missing in (absolute, *absolute.parents) if not missing.exists()]:
            atexit.register(_remove_empty, made)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            probe, name = tempfile.mkstemp(dir=folder)
            os.close(probe)
            Path(name).unlink()
            self._sweep()
        except OSError as error:
            raise ProofrollError(
                f"{folder} cannot be written ({error.strerror or error}); choose another folder with --out"
            ) from None

    def _sweep(self) -> None:
        """Removes unfinished trajectories of processes that were killed; those in use are locked and stay."""
        with self._locked(fcntl.LOCK_EX):
            for left in self.folder.glob(f"{_INCOMING}*"):
                with contextlib.suppress(OSError), _holding(left, fcntl.LOCK_EX | fcntl.LOCK_NB):  # else in use
                    shutil.rmtree(left, ignore_errors=True)

    def trajectory(self, case: Case) -> Path:
        """File of the case's trajectory."""
        return self.folder / f"{case.key}{STORED}"

    def stored(self, case: Case) -> StoredTrajectory:
        """Trajectory of a case; one shared object while it is in use, so that the file is read once."""
        return self._held.setdefault(case.key, StoredTrajectory(self.trajectory(case)))

    @contextlib.contextmanager
    def incoming(self, case: Case) -> Iterator[Path]:
        """Context manager with a file for a trajectory in a temporary folder, which is removed at the end.

        Raises:
            ProofrollError: the folder cannot be written.
        """
        with contextlib.ExitStack() as stack:
            try:
                with self._locked(fcntl.LOCK_SH):  # or _sweep of another process would remove it before it is locked
                    incoming = tempfile.mkdtemp(prefix=_INCOMING, dir=self.folder)
                    stack.callback(shutil.rmtree, incoming, ignore_errors=True)  # with an unfinished file, if any
                    with contextlib.suppress(OSError):  # the file system cannot lock
                        stack.enter_context(_holding(Path(incoming), fcntl.LOCK_SH))
            except OSError as error:
                reason = error.strerror or str(error)
                raise Unwritable(f"{self.folder} cannot be written ({reason})", error.errno or 0, reason) from None
            yield Path(incoming) / self.trajectory(case).name

    def has(self, case: Case) -> bool:
        """True if there is a record of the case, damaged or not."""
        return os.path.lexists(self.folder / f"{case.key}.json")

    def put(self, case: Case, result: Result, written: Path | None = None) -> Result:
        """Stores a result and its trajectory; returns the result with the checksum of the trajectory.

        Record and trajectory are replaced together, after both are completely on disk. A result that may change next
        time (:data:`LASTING`) is not stored, nor one that was cut, but for its trajectory.

        Args:
            case: of the run.
            result: outcome of the run.
            written: file of the trajectory, which is moved into place; None: it is in place already, or there is none.

        Raises:
            ProofrollError: the folder cannot be written; an earlier result is still there.
        """
        if result.trajectory is not None:
            path = written or self.trajectory(case)
            try:
                checksum = hashlib.sha256(ordinary_content(path)).hexdigest()
            except OSError as error:
                raise ProofrollError(f"{path} cannot be read ({error.strerror or error})") from None
            result = dataclasses.replace(result, checksum=checksum)
        if result.cut and written:
            with self._locked(fcntl.LOCK_EX):
                self._held.pop(case.key, None)
                written.replace(self.trajectory(case))
        elif result.status in LASTING:
            content = {"case": dataclasses.asdict(case), "result": dataclasses.asdict(result)}
            path = self.folder / f"{case.key}.json"
            with self._locked(fcntl.LOCK_EX), replacing(path) as record:
                record.write_text(json.dumps(content | {"seal": seal(content)}, indent=1), encoding="utf-8")
                for old in (path, self.trajectory(case)):
                    if old.is_dir() and not old.is_symlink():  # a folder instead of a result is damage
                        shutil.rmtree(old)
                self._held.pop(case.key, None)
                if written and result.trajectory is not None:
                    written.replace(self.trajectory(case))
        return result

    @contextlib.contextmanager
    def _locked(self, how: int) -> Iterator[None]:
        """Context manager with a lock on the folder, if the file system can lock."""
        with contextlib.ExitStack() as stack:
            with contextlib.suppress(OSError):
                stack.enter_context(_holding(self.folder, how))
            yield

    def get(self, case: Case) -> Result | None:
        """Stored result of a case; None if there is none or it is damaged."""
        try:
            with self._locked(fcntl.LOCK_SH):
                record = json.loads(ordinary_content(self.folder / f"{case.key}.json"))
                if record.pop("seal") != seal(record) or Case.from_dict(record["case"]).key != case.key:
                    return None
                result = Result.from_dict(record["result"])
                if result.trajectory is None:
                    return result
                checksum = hashlib.sha256(ordinary_content(self.trajectory(case))).hexdigest()
                return result if checksum == result.checksum else None
        except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError, MemoryError):
            return None  # absent, truncated, changed or not our file: the case is run again


@contextlib.contextmanager
def _holding(folder: Path, how: int) -> Iterator[None]:
    """Context manager with a lock on a folder, which the system releases even if the process is killed.

    Raises:
        OSError: another process has the lock and ``how`` does not wait, or the file system cannot lock.
    """
    opened = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(opened, how)
        yield
    finally:
        os.close(opened)


def _remove_empty(folders: Sequence[Path]) -> None:
    """Removes folders made for results if they stayed empty, the innermost first."""
    with contextlib.suppress(OSError):
        for folder in folders:
            folder.rmdir()


@contextlib.contextmanager
def alone_in(folder: Path, wait: Callable[[], None]) -> Iterator[None]:
    """Context manager that only one process at a time enters for a folder; ``wait`` is called before waiting."""
    with contextlib.ExitStack() as stack:
        try:
            stack.enter_context(_holding(folder, fcntl.LOCK_EX | fcntl.LOCK_NB))
        except BlockingIOError:
            wait()
            stack.enter_context(_holding(folder, fcntl.LOCK_EX))
        except OSError:
            pass  # the file system cannot lock
        yield


def seal(record: object) -> str:
    """Hash of a record, which reveals that it was changed."""
    return hashlib.sha256(json.dumps(record, sort_keys=True).encode()).hexdigest()
