"""Data flows one way: the imports of every module lead only where its folder may lead."""

from __future__ import annotations

import ast
import graphlib
import importlib
import re
from collections.abc import Iterator
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import pytest
from source_code import PACKAGES, nodes, statements, tree

import proofroll
from proofroll.core.engine import Sample
from proofroll.core.events import EVENT_ORDER
from proofroll.core.plugins import load_element_kinds, load_engine

ROOT = Path(proofroll.__file__).parent
# What may import what. The harness knows neither a kind of element nor an engine nor a truth; these are plug-ins.
HARNESS = {"core", "files", "running", "studies", "report", "cli", "conformance"}
MAY: dict[str, set[str]] = {
    "core": {"core"},
    "files": {"core", "files"},
    "running": {"core", "files", "running"},
    "studies": {"core", "files", "running", "studies"},
    "conformance": {"core", "files", "running", "conformance"},
    "report": {"core", "files", "running", "studies", "report"},
    "cli": {"core", "files", "running", "studies", "report", "cli"},
    "elements": {"core", "files", "elements"},
    "truth": {"core", "elements", "truth"},
    "engines": {"core", "elements", "engines"},
    # as a package of somebody else would be
    "papers": HARNESS | {"elements", "truth", "engines", "papers"},
    "vocabulary": HARNESS | {"elements", "vocabulary"},
    # A plug-in: scenes of mechanisms to be run, and the engines' own importers of robot files.
    "robots": {"core", "files", "running", "studies", "report", "cli", "robots", "elements", "engines", "vocabulary"},
}
# A module of names for adapters, from their homes.
NAMES_OF_ADAPTERS = {"adapter": {"core", "elements", "papers"}}
# Engines to which a package adds formulations.
ENGINES = ["projection", *(name for name in ("exudyn", "mujoco", "pinocchio") if find_spec(name))]
# Rooms of robots -> those that each builds on, beside the robot as data.
ROOMS_OF_ROBOTS: dict[str, set[str]] = {
    "files": set(),
    "importers": set(),
    "hypotheses": {"files"},
    "check": {"files", "hypotheses"},
    "control": {"files", "hypotheses"},
}
AS_DATA = {"model", "states", "protocol"}
# What a kind adds to the report stands on the harness, as a plug-in of somebody else would.
PLUGIN_PARTS = {"report"}


# Packages that stand on this one: it imports none of them.
OUTSIDE = ("proofroll_benchmarks", "proofroll_drill", *(f"proofroll_{name}" for name in PACKAGES))
# A module by its name in a text, as ``import_module`` takes it, and an import in a program that is written.
_BY_NAME = re.compile(rf"(proofroll\.\w+\.|({'|'.join(OUTSIDE)})\b)")
_WRITTEN = re.compile(rf"(?:from|import) (proofroll\.\w+|{'|'.join(OUTSIDE)})")


@cache
def _texts(file: Path) -> list[tuple[int, str]]:
    """Every text of a module that is no docstring, with its line."""
    module = nodes(file)
    documented = {
        id(node.body[0].value)
        for node in module
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and node.body
        if isinstance(node.body[0], ast.Expr)
    }
    return [
        (node.lineno, node.value)
        for node in module
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in documented
    ]


@cache
def _imported(file: Path, root: Path = ROOT) -> list[tuple[int, str]]:
    """Lines and names of all modules that a file imports: anywhere in it, by name, and in programs that it writes."""
    if file.suffix != ".py":
        lines = enumerate(file.read_text(encoding="utf-8").splitlines(), 1)
        return [(number, name) for number, line in lines for name in _WRITTEN.findall(line)]
    found = []
    package = ("proofroll", *file.relative_to(root).parent.parts)
    for node in nodes(file):
        if isinstance(node, ast.ImportFrom):
            start = package[: len(package) - node.level + 1] if node.level else ()
            module = ".".join([*start, *([node.module] if node.module else [])])
            names = [f"{module}.{alias.name}" for alias in node.names] if module == "proofroll" else [module]
            found += [(node.lineno, name) for name in names]
        elif isinstance(node, ast.Import):
            found += [(node.lineno, alias.name) for alias in node.names]
    for number, text in _texts(file):
        found += [(number, text)] if _BY_NAME.match(text) and " " not in text else []
        found += [(number, name) for name in _WRITTEN.findall(text)]
    return [(number, name) for number, name in found if name.partition(".")[0] in {"proofroll", *OUTSIDE}]


