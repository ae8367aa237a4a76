"""Answers of the engine that defines a format: asked once in a command, and again if a file changes."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

import pytest

from proofroll.robots.files.mjcf.compiler import Definer
from proofroll.running.idle_workers import Workers


class _CountingProcesses:
    """Workers whose processes answer with how often they were asked."""

    def __init__(self) -> None:
        self.asked = 0
        self.names: list[tuple[str, str]] = []

    @contextmanager
    def lend(self, _: str) -> Iterator[_CountingProcesses]:
        yield self

    def rename(self, old: str, new: str) -> None:
        self.names.append((old, new))

    def request(self, request: dict[str, Any], _: float) -> dict[str, Any]:
        self.asked += 1
        return (
            {"message": "no"} if request["arguments"].get("bad") else {"number": self.asked, "by": ["an engine", "1"]}
        )


def test_a_question_is_asked_again_only_if_something_changed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An answer is kept until the content, a question's other part, or a file beside the robot's changes."""
    (tmp_path / "answers").mkdir()
    monkeypatch.setitem(os.environ, "PROOFROLL_ANSWERS", str(tmp_path / "answers"))
    robot, copy = tmp_path / "robot" / "arm.xml", tmp_path / "copy.xml"
    robot.parent.mkdir()
    robot.write_text("<mujoco/>", encoding="utf-8")
    copy.write_text("<mujoco/>", encoding="utf-8")
    processes = _CountingProcesses()

    def number(**others: object) -> int:
        definer = Definer("a format", robot, cast("Workers", processes))
        question = {"function": "module:name", "arguments": {"path": str(copy), **others}}
        return int(definer.request(question, 1.0).get("number", -1))

    assert [number(), number()] == [1, 1]
    assert number(speed=2.0) == 2
    (robot.parent / "mesh.stl").write_bytes(b"solid")
    assert [number(), number()] == [3, 3]
    copy.write_text("<mujoco model='b'/>", encoding="utf-8")
    assert number() == 4
    assert [number(bad=True), number(bad=True)] == [-1, -1]
    assert processes.asked == 6
    assert processes.names[0] == ("a format", "an engine")
