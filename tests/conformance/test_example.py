"""The example that an engine's author starts from keeps every promise that is made of it."""

from __future__ import annotations

import importlib.util
import os
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from types import ModuleType

import pytest

from proofroll.conformance import Check, checks
from proofroll.running.case import Status
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll.studies.cases import single_case

EXAMPLE = Path(__file__).resolve().parents[2] / "docs" / "examples" / "semi_implicit.py"


def example(path: Path = EXAMPLE) -> ModuleType:
    """An example's module, imported from its path, as its entry point will find it."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module
    spec.loader.exec_module(module)
    return module


SEMI_IMPLICIT = example().SemiImplicit
TREE = EXAMPLE.with_name("tree_euler.py")
TREE_EULER = example(TREE).TreeEuler


@pytest.fixture(autouse=True)
def example_is_installed(install_engines: Callable[[Mapping[str, str]], None], monkeypatch: pytest.MonkeyPatch) -> None:
    """The example as an installed package, to this process and to its workers."""
    install_engines({"semi_implicit": "semi_implicit:SemiImplicit", "tree_euler": "tree_euler:TreeEuler"})
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(EXAMPLE.parent), os.environ["PYTHONPATH"]]))


@pytest.mark.parametrize(("path", "most"), [(EXAMPLE, 60), (TREE, 80)])
def test_an_example_is_short(path: Path, most: int) -> None:
    """README says how many lines an engine takes."""
    assert len(path.read_text(encoding="utf-8").splitlines()) <= most


def test_the_example_is_checked_on_both_scenes() -> None:
    """The checks build the example with and without resistance, and none of them is excused."""
    names = [check.name for check in checks(SEMI_IMPLICIT)]
    for scene in ("cylinder", "cylinder-resisting"):
        assert f"certificate_holds[newton_euler-default-{scene}]" in names


@pytest.mark.one_in(4)
@pytest.mark.parametrize("check", [*checks(SEMI_IMPLICIT), *checks(TREE_EULER)])
def test_the_example_conforms(check: Check) -> None:
    """The example keeps a promise of the protocol."""
    check()


@pytest.mark.drill
def test_the_example_runs(tmp_path: Path) -> None:
    """Either runs in the example from a worker process, past the certificate and to the end."""
    cases = [
        single_case(
            "sphere_in_cylinder", {"rolling_resistance": f}, "semi_implicit", until=0.1, every=0.05, time_limit=60.0
        )
        for f in (0.0, 5e-4)
    ]
    results = Runner(Store(tmp_path), jobs=1).run(cases)
    for case in cases:
        assert (results[case.key].status, results[case.key].message) == (Status.DONE, "reached 0.1 s")
        assert results[case.key].certificate