def _files(folder: Path) -> list[Path]:
    return [file for file in folder.rglob("*") if file.suffix in {".py", ".txt", ".md", ".html", ".js", ".toml"}]


def _wrong(file: Path, root: Path = ROOT) -> list[str]:
    """The imports of a file that lead where its folder may not, each with its line."""
    folder, *inside = file.relative_to(root).with_suffix("").parts
    allowed = (MAY | NAMES_OF_ADAPTERS).get(folder, HARNESS | {"truth", "testing"})
    if (folder == "elements" and PLUGIN_PARTS & set(inside)) or "templates" in inside:
        allowed = allowed | HARNESS
    return [
        f"{file.relative_to(root)}:{line} imports {name}"
        for line, name in _imported(file, root)
        if name.partition(".")[0] in OUTSIDE
        or (name.split(".")[1:2] or ["core"])[0].partition(":")[0] not in allowed | {"core"}
    ]


@pytest.mark.parametrize("folder", [*sorted(MAY), "*"])
def test_imports_lead_one_way(folder: str) -> None:
    """No module imports from a folder that its own may not know, nor what stands on this package."""
    files = [file for file in ROOT.iterdir() if file.is_file()] if folder == "*" else _files(ROOT / folder)
    assert [line for file in files if file.suffix for line in _wrong(file)] == []


@pytest.mark.parametrize(
    ("place", "text", "line"),
    [
        ("studies/a.py", "def f():\n    from proofroll.elements.mechanism import model\n", 2),
        ("core/a.py", "if TYPE_CHECKING:\n    import proofroll.engines.mujoco as m\n", 2),
        ("core/a.py", "from proofroll import elements\n", 1),
        ("core/a.py", "from ..truth import onset\n", 1),
        ("core/a.py", "from proofroll import simulate\n", 1),
        ("running/a.py", "import proofroll.testing\n", 1),
        ("report/a.py", 'x = 1\nimport_module("proofroll.elements.mechanism.run.kind")\n', 2),
        ("running/a.py", 'import_module(f"proofroll.engines.{name}")\n', 1),
        ("cli/a.py", 'TEXT = "import x\\nfrom proofroll.papers.blajer_2006.truth.onset import onset"\n', 1),
        ("cli/templates/a.txt", "\nfrom proofroll.elements.mechanism import model\n", 2),
        ("studies/a.py", "import proofroll_drill.row\n", 1),
        ("engines/a.py", 'import_module("proofroll_drill.row")\n', 1),
        ("a.py", "from proofroll.elements import mechanism\n", 1),
        ("engines/a.py", "from proofroll.robots.protocol import Reading\n", 1),
    ],
)
def test_each_way_of_importing_is_seen(tmp_path: Path, place: str, text: str, line: int) -> None:
    """In a function, for types alone, relative, by name, in a program that is written: the line is named."""
    file = tmp_path / place
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)
    (wrong,) = _wrong(file, tmp_path)
    assert wrong.startswith(f"{place}:{line} imports ")


# Engines that share a part with the truth, and for what.
SHARED_WITH_TRUTH = {
    "engines/exudyn/contact/spheres.py imports proofroll.elements.mechanism.contact.tree_contacts",  # the start's load
    # It refuses with a reason and a remedy what the certificate would call a wrong model.
    "engines/mujoco/smooth/mechanism_model.py imports proofroll.elements.mechanism.run.certificate",
    "engines/projection/contact/contact_modes.py imports proofroll.elements.mechanism.contact.coulomb",  # its law alone
}


def test_engines_share_no_equations_with_the_truth_nor_limits_with_the_judge() -> None:
    """What moves joints and bodies in the truth, and what a certificate allows, is imported by no engine."""
    of_truth = {"joint_coordinates", "tree_contacts", "coulomb", "one_contact", "certificate"}
    shared = {
        f"{file.relative_to(ROOT)} imports {name}"
        for file in (ROOT / "engines").rglob("*.py")
        for _, name in _imported(file)
        if name.rpartition(".")[2] in of_truth and "elements" in name
    }
    assert shared == SHARED_WITH_TRUTH


def test_no_package_is_empty() -> None:
    """Each folder of src has a module or a folder of modules besides its ``__init__.py``."""
    packages = [file.parent for file in ROOT.rglob("__init__.py")]
    assert [str(folder.relative_to(ROOT)) for folder in packages if len([*folder.rglob("*.py")]) == 1] == []


