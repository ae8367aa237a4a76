"""Modules that each step of a session loads, counted in one new interpreter that takes the lightest step first."""

from __future__ import annotations

import json
import subprocess
import sys
from importlib.metadata import entry_points
from importlib.util import find_spec

import pytest
from robot_templates import urdf

ENGINES = ["projection", "reduced", *(name for name in ("exudyn", "mujoco") if find_spec(name))]
READERS = [name for name in ("exudyn", "mujoco", "pinocchio") if find_spec(name)]
# A command as a user gives it, with the exit code that it ends with.
_COMMAND = """
sys.argv = "proofroll {words}".split()
try:
    main()
except SystemExit as end:
    assert (end.code or 0) == {code}, end.code
"""


def _command(words: str, code: int = 0) -> str:
    return "from proofroll.cli import main\n" + _COMMAND.format(words=words, code=code)


_WORKER = """
import dataclasses
from proofroll.files.scene_file import load_scene
from proofroll.running.case import EngineFacts
from proofroll.running.identity import resolve
from proofroll.running.run_case import run
from proofroll.studies.cases import case_of

facts = EngineFacts(**resolve("reduced", {}))
case = case_of("sphere_in_cylinder", load_scene("sphere_in_cylinder"), {}, facts, 0.1, 0.01)
assert run(dataclasses.asdict(case), "run.npz")["status"] == "done"
"""
_DATASET = """
from pathlib import Path
from proofroll.files.trajectory_file import import_xarray, read, write

import_xarray()
import xarray

for name in ("run.npz", "run.nc"):
    write(xarray.Dataset({"z": ("time", [1.0])}), Path(name))
    assert float(read(Path(name)).z[0]) == 1.0
"""
_ARRAYS = {"numpy", "scipy", "xarray", "matplotlib", "pydantic", "mujoco", "pinocchio", "exudyn", "heyoka"}
_WRONG_NAME = {"xarray", "pandas", "rich.console", "proofroll.report.run.run"}
# Step -> program, and modules that neither it nor a step before it has loaded.
STEPS: dict[str, tuple[str, set[str]]] = {
    "import": ("import proofroll", _ARRAYS),
    "help": (
        "\n".join(_command(words) for words in ("--help", "--version", "run --help", "compare --help")),
        _ARRAYS - {"pydantic"},
    ),
    "list engines": (_command("engines"), {*_ARRAYS - {"numpy", "pydantic"}, "rich.table"}),
    "no such file": (_command("judge nofile.nc", 2), {*_WRONG_NAME, "proofroll.files.scene_file"}),
    "neither scene nor file": (_command("judge nosuch nofile.csv", 2), {*_WRONG_NAME, "proofroll.files.scene_file"}),
    "no such scene": (_command("run nosuch --engine mujoco --set length=1", 2), {*_WRONG_NAME, "scipy"}),
    "no such parameter": (_command("run pendulum --engine mujoco --set lenth=1", 2), _WRONG_NAME),
    "check": (_command("check pendulum"), {"scipy", "xarray", "pandas", "matplotlib", "sympy"}),
    "check a robot": (
        f"open('arm.urdf', 'w').write({urdf()!r})\n{_command('check arm.urdf --engine mujoco')}",
        {"scipy", "xarray", "pandas", "matplotlib", "proofroll.report.terminal.verdicts"},
    ),
    "readers of robots": (
        "\n".join(f"import proofroll.robots.importers.{name}" for name in READERS),
        {"scipy", *(f"proofroll.engines.{name}.adapter" for name in READERS)},
    ),
    "describe engines": (
        f"from proofroll.running.identity import describe\nfor name in {ENGINES}:\n    describe(name)",
        {"xarray", "pandas", "scipy.integrate", "scipy.spatial", "scipy.optimize"},
    ),
    "scene of a robot": (
        "from proofroll.files.scene_file import load_scene; load_scene('arm.urdf')",
        {"scipy.integrate", "scipy.spatial", "proofroll.robots.control.bookkeeping.air"},
    ),
    "truths of other scenes": (
        "import proofroll.papers.blajer_2006.truth.plug_in, proofroll.truth.plug_in",
        {"scipy.integrate", "scipy.spatial", "scipy.optimize"},
    ),
    "a function that no module of its name takes over": (
        "import proofroll; first = proofroll.simulate; from proofroll import simulate\n"
        "assert callable(first) and callable(simulate) and callable(proofroll.simulate)",
        {"xarray", "pandas", "scipy.io"},
    ),
    "worker": (_WORKER, {"xarray", "pandas", "scipy.io"}),
    "run": (_command("run sphere_in_cylinder --engine reduced --until 0.1"), {"xarray", "pandas", "scipy.io"}),
    # Neither imported nor hidden from a program that wants it.
    "dataset": (_DATASET, {"dask", "distributed"}),
}


@pytest.fixture(scope="module")
def loaded(tmp_path_factory: pytest.TempPathFactory) -> dict[str, set[str]]:
    """Step -> modules that are loaded after it."""
    told = "print('\\n@' + json.dumps([{step!r}, sorted(sys.modules)]))"
    program = "\n".join(
        ["import json, sys", *(f"{code}\n{told.format(step=step)}" for step, (code, _) in STEPS.items())]
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=tmp_path_factory.mktemp("light"), capture_output=True, text=True, timeout=600, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    lines = [json.loads(line[1:]) for line in done.stdout.splitlines() if line.startswith("@")]
    return {step: set(names) for step, names in lines}


@pytest.mark.drill_of("import")
@pytest.mark.parametrize("step", STEPS)
def test_a_step_loads_no_more_than_it_takes(step: str, loaded: dict[str, set[str]]) -> None:
    """A step loads no library that it can do without; those of arrays and datasets would take most of its time."""
    assert STEPS[step][1] & loaded[step] == set()


def test_no_engine_is_loaded_for_help(loaded: dict[str, set[str]]) -> None:
    """Help and the version load no adapter, and a description of engines loads those that it describes."""
    announced = {point.name: point.module for point in entry_points(group="proofroll.engines")}
    assert {name for name in loaded["help"] if name.startswith("proofroll.engines.")} == set()
    assert loaded["help"] & set(announced.values()) == set()
    assert {announced[name] for name in ENGINES} <= loaded["describe engines"]
