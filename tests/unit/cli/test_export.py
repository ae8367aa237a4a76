"""``proofroll export``: the model of a scene as a file that the engine's own tools read."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import mujoco
import pytest

Proofroll = Callable[..., tuple[int, str, str]]


def test_a_mechanism_with_other_numbers(proofroll: Proofroll, tmp_path: Path) -> None:
    """The file has the parameters that were set, and the scene's start as its keyframe, from which MuJoCo goes on."""
    file = tmp_path / "long.xml"
    numbers = ("--set", "length=2", "--set", "mass=3", "--set", "angle=0.5", "--set", "speed=1.5")
    code, out, err = proofroll("export", "pendulum", str(file), "--engine", "mujoco[dt=0.004]", *numbers)
    assert (code, out, err) == (0, f"{file} is written\n", "")
    model = mujoco.MjModel.from_xml_path(str(file))
    assert model.opt.timestep == pytest.approx(0.004)
    assert model.body("rod").mass[0] == pytest.approx(3.0)
    assert model.body("rod").ipos == pytest.approx([0, -1.0, 0])
    assert (model.key("start").qpos[0], model.key("start").qvel[0]) == pytest.approx((0.5, 1.5))


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (("pendulum", "{file}", "--engine", "projection"), 3, "projection: it writes no file"),
        (("pendulum", "{file}", "--engine", "mujoco[formulation=chart]"), 3, "needs revolute joints"),
        (("turntable", "{file}", "--engine", "mujoco[formulation=joints]"), 3, "needs contact between bodies"),
        (("pendulum", "{file}", "--engine", "mujoco", "--set", "lenght=1"), 2, "length"),
        (("no_such_scene", "{file}", "--engine", "mujoco"), 2, "no_such_scene"),
        (("pendulum", "{file}/in/a/file", "--engine", "mujoco"), 2, "long.xml"),
    ],
)
def test_what_cannot_be_written(
    proofroll: Proofroll, tmp_path: Path, words: tuple[str, ...], code: int, said: str
) -> None:
    """An engine that writes none, a scene that it does not represent, a wrong name: one line, and no file."""
    file = tmp_path / "long.xml"
    if "in/a/file" in words[1]:
        file.write_text("")
    answer, out, err = proofroll("export", *(word.format(file=file) for word in words))
    assert (answer, out, err.count("\n")) == (code, "", 1)
    assert said in err
    assert not file.exists() or not file.read_text()
