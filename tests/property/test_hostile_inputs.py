"""Inputs of strangers: whatever a file or a formula holds ends in a value or in one line."""

from __future__ import annotations

import random
import string
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import proofroll
from proofroll.core.errors import ProofrollError
from proofroll.core.expressions import evaluated
from proofroll.elements.mechanism.scene.signal import Formula
from proofroll.elements.mechanism.scene.spring_law import SpringLaw
from proofroll.files.data_folders import data_folder
from proofroll.files.scene_file import load_scene

_WORDS = ["t", "L", "dL", "mass", "pi", "deg", "sin", "max", "exp", "log", "0", "1", "2.5", "1e300", "9", ".5", "0x1f"]
_WORDS += ["1_0", "1j", "'a'", "f'{1}'", "True", "None", "...", "x", "__import__", "lambda", "if", "else", "and", "not"]
_MARKS = [
    "+",
    "-",
    "*",
    "/",
    "^",
    "**",
    "//",
    "%",
    "@",
    "<",
    "==",
    "(",
    ")",
    "[",
    "]",
    "{",
    "}",
    ",",
    ":",
    ":=",
    ".",
    "=",
]
_MARKS += ["~", "&", "|", "<<", "#", "\\", "\n", " ", "\0", "\u00b2", "\u221e", ";", "$", "`", '"']


def _one_line(read: Callable[[], object]) -> None:
    """Reads something, which is a value or is refused in one line."""
    said = ""
    try:
        read()
    except ProofrollError as error:
        said = str(error)
    assert "\n" not in said
    assert len(said) < 1500


def _text(generator: random.Random) -> str:
    """Formula of random words and marks, nested to some depth."""
    parts = [generator.choice(_WORDS if generator.random() < 0.6 else _MARKS) for _ in range(generator.randint(1, 9))]
    text = generator.choice(["", " "]).join(parts)
    return generator.choice(
        [text, "(" * 40 + text + ")" * 40, "-" * 200 + text, f"max({text}, {text})", f"{text}^{text}"]
    )


@pytest.mark.parametrize("seed", range(4))
def test_a_random_formula_is_a_number_or_a_line(seed: int) -> None:
    """Formulas of parameters, of time and of springs, from a hundred random texts."""
    generator = random.Random(seed)
    for _ in range(100):
        text = _text(generator)
        _one_line(lambda text=text: evaluated("mass", text, {}))
        _one_line(lambda text=text: Formula(text))
        _one_line(lambda text=text: SpringLaw(text))


def _damaged(content: bytes, generator: random.Random) -> bytes:
    """Content with a few bytes changed, or cut off, or with a part twice."""
    changed = bytearray(content)
    for _ in range(generator.randint(1, 4)):
        changed[generator.randrange(len(changed))] = generator.choice([0, 1, 10, 40, 99, 255, generator.randrange(256)])
    cut = generator.randrange(len(changed))
    return bytes(generator.choice([changed, changed, changed, changed[:cut], changed + changed[cut:]]))


@pytest.fixture(scope="module")
def trajectories(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """A run of a tenth of a second in each format."""
    folder = tmp_path_factory.mktemp("runs")
    run = proofroll.simulate("pendulum", "truth", until=0.1, every=0.01)
    columns = {"time": run["time"].to_numpy(), "q.pivot": run["q.pivot"].to_numpy()}
    np.savez(folder / "run.npz", **columns)  # type: ignore[arg-type]  # its keywords are arrays
    np.savez_compressed(folder / "packed.npz", **columns)  # type: ignore[arg-type]  # its keywords are arrays
    run.to_netcdf(folder / "run.nc", engine="scipy")
    rows = "\n".join(f"{t},{q}" for t, q in zip(*columns.values(), strict=True))
    (folder / "run.csv").write_text(f"time [s],q.pivot [rad]\n{rows}\n")
    return sorted(folder.iterdir())


@pytest.mark.drill
@pytest.mark.nightly_of("1", "2", "3")
@pytest.mark.parametrize("seed", range(4))
def test_a_damaged_trajectory_is_judged_or_a_line(seed: int, trajectories: list[Path], tmp_path: Path) -> None:
    """Files of four formats with bytes changed, cut off or doubled, twenty times each."""
    generator, scene = random.Random(seed), load_scene("pendulum")
    for file in trajectories:
        content = file.read_bytes()
        for _ in range(20):
            damaged = tmp_path / file.name
            damaged.write_bytes(_damaged(content, generator))
            _one_line(lambda damaged=damaged: proofroll.judge(damaged, scene))


@pytest.mark.drill
@pytest.mark.nightly_of("1", "2", "3")
@pytest.mark.parametrize("seed", range(4))
def test_a_damaged_scene_is_a_scene_or_a_line(seed: int, tmp_path: Path) -> None:
    """Files of shipped scenes with a few characters or values changed, thirty of them."""
    generator = random.Random(seed)
    files = sorted(data_folder("models").glob("*/scene.toml"))
    values = ["-1", "0", "1e308", "nan", "inf", '"= 1/0"', '"a"', "[]", "{}", "true", "1979-05-27", '"$none"', "[[1]]"]
    for _ in range(30):
        text = generator.choice(files).read_text()
        lines = text.splitlines()
        where = generator.randrange(len(lines))
        key, equals, _ = lines[where].partition("=")
        lines[where] = (
            f"{key}= {generator.choice(values)}" if equals else lines[where] + generator.choice(string.printable)
        )
        (tmp_path / "scene.toml").write_text("\n".join(lines))
        _one_line(lambda: load_scene(str(tmp_path)))
