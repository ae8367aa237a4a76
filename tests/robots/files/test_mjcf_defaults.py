"""Defaults and worlds of included files: one element where that means the same."""

from __future__ import annotations

from pathlib import Path

import pytest

from proofroll.robots.files.opening import open_robot

NESTED = '<default class="k"><joint damping="1"/></default>'


@pytest.mark.parametrize(
    ("included", "own", "count"),
    [
        ('<joint armature="1"/>', '<joint damping="2"/>' + NESTED, 1),
        ('<joint armature="1"/>' + NESTED, '<default class="l"/>', 1),
        ('<joint armature="1"/>' + NESTED, '<joint damping="2"/>', 2),
    ],
    ids=["classes below both", "classes beside", "a class that has less"],
)
def test_merged(included: str, own: str, count: int, tmp_path: Path) -> None:
    """Defaults are merged unless a class of the included file would take what stands later."""
    (tmp_path / "common.xml").write_text(f"<mujoco><default>{included}</default></mujoco>")
    path = tmp_path / "robot.xml"
    path.write_text(
        f'<mujoco><include file="common.xml"/><default>{own}</default><worldbody><body><joint/>'
        '<geom size="0.1"/></body></worldbody></mujoco>'
    )
    assert len(open_robot(path).root.findall("default")) == count


@pytest.mark.parametrize(("included", "count"), [("<worldbody>{}</worldbody>", 1), ("", 2)], ids=["a world", "none"])
def test_worlds(included: str, count: int, tmp_path: Path) -> None:
    """Worlds of an included file and of the file are one; two that the file has by itself stay two."""
    body = '<body><joint/><geom size="0.1"/></body>'
    (tmp_path / "robot.xml").write_text(f"<mujoco>{included.format(body)}</mujoco>")
    path = tmp_path / "scene.xml"
    own = '<worldbody><geom type="plane" size="0 0 1"/></worldbody>'
    own += "" if included else f"<worldbody>{body}</worldbody>"
    path.write_text(f'<mujoco><include file="robot.xml"/><default/>{own}</mujoco>')
    root = open_robot(path).root
    assert len(root.findall("worldbody")) == count
    tags = [part.tag for part in root]
    assert tags.index("default") < tags.index("worldbody")  # engines read a class before its use
    assert sum(1 for _ in root.iter("body")) == 1
    assert sum(1 for _ in root.iter("geom")) == 2
