"""Library of the replay page (three.js), and compression of its numbers."""

import io
import re
import zipfile
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution
from typing import Any

import numpy as np
import numpy.typing as npt

from proofroll.report.pages import packed

# Only the files of trimesh are read; it is never imported. The script of its viewer begins with three.js as published:
# notice of its authors, then the program, which defines THREE, in one line. The rest of the script is not used.
_PACKAGE = "trimesh"
_VIEWER = "trimesh/resources/templates/viewer.zip"
_SCRIPT = re.compile(r"(/\*\*[^/]*Three\.js Authors[^/]*\*/)\s*(!function[^\n]*THREE=\{\}[^\n]*)")
_REVISION = re.compile(r'"use strict";const \w+="(\d+)"')


@cache
def three() -> dict[str, str] | None:
    """three.js from the installed trimesh; None without it.

    Returns:
        ``packed``: the script, compressed (:func:`packed`); ``version``: its revision and source; ``licence``: its
        authors' notice and the terms.
    """
    try:
        package = distribution(_PACKAGE)
        with zipfile.ZipFile(io.BytesIO(_bytes(package, _VIEWER))) as viewer:
            page = viewer.read(viewer.namelist()[0]).decode("utf-8")
        licence = next(str(file) for file in package.files or [] if file.name.startswith("LICENSE"))
        terms = _bytes(package, licence).decode("utf-8")
    except (PackageNotFoundError, OSError, KeyError, StopIteration, zipfile.BadZipFile):
        return None
    script = _SCRIPT.search(page)
    if script is None:
        return None
    notice, program = script.groups()
    revision = _REVISION.search(program)
    return {
        "packed": packed(f"{notice}\n{program}\n".encode()),
        "version": f"three.js {'r' + revision[1] if revision else ''} from {_PACKAGE} {package.version}",
        "licence": f"{notice}\n{terms[terms.index('Permission is') :]}" if "Permission is" in terms else notice,
    }


def _bytes(package: Any, name: str) -> bytes:
    return bytes(package.locate_file(name).read_bytes())


def thinned(values: npt.NDArray[Any], step: float) -> bytes:
    """Numbers coded for compression: multiples of ``step``, as differences from the row before.

    Little-endian int32, first the lowest bytes of all differences, then the next ones: smooth curves give mostly zeros.

    Args:
        values: shape (n, width) or (n,); clipped to 2^30 steps.
        step: in the unit of the values.
    """
    rows = np.asarray(values, dtype=np.float64).reshape(len(values), -1)
    steps = np.clip(np.round(np.nan_to_num(rows) / step), -(2**30), 2**30).astype("<i4")
    changes = np.diff(steps, axis=0, prepend=np.int32(0)).astype("<i4")
    return changes.reshape(-1).view(np.uint8).reshape(-1, 4).T.tobytes()
