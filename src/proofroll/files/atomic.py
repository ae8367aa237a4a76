"""Files that are either whole or not there."""

import contextlib
import os
import stat
import uuid
from collections.abc import Iterator
from pathlib import Path

from proofroll.core.errors import ProofrollError


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A name beside ``path`` to write to: the file takes the place of ``path`` at the end, or is gone.

    Raises:
        ProofrollError: the place cannot be written.
    """
    temporary = path.with_name(f".{path.name}.{uuid.uuid4().hex[:12]}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        temporary.replace(path)
    except OSError as error:
        raise ProofrollError(f"{path} cannot be written ({error.strerror or error}); choose another place") from None
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


def ordinary_content(path: Path) -> bytes:
    """Content of an ordinary file; no pipe, which would block, and no device, which may have no end.

    Raises:
        OSError: it cannot be read, or is no ordinary file.
    """
    with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK), "rb") as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise OSError(f"{path} is no ordinary file")
        return file.read()
