"""Needs of a release: one version everywhere, a workflow that parses, a checklist that points at files."""

from __future__ import annotations

import re
import subprocess
import tomllib
from pathlib import Path

import pytest
import yaml
from source_code import PACKAGES

import proofroll
from proofroll.files.comparison_file import comparison_names

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def test_the_first_line_of_the_readme_tells_the_truth() -> None:
    """Version, maturity, Pythons, systems, licence and types are those of the package, and of what is tried."""
    (said,) = re.findall(r"^\*Version (.*)\*$", (ROOT / "README.md").read_text(encoding="utf-8"), flags=re.MULTILINE)
    version, maturity, pythons, systems, licence, typed = said.split(" · ")
    classifiers = PROJECT["classifiers"]
    assert version == PROJECT["version"] == proofroll.__version__
    assert any(item.startswith("Development Status") and item.endswith(f"- {maturity}") for item in classifiers)
    known = [item.rpartition(" ")[2] for item in classifiers if re.fullmatch(r"Programming .* 3\.\d+", item)]
    assert pythons == f"Python {', '.join(known)}"
    named = [item.rpartition(" ")[2] for item in classifiers if item.startswith("Operating System")]
    workflow = yaml.safe_load((ROOT / ".github" / "workflows" / "platforms.yml").read_text(encoding="utf-8"))
    tried = workflow["jobs"]["two-commands"]["strategy"]["matrix"]["os"]
    systems_tried = {{"ubuntu": "Linux", "macos": "macOS"}[name.partition("-")[0]] for name in tried}
    assert set(systems.split(", ")) == systems_tried
    assert {name.lower() for name in systems_tried} == {name.lower() for name in named}
    assert licence == PROJECT["license"]
    assert typed == "typed"
    assert (ROOT / "src" / "proofroll" / "py.typed").is_file()


def test_the_workflow_of_platforms_asks_for_what_there_is() -> None:
    """Its YAML and scripts parse; extras, comparisons, folders of tests and Pythons that it names exist."""
    text = (ROOT / ".github" / "workflows" / "platforms.yml").read_text(encoding="utf-8")
    jobs = yaml.safe_load(text)["jobs"]
    scripts = [step["run"] for job in jobs.values() for step in job["steps"] if "run" in step]
    for script in scripts:
        subprocess.run(["bash", "-n", "-c", script], check=True)
    matrix = jobs["two-commands"]["strategy"]["matrix"]
    assert {item["os"] for item in matrix["include"]} == set(matrix["os"])
    assert {name for item in matrix["include"] for name in item["extras"].split(",")} <= {
        *PROJECT["optional-dependencies"]
    }
    assert all(f"Programming Language :: Python :: {python}" in PROJECT["classifiers"] for python in matrix["python"])
    (names,) = [re.findall(r"proofroll report ([a-z_ ]+) --out", script) for script in scripts if "report" in script][
        -1:
    ]
    assert set(names[0].split()) <= set(comparison_names())
    (tested,) = [script.partition("pytest ")[2].split() for script in scripts if "-m pytest" in script]
    assert all((ROOT / folder).is_dir() for folder in tested)
    assert "://" not in text


# What a package brings besides, each with its row on the page about licences.
BROUGHT = {"distributed>=2025.1": "`proofroll-cluster`"}


@pytest.mark.one_in(3)
@pytest.mark.parametrize("folder", PACKAGES)
def test_a_package_with_a_command_fits_the_suite(folder: str) -> None:
    """It has the version and the Pythons of the suite, and asks for that version: it uses more than public names."""
    package = tomllib.loads((ROOT / folder / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert (package["version"], package["requires-python"]) == (PROJECT["version"], PROJECT["requires-python"])
    assert f"proofroll=={PROJECT['version']}" in package["dependencies"]
    assert {*package["dependencies"]} - {f"proofroll=={PROJECT['version']}"} <= {*PROJECT["dependencies"], *BROUGHT}


@pytest.mark.parametrize("name", ["release", "every_night"])
def test_files_that_a_page_names_are_there(name: str) -> None:
    """Each file that the checklist and the page about nights point at exists."""
    text = (ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")
    for found in re.findall(r"`(\.github/[\w./]+|src/[\w./]+|pyproject\.toml|CITATION\.cff)`", text):
        assert (ROOT / found).is_file(), found


def test_the_page_about_licences_has_every_package_that_is_installed() -> None:
    """Each package that a wheel or an extra for users asks for has a row, beside what it comes with."""
    extras = PROJECT["optional-dependencies"]
    asked = {package: [item] for item, package in BROUGHT.items()} | {"proofroll": PROJECT["dependencies"]}
    asked |= {f"`[{name}]`": packages for name, packages in extras.items() if name not in {"all", "dev"}}
    text = (ROOT / "docs" / "licences.md").read_text(encoding="utf-8")
    rows = [tuple(cell.strip() for cell in row.strip("|").split("|")) for row in re.findall(r"^\|.*\|$", text, re.M)]
    known = {(package.split(" (")[0], row[1]) for row in rows[2:] for package in row[0].split(", ")}
    assert known == {(re.split(r"[<>=;]", item)[0], extra) for extra, items in asked.items() for item in items}
