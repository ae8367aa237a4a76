"""Files that are written atomically: completely or not at all."""

import contextlib
import os
import stat
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
        raise Unwritable(f"{path} cannot be written ({error.strerror or error}); choose another path") from None
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


def ordinary_content(path: Path) -> bytes:
    """Content of an ordinary file. A pipe would block, and a device may have no end.

    Raises:
        OSError: the file cannot be read, or is no ordinary file.
    """
    with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK), "rb") as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise OSError(f"{path} is no ordinary file")
        return file.read()
