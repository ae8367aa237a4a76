"""What xarray imports besides when a run is made and written."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

PROGRAM = """
import sys
from pathlib import Path
from proofroll.files.trajectory_file import import_xarray, read, write

import_xarray()
import xarray

for name in ("run.npz", "run.nc"):
    write(xarray.Dataset({"z": ("time", [1.0])}), Path(name))
    assert float(read(Path(name)).z[0]) == 1.0
found = {"dask", "distributed"} & set(sys.modules)
assert not found, found  # neither imported, nor hidden from whoever wants it
"""


def test_dask_is_not_imported_for_nothing(tmp_path: Path) -> None:
    """A process that makes and writes a run has imported neither dask nor its scheduler, and may still do so."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], cwd=tmp_path, capture_output=True, text=True, timeout=600, check=False
    )
    assert done.returncode == 0, done.stderr
