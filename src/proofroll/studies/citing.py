"""References behind a result: of its engines, its scenes, the truth and proofroll itself.

Each is in a file ``references.bib`` beside its subject: the module of an engine or a truth, or a ``scene.toml``.
"""

import dataclasses
import json
import re
from collections.abc import Iterable, Iterator
from importlib.machinery import PathFinder
from importlib.util import find_spec
from pathlib import Path

import proofroll
from proofroll.core.entry_points import announced
from proofroll.core.errors import InputError
from proofroll.core.plugins import GROUP, engine_names, parse_engine, plain_name
from proofroll.core.truth import TRUTHS, load_truths
from proofroll.files.atomic import ordinary_content
from proofroll.files.comparison_file import load_comparison
from proofroll.files.scene_file import is_scene, load_scene, means_scene, read_scene_file, scene_folder
from proofroll.files.toml import named_file
from proofroll.files.trajectory_file import NETCDF, STORED, read

FILE = "references.bib"


@dataclasses.dataclass(frozen=True)
class Cited:
    """A subject that a result depends on, with references to cite for it.

    Attributes:
        kind: ``suite``, ``truth``, ``engine`` or ``scene``.
        name: of the subject.
        versions: of all results, each once.
        source: origin of a scene, in the words of its file.
        references: entries of BibTeX; empty if none is known.
    """

    kind: str
    name: str
    versions: list[str] = dataclasses.field(default_factory=list)
    source: str = ""
    references: list[str] = dataclasses.field(default_factory=list)

    @property
    def heading(self) -> str:
        """Heading of a citation: the subject with its versions."""
        versions = f" {', '.join(self.versions)}" if self.versions else ""
        return f"{self.name}{versions}" if self.kind == "suite" else f"{self.kind} {self.name}{versions}"


# Subject named in a result: ``scene`` or ``engine``, its name, and its version or "".
_Named = tuple[str, str, str]


def citations(subjects: Iterable[str]) -> list[Cited]:
    """References behind results, comparisons, scenes or engines; without a scene all truths are cited.

    Args:
        subjects: files of results (``.json`` of a command, ``.nc`` or ``.npz`` of a run), comparisons, scenes, names of
            engines.

    Raises:
        InputError: a subject is none of these.
    """
    engines: dict[str, list[str]] = {}
    scenes: dict[str, None] = {}
    for kind, name, version in (named for subject in subjects for named in _named(subject)):
        if kind == "scene":
            scenes[name] = None
            continue
        versions = engines.setdefault(plain_name(name), [])
        if version and version not in versions:
            versions.append(version)
    citations = [
        Cited("suite", "proofroll", [proofroll.__version__], references=entries(Path(proofroll.__file__).parent)),
        Cited("truth", "by two routes", references=_beside(_truths_of(scenes))),
    ]
    citations += [
        Cited(
            "engine",
            name,
            versions,
            references=_beside(point.module for point in announced(GROUP) if point.name == name),
        )
        for name, versions in engines.items()
        if name != "truth"
    ]
    return citations + [_scene(name) for name in scenes]


def _named(subject: str) -> list[_Named]:
    """Scenes and engines in a subject."""
    path = Path(subject)
    if path.suffix in {".json", NETCDF, STORED} and path.is_file():
        named = list(_walk(_document(path)))
        if not named:
            raise InputError("result", path.name, "it names neither an engine nor a scene; name a file of proofroll's")
        return named
    if means_scene(subject):
        return [("scene", subject, "")]
    if subject in engine_names():
        return [("engine", subject, "")]
    if named_file(subject) is None:
        raise InputError("subject", subject, "there is no such scene, engine, comparison or file of results")
    comparison = load_comparison(subject)
    engines = (parse_engine(row.engine).name for row in comparison.rows)
    return [("scene", comparison.scene, ""), *(("engine", name, "") for name in engines)]


def _document(path: Path) -> object:
    """Content of a file of results that names engines and scenes."""
    try:
        if path.suffix == ".json":
            return json.loads(ordinary_content(path))
        attrs = dict(read(path).attrs)
        return attrs | {"versions": json.loads(attrs.get("versions", "{}"))}
    except (OSError, RecursionError, TypeError, ValueError) as error:
        raise InputError("result", path.name, f"this cannot be read ({error})") from None


def _walk(content: object) -> Iterator[_Named]:
    """Engines and scenes named anywhere in a JSON document of proofroll."""
    if isinstance(content, list):
        for item in content:
            yield from _walk(item)
    if not isinstance(content, dict):
        return
    versions = content.get("versions")
    names = {*engine_names(), "truth"}
    for name, version in (versions if isinstance(versions, dict) else {}).items():
        if plain_name(name) in names:
            yield "engine", name, str(version or "")
    for key in ("engine", "name"):
        name = str(content.get(key)).partition("[")[0]
        if isinstance(content.get(key), str) and plain_name(name) in names:
            yield "engine", name, str(content.get("version") or "")
    scene = content.get("scene")
    if isinstance(scene, str) and is_scene(scene):
        yield "scene", scene, ""
    for item in content.values():
        yield from _walk(item)


def _scene(name: str) -> Cited:
    try:
        folder = scene_folder(name)
    except InputError:  # the file of a robot
        return Cited("scene", name, source=read_scene_file(name).source)
    return Cited("scene", name, source=read_scene_file(name).source, references=entries(folder))


def _truths_of(scenes: Iterable[str]) -> list[str]:
    """Modules of the truths that cover these scenes; of all truths if there is no scene."""
    announcements = announced(TRUTHS)
    elements = [element for name in scenes for element in load_scene(name).elements]
    if not elements:
        return [point.module for point in announcements]
    truths = list(zip(announcements, load_truths(), strict=True))
    used = (next((point.module for point, truth in truths if truth.covers(part)), None) for part in elements)
    return [module for module in dict.fromkeys(used) if module is not None]


def _beside(modules: Iterable[str]) -> list[str]:
    """References beside modules, without importing these, as an engine may not be installed."""
    folders = map(_folder, modules)
    return list(dict.fromkeys(entry for folder in folders if folder for entry in entries(folder)))


def _folder(module: str) -> Path | None:
    """Folder of a module's nearest ``references.bib``: beside it, or in a package around it."""
    package, *rest = module.split(".")
    spec, folders = find_spec(package), []
    while spec is not None and spec.submodule_search_locations:
        folders.append(Path(next(iter(spec.submodule_search_locations))))
        spec = PathFinder.find_spec(".".join([spec.name, rest.pop(0)]), [str(folders[-1])]) if rest else None
    if not folders and spec is not None and spec.origin:
        folders.append(Path(spec.origin).parent)
    return next((folder for folder in reversed(folders) if (folder / FILE).is_file()), None)


def entries(folder: Path) -> list[str]:
    """Entries of a folder's ``references.bib``; none if there is no such file."""
    path = folder / FILE
    text = path.read_text(encoding="utf-8") if path.is_file() else ""
    return [entry.strip() for entry in re.split(r"^(?=@)", text, flags=re.MULTILINE) if entry.startswith("@")]
