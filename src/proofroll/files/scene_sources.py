"""Files of other formats that hold a scene; who reads them is announced by entry points ``proofroll.scene_sources``."""

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, ClassVar, Protocol

from proofroll.core.announced import loaded

GROUP = "proofroll.scene_sources"


class SceneSource(Protocol):
    """Reads files of a format as scenes.

    Attributes:
        endings: of the files that it reads, with the dot, in small letters.
    """

    endings: ClassVar[tuple[str, ...]]

    @staticmethod
    def content(path: Path) -> Mapping[str, Any]:
        """Content of the scene as in a ``scene.toml``: title, source, parameters, reason, duration.

        Raises:
            InputError: the file is broken; the first thing that is wrong with it.
        """

    @staticmethod
    def tables(path: Path, values: Mapping[str, float]) -> Mapping[str, Any]:
        """The tables of a ``scene.toml``, gravity among them, with numbers in place of parameters.

        Args:
            path: of the file.
            values: of its parameters.

        Raises:
            InputError: no scene has what the file says with these parameters.
        """


def source_of(name: str) -> tuple[type[SceneSource], Path] | None:
    """Source that reads a file of another format, with its path; None: the file is not of another format."""
    path = Path(name)
    try:
        if not path.suffix or not path.is_file():
            return None  # without loading those who read files: most names are of folders
    except (OSError, ValueError):  # too long for a file system, or a zero byte
        return None
    source = _sources().get(path.suffix.lower())
    return None if source is None else (source, path)


@cache
def _sources() -> dict[str, type[SceneSource]]:
    sources = (source for _, source in loaded(GROUP, like=SceneSource))
    return {ending: source for source in sources for ending in source.endings}
