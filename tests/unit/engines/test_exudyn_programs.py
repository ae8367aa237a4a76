"""Options of a person's own Exudyn program."""

from __future__ import annotations

from pathlib import Path

import pytest

from proofroll.core.errors import InputError
from proofroll.engines.exudyn.own_program import own_options

PROGRAM = """
import exudyn as exu
h, tEnd = 1e-3, 2
step = 2e-3
end = 4 * step * 500
settings = exu.SimulationSettings()
settings.timeIntegration.numberOfSteps = 10
settings.timeIntegration.numberOfSteps = int(end / step)
settings.timeIntegration.endTime = end
{}
mbs.SolveDynamic(settings{})
"""


def read(tmp_path: Path, lines: str = "", solver: str = "") -> tuple[str, dict[str, str]]:
    """Words and settings of a program with further lines and a solver type."""
    path = tmp_path / "program.py"
    path.write_text(PROGRAM.format(lines, solver))
    options = own_options(path)
    return options.words, dict(options.settings)


def test_the_last_values_count(tmp_path: Path) -> None:
    """A step is the end over the last number of steps, from numbers, names and arithmetic; the rest is Exudyn's own."""
    words, settings = read(tmp_path)
    assert words == "GeneralizedAlpha, dt 2e-3 s, spectral radius 0.9"
    assert settings == {
        "integrator": "generalized_alpha", "dt": "0.002", "newton_tolerance": "1e-08", "spectral_radius": "0.9",
    }  # fmt: skip


def test_options_are_read_by_their_last_names(tmp_path: Path) -> None:
    """Damping, Newton's tolerance and rule are read, whatever name the settings have; a solver type goes before."""
    lines = "alpha = settings.timeIntegration.generalizedAlpha\nalpha.spectralRadius = 0.6\nalpha.useNewmark = True"
    lines += "\nsettings.timeIntegration.newton.relativeTolerance = 1e-6"
    assert read(tmp_path, lines)[1] == {
        "integrator": "trapezoidal_index2", "dt": "0.002", "newton_tolerance": "1e-06",
    }  # fmt: skip
    explicit = read(tmp_path, lines, ", solverType=exu.DynamicSolverType.RK44")[1]
    assert explicit == {"integrator": "rk44", "dt": "0.002", "formulation": "tree"}


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("print(", "no Python program: SyntaxError"),
        ("x = 3", "no numbers"),
        ("a.endTime = float('nan' * 2)", "no numbers"),
        (f"a.endTime = {'-' * 5000}1", "no Python program"),
        (
            "a.endTime = 1\nm.SolveDynamic(a, solverType=exu.DynamicSolverType.VelocityVerlet)",
            "choose GeneralizedAlpha",
        ),
    ],
)
def test_what_cannot_be_read_is_one_line(tmp_path: Path, text: str, reason: str) -> None:
    """A file without a step, a program that does not parse, and another solver have a reason and a remedy."""
    path = tmp_path / "program.py"
    path.write_text(text)
    with pytest.raises(InputError, match=reason):
        own_options(path)