def test_each_class_has_a_name_of_its_own() -> None:
    """No two public classes are called the same: a name says what it is wherever one reads it."""
    homes: dict[str, list[str]] = {}
    for file in ROOT.rglob("*.py"):
        for node in nodes(file):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                homes.setdefault(node.name, []).append(f"{file.relative_to(ROOT)}:{node.lineno}")
    assert {name: where for name, where in homes.items() if len(where) > 1} == {}


def test_the_harness_names_no_observable_and_no_failure_of_an_element() -> None:
    """What an observable is and how a run of it fails stands in the element's own table, and nowhere else."""
    elements = [
        item for kind in load_element_kinds() for scene in kind.conformance_scenes().values() for item in scene.elements
    ]
    known = {item.name for element in elements for item in element.observables} - {EVENT_ORDER, *Sample.widths}
    known |= {name for element in elements for name in (*element.failures, *element.failing_events)}
    wrong = [
        f"{file.relative_to(ROOT)} names {text}"
        for folder in sorted(HARNESS)
        for file in (ROOT / folder).rglob("*.py")
        for _, text in _texts(file)
        if text in known and file != ROOT / "core" / "events.py"  # the one list of kinds of events
    ]
    newtons = ["core/quantity.py", "core/unit_conversion.py", "files/scene_file.py", "report/run/last_values.py"]
    assert sorted(set(wrong)) == [f"{file} names N" for file in newtons]


def test_the_harness_knows_no_law_of_joints() -> None:
    """No line of the harness speaks of a servo, a gear, an armature or a stop: they are its elements' alone."""
    law = re.compile(r"actuator|coupling|armature|\bservo|restitution|dry friction|\bgears?\b|\bmimic", re.IGNORECASE)
    told = [
        f"{file.relative_to(ROOT)}:{number}: {line.strip()}"
        for folder in sorted(HARNESS)
        for file in sorted((ROOT / folder).rglob("*.[phj]*"))
        if file.suffix in {".py", ".html", ".js"}
        for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1)
        if law.search(line)
    ]
    assert told == []


def test_one_place_makes_cases() -> None:
    """What decides the result of a case is put together in one place, whichever study asks."""
    makers = {
        str(file.relative_to(ROOT))
        for file in ROOT.rglob("*.py")
        for node in nodes(file)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Case"
    }
    assert makers == {"studies/cases.py"}


def test_modules_are_short_enough_to_be_read_at_once() -> None:
    """No module has more than 500 lines: below, it is cut by subject, not by length."""
    repository = ROOT.parents[1]
    files = [
        file
        for folder in (
            ROOT,
            repository / "fuzz",
            repository / "throughput",
            repository / "cluster",
            repository / "balance",
        )
        for file in folder.rglob("*.py")
    ]
    long = [str(file.relative_to(repository)) for file in files if len(file.read_text().splitlines()) > 500]
    assert long == []


