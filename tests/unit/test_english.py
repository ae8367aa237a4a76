"""First lines of docstrings are nouns or verbs of the field: what can be counted of plain English."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from source_code import PACKAGES, statements, tree

pytestmark = pytest.mark.usefixtures("parsed_sources")
ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ("src", *PACKAGES, "benchmarks", "papers", "tests/drill", "tests/plugins", "examples/engines")
# A clause or a phrase that hangs on a word which is not there.
_OPENERS = (
    r"all (?:that|who)|as|at(?! least)|because|by|every(?:thing|body) (?:that|who)|everything|for|from|how|if|in|is|it|"
    r"of|on|since|so|such|that|they|those|to|under|what|when|where|whether|which|who|whose|whom|why|with"
)
_OPENS = re.compile(rf"(?:{_OPENERS})\b", re.IGNORECASE)
# A name of code that stands for its noun, as a class renamed everywhere leaves it; names of products are none.
_CODE = re.compile(r"(?!MuJoCo|PyBullet|Mj|NumPy)[A-Z][a-z]+(?:[A-Z][a-z]+)+\b")
# Words without a noun behind them; a reader has to guess who does what.
_VAGUE = re.compile(r"\b(?:such as|nobody|another than|otherwise than|told|said of|said by|of which)\b")
# An entry of Args, Attributes or Raises that opens with a clause or a pronoun: "it fails" after the name of an error.
_ENTRY = re.compile(
    r"^ +\*{0,2}[A-Za-z_][\w.]*(?:, \*{0,2}[A-Za-z_][\w.]*)*: "
    r"(?:whether|what|where|which|who|those|that|it|they|such|when|how|if)\b.*",
    re.MULTILINE,
)


def _docstrings(module: ast.Module) -> Iterator[tuple[int, str]]:
    """Line and text of every docstring of a module."""
    for node in statements(module):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            text = ast.get_docstring(node)
            if text:
                yield node.body[0].lineno, text


def hard_to_read(module: ast.Module) -> Iterator[str]:
    """Line and reason of every docstring that opens with a clause or has a vague word."""
    for line, text in _docstrings(module):
        first = text.splitlines()[0]
        if _OPENS.match(first) or _CODE.match(first):
            yield f"{line}: opens with a clause: {first}"
        for entry in _ENTRY.findall(text):
            yield f"{line}: an entry opens with a clause: {entry.strip()}"
        for vague in _VAGUE.finditer(text):
            yield f"{line}: says {vague[0]!r}: {first}"


@pytest.mark.parametrize("folder", FOLDERS)
def test_docstrings_open_with_a_noun_or_a_verb(folder: str) -> None:
    """No docstring opens with a clause, a phrase without its noun or a name of code, and none hides who acts."""
    found = [
        f"{path.relative_to(ROOT)}:{problem}"
        for path in sorted((ROOT / folder).rglob("*.py"))
        for problem in hard_to_read(tree(path))
    ]
    assert found == []


@pytest.mark.parametrize(
    ("first", "hard"),
    [
        ("What a run gave.", True),
        ("Whether it holds.", True),
        ("Of the quantity.", True),
        ("Everything that follows from the state.", True),
        ("Scenes such as show a frame.", True),
        ("A sum that nobody pays.", True),
        ("LawResiduals of one route.", True),
        ("MuJoCo contacts.", False),
        ("Residuals of a law.", False),
        ("True if it holds.", False),
        ("Asks the worker to read a file.", False),
        ("Formulation of an element.", False),
        ("Items, the first of them 0.", False),
        ("A run.\n\nRaises:\n    Diverged: it ended.\n", True),
        ("A run.\n\nAttributes:\n    low, high: where it ended.\n", True),
        ("A run.\n\nRaises:\n    Diverged: the run ended.\n", False),
    ],
)
def test_a_clause_is_seen(first: str, hard: bool) -> None:
    """A docstring that opens with a clause is found, and one that opens with a noun or a verb is not."""
    assert bool(list(hard_to_read(ast.parse(f'"""{first}"""')))) is hard


_REFERENCE = re.compile(r":(?:class|func|meth|mod|data|attr):`~?(proofroll[\w.]*)`")


def _resolves(name: str) -> bool:
    """True if a name is a module, or an attribute of one, at any depth."""
    parts = name.split(".")
    for count in range(len(parts), 0, -1):
        place = ROOT / "src" / Path(*parts[:count])
        file = place / "__init__.py" if place.is_dir() else place.with_suffix(".py")
        if file.is_file():
            text = file.read_text(encoding="utf-8")
            return all(re.search(rf"\b{part}\b", text) for part in parts[count:])
    return False


def test_cross_references_point_to_what_there_is() -> None:
    """Every whole name of this package in a docstring is that of a module, a class, a function or an attribute."""
    files = sorted((ROOT / "src").rglob("*.py"))
    assert [
        (path.name, name)
        for path in files
        for name in _REFERENCE.findall(path.read_text(encoding="utf-8"))
        if not _resolves(name)
    ] == []
