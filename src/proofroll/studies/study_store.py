"""Studies that take minutes, kept as files, and believed while what they hang on is what it was."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from proofroll.files.atomic import ordinary_content
from proofroll.files.json_data import plain, record
from proofroll.running.store import write_text
from proofroll.studies import study_identity
from proofroll.studies.study_identity import Measured

_Study = TypeVar("_Study")


def kept(path: Path, kind: type[_Study]) -> tuple[_Study | None, list[str]]:
    """A kept study if it still holds here.

    Returns:
        the study, or None and why there is none: what has changed since, or nothing if there is no such file.
    """
    try:
        content = json.loads(ordinary_content(path))
        if content["seal"] != _seal(content):
            return None, ["what is stored is not what had been put there"]
        reasons = study_identity.changes(record(Measured, content["measured"]))
        return (None, reasons) if reasons else (record(kind, content), [])
    except (OSError, ValueError, KeyError, TypeError, RecursionError):  # absent, half written, or something else
        return None, []


def _seal(study: Mapping[str, Any]) -> str:
    """Hash of all that a kept study holds besides it: a file that was cut or changed does not have it."""
    content = {key: value for key, value in study.items() if key != "seal"}
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def keep(study: Any, path: Path) -> None:
    """Writes a study as :func:`kept` reads it.

    Raises:
        ProofrollError: the folder cannot be written.
    """
    content = plain(study)
    write_text(path, json.dumps({**content, "seal": _seal(content)}))
