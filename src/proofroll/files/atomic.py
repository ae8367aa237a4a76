"""Files that are written atomically: completely or not at all."""

import contextlib
import errno
import os
import resource
import stat
import tempfile
import uuid
from collections.abc import Iterator
from pathlib import Path

from proofroll.core.errors import Unwritable


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Context manager with a temporary path; its file replaces ``path`` at the end, or is removed after an error.

    Raises:
        Unwritable: the file cannot be written.
    """
    temporary = path.with_name(f".{path.name}.{uuid.uuid4().hex[:12]}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        temporary.replace(path)
    except OSError as error:
        reason = error.strerror or str(error)
        raise Unwritable(
            f"{path} cannot be written ({reason}); choose another path", error.errno or 0, reason
        ) from None
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


# Reasons that lie with the disk, however much of a file is written.
_OF_THE_DISK = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EIO})


def is_unwritable_here(folder: Path, error: Unwritable) -> bool:
    """True if this process could not write the file either; otherwise the process that tried has spoilt itself.

    A limit of the size of files is inherited, so that one of this process explains another's; beyond that a byte
    written into the folder tells.
    """
    if error.number in _OF_THE_DISK:
        return True
    if error.number == errno.EFBIG:
        return resource.getrlimit(resource.RLIMIT_FSIZE)[0] != resource.RLIM_INFINITY
    try:
        with tempfile.TemporaryFile(dir=folder) as probe:
            probe.write(b"0")
    except OSError:
        return True
    return False


def ordinary_content(path: Path) -> bytes:
    """Content of an ordinary file. A pipe would block, and a device may have no end.

    Raises:
        OSError: the file cannot be read, or is no ordinary file.
    """
    with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK), "rb") as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise OSError(f"{path} is no ordinary file")
        return file.read()
