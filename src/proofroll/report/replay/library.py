"""Parts of the page for the replay besides its own program: three.js, and numbers packed small."""

import io
import re
import zipfile
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution
from typing import Any

import numpy as np
import numpy.typing as npt

from proofroll.report.pages import packed

# trimesh is asked for its files, never imported. The script of its viewer begins with three.js as its makers built it:
# their notice, then the program, which defines THREE, in one line; what comes after it is not wanted.
_PACKAGE = "trimesh"
_VIEWER = "trimesh/resources/templates/viewer.zip"
_SCRIPT = re.compile(r"(/\*\*[^/]*Three\.js Authors[^/]*\*/)\s*(!function[^\n]*THREE=\{\}[^\n]*)")
_REVISION = re.compile(r'"use strict";const \w+="(\d+)"')


@cache
def three() -> dict[str, str] | None:
    """three.js from the installed trimesh, or None where there is none.

    Returns:
        ``packed``: the script, compressed (:func:`packed`); ``version``: which, and where from; ``licence``: its
        makers' notice and the terms.
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

    Little-endian int32, first the lowest bytes of all differences, then the next: what changes smoothly leaves mostly
    zeros.

    Args:
        values: shape (n, width) or (n,); what is beyond 2^30 steps is drawn there.
        step: in the unit of the values.
    """
    rows = np.asarray(values, dtype=np.float64).reshape(len(values), -1)
    steps = np.clip(np.round(np.nan_to_num(rows) / step), -(2**30), 2**30).astype("<i4")
    changes = np.diff(steps, axis=0, prepend=np.int32(0)).astype("<i4")
    return changes.reshape(-1).view(np.uint8).reshape(-1, 4).T.tobytes()
