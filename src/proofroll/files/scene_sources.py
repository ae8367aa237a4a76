"""Files of other formats that hold a scene; entry points ``proofroll.scene_sources`` announce their readers."""

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, ClassVar, Protocol

from proofroll.core.announced import loaded

GROUP = "proofroll.scene_sources"


class SceneSource(Protocol):
    """Reader of scenes in files of other formats.

    Attributes:
        endings: of the files that it reads, with the dot, in small letters.
    """

    endings: ClassVar[tuple[str, ...]]

    @staticmethod
    def content(path: Path) -> Mapping[str, Any]:
        """Content of the scene as in a ``scene.toml``: title, source, parameters, reason, duration.

        Raises:
            InputError: the file is broken; the first mistake in it.
        """

    @staticmethod
    def tables(path: Path, values: Mapping[str, float]) -> Mapping[str, Any]:
        """Tables as in a ``scene.toml``, gravity among them, with numbers instead of parameters.

        Args:
            path: of the file.
            values: of its parameters.

        Raises:
            InputError: the file with these parameters is no scene.
        """


def source_of(name: str) -> tuple[type[SceneSource], Path] | None:
    """Reader of a file of another format, and its path; None: the file is none."""
    path = Path(name)
    try:
        if not path.suffix or not path.is_file():
            return None  # most names are those of folders, so the readers need not be loaded
    except (OSError, ValueError):  # the name is too long for the file system, or has a zero byte
        return None
    source = _sources().get(path.suffix.lower())
    return None if source is None else (source, path)


@cache
def _sources() -> dict[str, type[SceneSource]]:
    sources = (source for _, source in loaded(GROUP, like=SceneSource))
    return {ending: source for source in sources for ending in source.endings}
