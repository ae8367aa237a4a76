"""Folders of models and studies: in an installed wheel, at the top of the repository, or in other packages."""

from functools import cache
from pathlib import Path
from types import ModuleType

from proofroll.core.entry_points import loaded
from proofroll.core.errors import ProofrollError
from proofroll.core.source_code import OWN

STUDY_FOLDERS = "proofroll.study_folders"


def data_folder(kind: str) -> Path:
    """Path of the folder ``models``, ``comparisons`` or ``findings``.

    Raises:
        ProofrollError: neither the installed package nor a repository around it has the folder.
    """
    for candidate in (OWN / kind, OWN.parents[1] / kind):
        if candidate.is_dir():
            return candidate
    raise ProofrollError(f"the folder {kind}/ is neither in the installed package nor beside src/; reinstall proofroll")


@cache
def study_folders() -> tuple[Path, ...]:
    """Folders with files of comparisons and other studies: ``comparisons``, and those of announced modules."""
    modules = (module for _, module in loaded(STUDY_FOLDERS, ModuleType))
    return (data_folder("comparisons"), *(Path(module.__file__).parent for module in modules))
