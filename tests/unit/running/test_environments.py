"""Environments of other versions: made whole or not at all, remembered, removed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import hostile
import pytest
from other_pythons import PLUGINS, script, seen_line

from proofroll.core.errors import InputError, ProofrollError
from proofroll.running import environments, make_environment
from proofroll.running.interpreters import python_at
from proofroll_drill.processes import alive, wait_until


@pytest.fixture
def wheels(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder from which pip installs the engine ``aged``, without a network and without what it depends on."""
    folder = tmp_path / "wheels"
    folder.mkdir()
    for version in ("1.0", "2.0"):
        info = f"aged-{version}.dist-info"
        files = {
            f"{info}/METADATA": f"Metadata-Version: 2.1\nName: aged\nVersion: {version}\n",
            f"{info}/WHEEL": "Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
            f"{info}/entry_points.txt": "[proofroll.engines]\naged = aged:Aged\n",
            f"{info}/RECORD": "",
            "aged_sees.pth": f"{PLUGINS}\n{seen_line()}\n",
        }
        with zipfile.ZipFile(folder / f"aged-{version}-py3-none-any.whl", "w") as archive:
            for name, text in files.items():
                archive.writestr(name, text)
    for name, value in {"NO_INDEX": "1", "NO_DEPS": "1", "FIND_LINKS": str(folder), "CONFIG_FILE": os.devnull}.items():
        monkeypatch.setenv(f"PIP_{name}", value)
    monkeypatch.setenv(environments.VARIABLE, str(tmp_path / "engines"))
    return folder


@pytest.mark.nightly
@pytest.mark.own_workers
def test_an_environment_is_made_remembered_and_removed(wheels: Path, proofroll: Callable[..., Any]) -> None:
    """By pip, with this proofroll; its label runs the version that was asked for, and nothing is left of it at last."""
    code, out, err = proofroll("engines", "add", "aged", "--requirement", "aged==1.0")
    assert code == 0, err
    assert out.startswith("aged@1.0: aged 1.0, Python ")
    (made,) = environments.remembered()
    assert python_at("aged@1.0") == made.python
    assert {"aged==1.0", "proofroll==0.1.0"} <= set(made.packages)
    code, out, err = proofroll("run", "sphere_in_cylinder", "--engine", "aged@1.0", "--until", "0.01")
    assert code == 0, err
    assert "aged@1.0 midpoint" in out, out
    code, _, err = proofroll("engines", "add", "aged", "--requirement", "aged==1.0")
    assert (code, "it is there already" in err) == (2, True)
    made.python.unlink()
    code, _, err = proofroll("run", "sphere_in_cylinder", "--engine", "aged@1.0")
    assert (code, "its environment is gone" in err) == (3, True)
    assert proofroll("engines", "remove", "aged@1.0")[0] == 0
    assert not made.folder.exists()
    code, _, err = proofroll("engines", "remove", "aged@1.0")
    assert (code, "there is none" in err) == (2, True)
    assert wheels.is_dir()


@pytest.mark.drill
def test_a_version_that_is_too_old_is_not_installed(
    wheels: Path, install_engines: Callable[[dict[str, str]], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """From which version on an adapter supports its engine is said before anything is made, where it is installed."""
    install_engines(hostile.ENTRY_POINTS)
    monkeypatch.setattr(make_environment, "_made", lambda *_: pytest.fail("made"))
    for label in ("", "mine"):
        with pytest.raises(InputError, match=r"grown==2'?: the adapter of grown supports 2\.5 and later"):
            make_environment.add("grown", ["numpy==1.26.4", "grown==2"], label)
    assert not list(wheels.parent.glob("engines/*"))
    with pytest.raises(pytest.fail.Exception, match="made"):
        make_environment.add("grown", ["numpy==1.26.4", "grown==2.5"])


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize(
    ("requirements", "options", "says"),
    [
        (["aged>=1.0"], {}, "say by which label"),
        (["aged==1.0"], {"label": "../up"}, "use letters, digits"),
        (["--upgrade"], {"label": "x"}, "not an option of pip"),
        (["aged==1.0"], {"python": "/bin/false"}, "no environment can be made from it"),
    ],
)
def test_what_makes_no_environment_says_why(
    wheels: Path, requirements: list[str], options: dict[str, str], says: str
) -> None:
    """Bad input is told in one line, and nothing is left."""
    with pytest.raises(InputError, match=says):
        make_environment.add("aged", requirements, **options)
    assert not list(wheels.parent.glob("engines/[!.]*"))


@pytest.mark.parametrize(
    ("name", "requirement", "known"),
    [
        ("mujco", "mujoco==3.8.1", False),
        ("mujco", "mujco==3.8.1", False),
        ("dart", " exudyn ==1.10", False),
        ("mujoco", "mujoco==3.8.1", True),
        ("dart", "dart-engine==1.0", True),
        ("pinocchio", "pin==3.7", True),
    ],
)
def test_a_mistyped_engine_is_not_installed(
    name: str, requirement: str, known: bool, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """One line names the engines before anything is made; an engine that a requirement may announce is let through."""
    monkeypatch.setenv(environments.VARIABLE, str(tmp_path))
    monkeypatch.setattr(make_environment, "_require_supported", lambda *_: None)
    monkeypatch.setattr(make_environment, "_made", lambda *_: pytest.fail("made"))
    expected = pytest.raises(pytest.fail.Exception, match="made")
    told = pytest.raises(InputError, match=f"engine = '{name}': there is no such engine; choose one of exudyn, mujoco")
    with expected if known else told:
        make_environment.add(name, [requirement])


@pytest.mark.nightly
def test_an_interrupted_environment_leaves_nothing(wheels: Path, tmp_path: Path) -> None:
    """Ctrl-C ends what was started, exits 130, and no half is taken for a whole."""
    pidfile = tmp_path / "pid"
    slow = script(tmp_path / "slow", f"echo $$ > {pidfile}\nsleep 1000")
    command = [sys.executable, "-m", "proofroll", "engines", "add", "aged", "--requirement", "aged==2.0"]
    process = subprocess.Popen([*command, "--python", str(slow)], stderr=subprocess.PIPE, text=True)
    while not pidfile.is_file() or not pidfile.read_text().strip():
        assert process.poll() is None
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    assert process.wait(60) == 130
    folder = environments.folder_of("aged", "2.0")
    assert not folder.exists()
    assert environments.remembered() == []
    assert wait_until(lambda: not alive(int(pidfile.read_text())))
    with environments.making(folder), pytest.raises(ProofrollError, match="by another process"):
        make_environment.add("aged", ["aged==2.0"])
    assert wheels.is_dir()


def test_where_environments_are_kept(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Below the variable, else below XDG_DATA_HOME if it is absolute, else below the home folder."""
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv(environments.VARIABLE, raising=False)
    monkeypatch.setenv("XDG_DATA_HOME", "relative")
    assert environments.root() == tmp_path / ".local" / "share" / "proofroll" / "engines"
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    assert environments.root() == tmp_path / "data" / "proofroll" / "engines"
    monkeypatch.setenv(environments.VARIABLE, str(tmp_path / "own"))
    assert environments.root() == tmp_path / "own"
    assert environments.remembered() == []
