"""Robot files written for the tests, and readers announced as an installed package would announce them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import pytest
from robot_templates import urdf

from proofroll.running.process import Worker

PLUGINS = Path(__file__).parents[1] / "plugins"


@pytest.fixture(autouse=True)
def unhurried(monkeypatch: pytest.MonkeyPatch) -> None:
    """Searches for mistakes in records end by what they find, not by the speed of this processor."""
    monkeypatch.setattr("proofroll.robots.control.judge.SEARCH_TIME", 1e4)


@pytest.fixture
def install_readers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[Mapping[str, str]], None]:
    """Announces readers of robot files to this process and to its workers."""

    def install(readers: Mapping[str, str]) -> None:
        site = tmp_path / "readers"
        info = site / "throwaway_readers-1.0.dist-info"
        info.mkdir(parents=True)
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: throwaway-readers\nVersion: 1.0\n")
        lines = [f"{name} = robot_readers:{target}" for name, target in readers.items()]
        (info / "entry_points.txt").write_text("\n".join(["[proofroll.robot_readers]", *lines, ""]))
        places = [str(site), str(PLUGINS), *filter(None, [os.environ.get("PYTHONPATH")])]
        monkeypatch.setenv("PYTHONPATH", os.pathsep.join(places))
        monkeypatch.syspath_prepend(str(site))

    return install


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    """A URDF without anything that engines differ in."""
    path = tmp_path / "arm.urdf"
    path.write_text(urdf())
    return path


@pytest.fixture(scope="session")
def robot_workers() -> Iterator[Callable[[str], Worker]]:
    """A worker process for each engine, kept for all tests."""
    workers: dict[str, Worker] = {}

    def worker(engine: str) -> Worker:
        if engine not in workers:
            workers[engine] = Worker()
        return workers[engine]

    yield worker
    for item in workers.values():
        item.close()