def _for_types_alone(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"


def _at_run_time(module: ast.Module) -> Iterator[ast.ImportFrom]:
    """The imports of a module that it carries out, wherever in it they stand; those for types alone are none."""
    return (node for node in statements(module, _for_types_alone) if isinstance(node, ast.ImportFrom))


@cache
def leading(root: Path) -> dict[str, set[str]]:
    """Each module of a package below ``root`` -> those of the package that it imports when it runs."""
    modules = {
        ".".join([root.name, *file.relative_to(root).with_suffix("").parts]).removesuffix(".__init__"): file
        for file in root.rglob("*.py")
        if "templates" not in file.parts
    }
    leads: dict[str, set[str]] = {}
    for name, file in modules.items():
        asked = [
            (node.module, f"{node.module}.{alias.name}") for node in _at_run_time(tree(file)) for alias in node.names
        ]
        leads[name] = {inner if inner in modules else str(outer) for outer, inner in asked} & modules.keys() - {name}
    return leads


def folders_of(leads: dict[str, set[str]], package: str) -> dict[str, set[str]]:
    """Each folder or module directly in a package -> the others there that it imports."""
    folders: dict[str, set[str]] = {}
    for name, others in leads.items():
        if name.startswith(f"{package}."):
            inside = [
                other[len(package) + 1 :].partition(".")[0] for other in others if other.startswith(f"{package}.")
            ]
            own = name[len(package) + 1 :].partition(".")[0]
            folders.setdefault(own, set()).update(set(inside) - {own})
    return folders


def circle(leads: dict[str, set[str]]) -> list[str]:
    """Modules or folders that import each other in a circle; empty: there is none."""
    try:
        graphlib.TopologicalSorter(leads).prepare()
    except graphlib.CycleError as error:
        return list(error.args[1])
    return []


def test_no_modules_import_each_other() -> None:
    """No module imports, even inside a function, one that leads back to it."""
    assert circle(leading(ROOT)) == []


@pytest.mark.parametrize("engine", ENGINES)
def test_no_engine_knows_what_is_added_to_it(engine: str) -> None:
    """No adapter names a formulation that a package adds to it."""
    added = load_engine(engine).added
    assert added
    files = (ROOT / "engines" / engine).rglob("*.py")
    assert [f"{file}:{line}" for file in files for line, text in _texts(file) if text in added] == []


def test_only_their_reader_knows_balls_on_surfaces() -> None:
    """Nobody imports the reader of balls on surfaces but their kind, the article and the list of the vocabulary."""
    knowing = {
        file.relative_to(ROOT).parts[0] + "/" + file.stem
        for file in ROOT.rglob("*.py")
        for _, name in _imported(file)
        if name.startswith("proofroll.elements.balls") and ROOT / "elements" / "balls" not in file.parents
    }
    assert knowing == {"papers/cylinder", "papers/kind", "vocabulary/document"}


def test_no_folders_of_studies_import_each_other() -> None:
    """A study of one folder builds on another's, and never the other way round as well."""
    assert circle(folders_of(leading(ROOT), "proofroll.studies")) == []


@pytest.mark.parametrize("plug_in", ["papers", "robots"])
def test_nothing_imports_papers_and_robots(plug_in: str) -> None:
    """Articles and robots are plug-ins, found by entry points: only the names of adapters import one."""
    wrong = [
        f"{file.relative_to(ROOT)}:{line} imports {name}"
        for file in _files(ROOT)
        if ROOT / plug_in not in file.parents and (file != ROOT / "adapter.py" or plug_in != "papers")
        for line, name in _imported(file)
        if name.split(".")[1:2] == [plug_in]
    ]
    assert wrong == []


def test_rooms_of_robots_build_on_files_and_data_alone() -> None:
    """Checks and controllers of robots know nothing of each other, nor files and importers of them."""
    folders = folders_of(leading(ROOT), "proofroll.robots")
    wrong = {
        room: folders[room] - may - AS_DATA for room, may in ROOMS_OF_ROBOTS.items() if folders[room] - may - AS_DATA
    }
    assert wrong == {}
    assert {name for module in AS_DATA for name in folders[module]} <= AS_DATA


@pytest.mark.parametrize("folder", MAY)
def test_the_map_says_what_a_folder_may_import(folder: str) -> None:
    """The map in CONTRIBUTING has the folders that each may import; *the above*: all in the rows above it."""
    text = (ROOT.parents[1] / "CONTRIBUTING.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| `(\w+)/` \|.*\| ([^|]*) \|$", text, flags=re.MULTILINE))
    names = set(re.findall(r"`(\w+)`", rows[folder].partition(";")[0]))
    if "the above" in rows[folder]:
        names |= set(list(rows)[: list(rows).index(folder)])
    assert names == MAY[folder] - {folder}


def test_a_circle_is_seen(tmp_path: Path) -> None:
    """Two modules that import each other are named, and an import for types alone makes no circle."""
    for folder, source in {
        "types": "if TYPE_CHECKING:\n    from pack.a import g\n", "circle": "def f():\n    from pack import a\n",
    }.items():  # fmt: skip
        package = tmp_path / folder / "pack"
        package.mkdir(parents=True)
        (package / "__init__.py").write_text("")
        (package / "a.py").write_text("from pack.b import f\n")
        (package / "b.py").write_text(source)
    assert circle(leading(tmp_path / "types" / "pack")) == []
    assert set(circle(leading(tmp_path / "circle" / "pack"))) == {"pack.a", "pack.b"}
    inner = {"pack.x.a": {"pack.y.b"}, "pack.y.b": set(), "pack.y.c": {"pack.x.d"}, "pack.x.d": set()}
    assert set(circle(folders_of(inner, "pack"))) == {"x", "y"}, "of folders, though no two modules do"


def test_names_of_mechanisms_have_one_address() -> None:
    """Outside its folder a name that the package hands on is imported from the package; inside, from its module."""
    package, folder = "proofroll.elements.mechanism", ROOT / "elements" / "mechanism"
    handed_on = set(importlib.import_module(package).__all__)
    wrong = [
        f"{file.relative_to(ROOT)}:{node.lineno}"
        for file in ROOT.rglob("*.py")
        for node in nodes(file)
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(package)
        if handed_on & {alias.name for alias in node.names}
        if (node.module == package) == (folder in file.parents)
    ]
    assert wrong == []
