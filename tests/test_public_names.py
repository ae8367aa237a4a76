"""What authors of engines may build on: the table in docs/write_an_engine.md, and packages that keep to it."""

from __future__ import annotations

import ast
import importlib
import re
from pathlib import Path

import pytest

from proofroll import adapter
from proofroll.core import engine_abilities
from proofroll.elements.mechanism.run.capabilities import MechanismCapability

ROOT = Path(__file__).resolve().parents[1]
PAGE = (ROOT / "docs" / "write_an_engine.md").read_text(encoding="utf-8")
PACKAGES = sorted((ROOT / "examples" / "engines").iterdir())


def table(title: str) -> dict[str, set[str]]:
    """First column of a section's table -> names in code in its second."""
    section = PAGE.partition(f"\n## {title}\n")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| `([\w.]+)` \| (.*) \|$", section, flags=re.MULTILINE)
    found: dict[str, set[str]] = {}
    for name, names in rows:  # a module may have several rows
        found.setdefault(name, set()).update(re.findall(r"`(\w+)`", names))
    return found


PROTOCOLS = set(table("What an engine may say besides"))
NAMES = table("Names to build on")
# Modules from which an engine as a package may import; robots' readers have a face of their own.
FACES = ("proofroll", "proofroll.adapter", "proofroll.testing", "proofroll.conformance")
FACES += ("proofroll.robots.protocol", "proofroll.robots.model", "proofroll.engines.mujoco")


def test_every_optional_protocol_is_named() -> None:
    """The page names each small protocol that an engine can follow besides, and no other."""
    optional = {name for name, kind in vars(engine_abilities).items() if getattr(kind, "_is_runtime_protocol", False)}
    assert optional == PROTOCOLS


def test_every_capability_is_named() -> None:
    """Authors find each name that ``provides`` may have, in its order and with what it means."""
    section = PAGE.partition("\n### Capabilities\n")[2].partition("\n## ")[0]
    found = re.findall(r"^\|[^|]*\| `(\w+)` \| (.*) \|$", section, flags=re.MULTILINE)
    assert found == [(item.name, item.value) for item in MechanismCapability]


@pytest.mark.parametrize("module", NAMES)
def test_public_names_are_there(module: str) -> None:
    """Each name of the table is in its module."""
    found = importlib.import_module(module)
    assert [name for name in NAMES[module] if not hasattr(found, name)] == []


@pytest.mark.parametrize("module", NAMES)
def test_type_checkers_see_public_names(module: str) -> None:
    """Each is defined in its module, or handed on by name: strict checkers take no other from a typed package."""
    found = importlib.import_module(module)
    defined = set(getattr(found, "__all__", ()))
    for node in ast.parse(Path(str(found.__file__)).read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            defined.add(node.name)
        elif isinstance(node, ast.Assign):
            defined |= {target.id for target in node.targets if isinstance(target, ast.Name)}
        elif isinstance(node, ast.AnnAssign):
            defined.add(ast.unparse(node.target))
        elif isinstance(node, ast.ImportFrom):
            defined |= {alias.name for alias in node.names if alias.asname == alias.name}
    assert sorted(NAMES[module] - defined) == []


def test_announced_names_stay() -> None:
    """Each name of ``proofroll.adapter`` is in the ledger and on the page; one that left is in the changelog."""
    lines = (ROOT / "docs" / "adapter_names.txt").read_text(encoding="utf-8").splitlines()
    announced = [line.partition(" ")[0] for line in lines if not line.startswith("#")]
    assert announced == sorted(set(announced), key=str.lower)
    offered = {name for name in vars(adapter) if not name.startswith("_")}
    assert NAMES["proofroll.adapter"] == offered
    assert sorted(offered - set(announced)) == []
    entries = [ROOT / "CHANGELOG.md", *(ROOT / "changes").glob("*.md")]
    told = "\n".join(file.read_text(encoding="utf-8") for file in entries)
    assert [name for name in announced if name not in offered and f"`{name}`" not in told] == []


def imported(text: str) -> set[tuple[str, str]]:
    """Modules of proofroll that a program imports, each with the name that it takes from there."""
    found = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] == "proofroll":
            found |= {(str(node.module), alias.name) for alias in node.names}
        elif isinstance(node, ast.Import):
            found |= {(alias.name, "") for alias in node.names if alias.name.startswith("proofroll.")}
    return found


@pytest.mark.parametrize("package", PACKAGES, ids=lambda package: package.name)
def test_packages_of_engines_use_public_names_alone(package: Path) -> None:
    """An engine under examples/ stands on the documented names, as anybody's would."""
    files = [file for file in package.rglob("*.py") if "build" not in file.parts]
    assert files
    public = {(module, name) for module in FACES for name in NAMES[module]}
    private = {f"{file.name}: {use}" for file in files for use in imported(file.read_text(encoding="utf-8")) - public}
    assert private == set()
    assert (package / "README.md").is_file()
    assert list((package / "tests").glob("test_conformance.py"))


def test_examples_of_the_documents_import_from_one_module() -> None:
    """Engines on the page and in docs/examples stand on ``proofroll.adapter``, and on MuJoCo's where they extend it."""
    programs = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    programs += [file.read_text(encoding="utf-8") for file in (ROOT / "docs" / "examples").glob("*.py")]
    assert len(programs) > 5
    uses = {use for program in programs for use in imported(program)} - {("proofroll", "adapter")}
    modules = {module for module, name in uses if name}
    assert modules == {*FACES[1:4], "proofroll.engines.mujoco", "proofroll.engines.mujoco.settings"}
