"""Results on disk: one trajectory and one record per case, each whole or not there, named by the case's key."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
import tempfile
from pathlib import Path

from proofroll.case import LASTING, Case, Result
from proofroll.errors import ProofrollError
from proofroll.files import replacing


def write_text(path: Path, text: str) -> None:
    """Writes a text file so that it is either whole or not there.

    Raises:
        ProofrollError: the place cannot be written.
    """
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


class Store:
    """Results under one folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        try:
            folder.mkdir(parents=True, exist_ok=True)
            probe, name = tempfile.mkstemp(dir=folder)
            os.close(probe)
            Path(name).unlink()
        except OSError as error:
            raise ProofrollError(
                f"{folder} cannot be written ({error.strerror or error}); choose another place with --out"
            ) from None

    def trajectory(self, case: Case) -> Path:
        """File of the case's trajectory."""
        return self.folder / f"{case.key}.nc"

    def put(self, case: Case, result: Result) -> Result:
        """Keeps a result whose trajectory, if any, is already in place."""
        if result.trajectory is not None:
            checksum = hashlib.sha256(self.trajectory(case).read_bytes()).hexdigest()
            result = dataclasses.replace(result, checksum=checksum)
        if result.status in LASTING:
            record = {"case": dataclasses.asdict(case), "result": dataclasses.asdict(result)}
            write_text(self.folder / f"{case.key}.json", json.dumps(record | {"seal": _seal(record)}, indent=1))
        return result

    def get(self, case: Case) -> Result | None:
        """The stored result, or None if there is none or it is not what was stored."""
        try:
            record = json.loads((self.folder / f"{case.key}.json").read_text(encoding="utf-8"))
            if record.pop("seal") != _seal(record):
                return None
            result = Result.from_dict(record["result"])
            if result.trajectory is not None:
                content = self.trajectory(case).read_bytes()
                if hashlib.sha256(content).hexdigest() != result.checksum:
                    return None
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            return None  # absent, truncated or tampered with: the case is run again
        return result


def _seal(record: object) -> str:
    """Hash of a record, so that one whose numbers were changed is not believed."""
    return hashlib.sha256(json.dumps(record, sort_keys=True).encode()).hexdigest()


def move(source: Path, target: Path) -> None:
    """Puts a finished file in its place, whole or not at all, also across file systems.

    Raises:
        ProofrollError: the place cannot be written.
    """
    with replacing(target) as temporary:
        temporary.write_bytes(source.read_bytes())
