"""Where models and comparisons lie: inside an installed wheel, or at the top of the repository."""

from __future__ import annotations

from pathlib import Path

from proofroll.core.errors import ProofrollError

_PACKAGE = Path(__file__).resolve().parents[1]


def data_folder(kind: str) -> Path:
    """The folder ``models`` or ``comparisons``.

    Raises:
        ProofrollError: neither the installed package nor a repository around it holds the folder.
    """
    for candidate in (_PACKAGE / kind, _PACKAGE.parents[1] / kind):
        if candidate.is_dir():
            return candidate
    raise ProofrollError(f"the folder {kind}/ is neither in the installed package nor beside src/; reinstall proofroll")
