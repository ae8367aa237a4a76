"""``proofroll diff``: what changed between two runs of a scene."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

Proofroll = Callable[..., tuple[int, str, str]]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder for the runs of this module."""
    return tmp_path_factory.mktemp("runs")


@pytest.fixture
def run(proofroll: Proofroll, folder: Path) -> Callable[..., Path]:
    """Writes a run of the scene to a file, once."""

    def written(name: str, *arguments: str, scene: str = "pendulum") -> Path:
        file = folder / name
        if not file.exists():
            assert proofroll("run", scene, "--until", "0.4", "--out", str(file), *arguments)[0] == 0
        return file

    return written


@pytest.mark.drill
def test_equal_runs_have_the_same_bits(proofroll: Proofroll, run: Callable[..., Path]) -> None:
    """A run and the same run in another format and file differ in nothing; exit 0."""
    one, same = (run(f"run.{ending}", "--engine", "mujoco") for ending in ("nc", "npz"))
    code, out, _ = proofroll("diff", str(one), str(same))
    assert (code, out) == (0, "Both runs of pendulum have the same bits at 41 instants.\n")


@pytest.mark.drill
def test_another_step_is_named_with_its_numbers(proofroll: Proofroll, run: Callable[..., Path], tmp_path: Path) -> None:
    """Runs of two steps differ at the instants that both have; the setting and each quantity are told, exit 1."""
    coarse = run("coarse.nc", "--engine", "mujoco[dt=2e-2]", "--every", "0.02")
    fine = run("fine.nc", "--engine", "mujoco[dt=1e-2]", "--every", "0.01")
    comment = tmp_path / "changes.md"
    code, out, _ = proofroll("diff", str(coarse), str(fine), "--json", "--comment", str(comment))
    told = json.loads(out)
    assert (code, told["instants"]) == (1, 21)
    assert told["about"] == {"settings.dt": [0.02, 0.01]}
    sizes = [item["relative"] for item in told["numbers"]]
    assert sizes == sorted(sizes, reverse=True)
    assert {"q.pivot", "positions"} <= {item["quantity"] for item in told["numbers"]}
    assert "- settings.dt: 0.02 → 0.01\n" in comment.read_text(encoding="utf-8")


@pytest.mark.nightly
def test_events_of_two_engines_are_compared(proofroll: Proofroll, run: Callable[..., Path]) -> None:
    """Of runs of a scene with contact the number and the times of events are told."""
    truth = run("truth.nc", "--engine", "truth", scene="bouncing_ball")
    projection = run("projection.nc", "--engine", "projection", scene="bouncing_ball")
    told = json.loads(proofroll("diff", str(truth), str(projection), "--json")[1])
    assert told["events"][0] == told["events"][1] or told["event_time"] is None
    assert told["about"]["engine"] == ["truth", "projection"]
    assert not any(name.startswith("settings") for name in told["about"]), "settings of two engines have no meaning"


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("run.nc", "{report}", "is of another kind than {run}; name two reports or two runs"),
        ("run.nc", "{ball}", "is a run of bouncing_ball, and {run} one of pendulum; name two runs of one scene"),
        ("run.nc", "absent.nc", "new = 'absent.nc': there is no such file; give two reports, two runs, or"),
        ("run.csv", "run.nc", "run = 'run.csv': names no scene; write it as .nc or .npz, or judge it"),
        ("absent", "run", "old = 'absent': there is no such file"),
        ("mujoco@1", "exudyn@1", "new = 'exudyn@1': is no version of mujoco; name two of one engine"),
    ],
)
def test_what_cannot_be_compared_is_said(
    proofroll: Proofroll, run: Callable[..., Path], tmp_path: Path, old: str, new: str, says: str
) -> None:
    """Two things of different kinds, scenes or engines, and files that are not there, are one line; exit 2."""
    names = {
        "run": str(run("run.nc", "--engine", "mujoco")),
        "ball": str(run("truth.nc", "--engine", "truth", scene="bouncing_ball")),
        "report": str(tmp_path / "report.json"),
    }
    Path(names["report"]).write_text("{}")
    code, _, err = proofroll("diff", names["run"] if old == "run.nc" else old, new.format(**names))
    assert code == 2
    assert says.format(**names) in err
    assert err.count("\n") == 1
