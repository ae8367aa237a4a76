"""Says with which arithmetic a process computes; runs in a process of its own."""

from __future__ import annotations

import ctypes
import json
import sys
from importlib import import_module
from pathlib import Path

# What OpenBLAS calls its question, by itself and as it is built into numpy's wheels.
_ASKS = ("scipy_openblas_get_corename64_", "scipy_openblas_get_corename", "openblas_get_corename64_")


def main() -> None:
    """Computes a little, which ends the process where the processor cannot, and prints what it computed with."""
    import numpy as np
    import scipy.linalg

    umath = import_module("numpy._core._multiarray_umath")  # numpy has no public name for it

    matrix = np.sin(np.arange(4096.0).reshape(64, 64)) + 64 * np.eye(64)
    scipy.linalg.solve(matrix @ matrix.T, np.exp(np.arange(64.0) / 64))
    used = [name for name, there in umath.__cpu_features__.items() if there]
    json.dump({"core": _core(), "features": used, "heyoka": sys.modules.get("heyoka", ...) is not None}, sys.stdout)


def _core() -> str:
    """Processor that the loaded OpenBLAS computes for; empty: there is none, or it is not known."""
    maps = Path("/proc/self/maps")
    if not maps.exists():
        return ""
    loaded = {line.split()[-1] for line in maps.read_text(encoding="utf-8").splitlines() if "openblas" in line}
    for path in sorted(loaded):
        library = ctypes.CDLL(path)
        for name in _ASKS:
            if hasattr(library, name):
                asked = getattr(library, name)
                asked.restype = ctypes.c_char_p
                return str(asked().decode())
    return ""
