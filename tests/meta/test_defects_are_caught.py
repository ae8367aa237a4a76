"""An engine that is broken on purpose never passes: the certificate stops it, or its verdict contradicts the claim."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from proofroll.core.verdict import Verdict
from proofroll.files.comparison_file import load_comparison
from proofroll.running.case import Status
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll.studies.comparison.compare import compare
from proofroll.studies.comparison.outcome import Outcome, Run

# Defect that shows in what was built -> the quantity that the certificate must name.
OPEN = {
    "open_inertia": "inertia",
    "open_gravity": "gravity",
    "open_radius": "position",
    "open_mass": "mass",
    "open_resistance": "rolling resistance",
    "open_friction": "forces of contact",
}
# Defect that no number tells, but the first steps do -> the quantity that the certificate must name.
FIRST = {"hidden_inertia": "acceleration of the first steps", "hidden_resistance": "acceleration of the first steps"}
# Defect that hides until the ball moves -> observables that must differ, and some that must not.
HIDDEN = {
    "hidden_gravity": ({"z", "F3"}, {"gap", "slip"}),
    "hidden_radius": ({"z", "gap"}, set[str]()),
    "hidden_mass": ({"N", "F3", "energy_balance"}, {"gamma", "z", "gap", "slip"}),
    "hidden_friction": ({"F2", "F3", "force_audit"}, {"gamma", "z", "N", "energy_balance"}),
    "hidden_rate": ({"rate_audit"}, {"gamma", "z", "N", "F2", "F3", "gap"}),
    "hidden_period": ({"rate_audit", "z", "energy_balance"}, {"gamma", "N", "F2", "F3", "force_audit", "gap", "slip"}),
    "hidden_clock": ({"gamma", "z"}, {"gap", "slip"}),
}
SOUND = "hidden_none"

HEAD = """
title = "Defects"
question = "Are they caught?"
scene = "sphere_in_cylinder"
until = 0.3
every = 0.01
vary = { rolling_resistance = [5e-4] }

[tolerances.tight]
because = "ten times what is left of the sound engine at its tolerance, and splines through the samples"
gamma = "1e-9 rad"
z = "1e-9 m"
N = "0.01 %"
F2 = "1e-6 N"
F3 = "1e-6 N"
energy_balance = "1e-7 J"
force_audit = "1e-3 N"
rate_audit = "1e-6 m/s"
gap = "1e-9 m"
slip = "1e-9 m/s"
"""


@pytest.fixture
def outcome(tmp_path: Path, install_engines: Callable[[Mapping[str, str]], None]) -> Outcome:
    """All defects in one comparison, each claimed to agree; finer tolerances would do the same again."""
    install_engines({"broken": "broken:Broken"})
    rows = "".join(
        f'\n[[rows]]\nengine = "broken[formulation={name}]"\ntolerance = "tight"\nladder = [1]\n'
        for name in (*OPEN, *FIRST, *HIDDEN, SOUND)
    )
    (tmp_path / "defects.toml").write_text(HEAD + rows)
    return compare(load_comparison(str(tmp_path / "defects.toml")), Runner(Store(tmp_path / "cases"), jobs=1))


def run_of(outcome: Outcome, defect: str) -> Run:
    """The row of one defect."""
    return next(run for run in outcome.runs if run.row.engine == f"broken[formulation={defect}]")


def check_the_sound_engine(outcome: Outcome) -> None:
    """Without a defect the same engine agrees in every observable, so that what is caught is the defect."""
    run = run_of(outcome, SOUND)
    assert run.verdict is Verdict.AGREES, [j for j in run.judgements if j.verdict is not Verdict.AGREES]
    assert len(run.judgements) == 10
    assert not run.contradictions


def check_an_open_defect(outcome: Outcome, defect: str, quantity: str) -> None:
    """An engine that built something else fails before it is compared, and the row names the quantity."""
    run = run_of(outcome, defect)
    assert run.result.status is Status.WRONG_MODEL, defect
    assert f"differs from the scene: {quantity} is" in run.result.message, defect
    assert run.verdict is Verdict.FAILED, defect
    assert any(quantity in sentence for sentence in run.contradictions), defect


def check_a_hidden_defect(outcome: Outcome, defect: str, differing: set[str], agreeing: set[str]) -> None:
    """An engine that lies about what it built differs from the truth where its defect acts, and nowhere else."""
    run = run_of(outcome, defect)
    assert run.result.status is Status.DONE, defect
    verdicts = {judgement.observable: judgement.verdict for judgement in run.judgements}
    assert {name for name in differing if verdicts[name] is not Verdict.DIFFERS} == set(), defect
    assert {name for name in agreeing if verdicts[name] is not Verdict.AGREES} == set(), defect
    assert run.verdict is Verdict.DIFFERS, defect
    for name in differing:
        assert any(f"{name} differs" in sentence for sentence in run.contradictions), (defect, name)


@pytest.mark.drill
def test_every_defect_is_caught(outcome: Outcome) -> None:
    """The certificate stops what was built wrongly, the verdict what moves wrongly, and nothing stops what is sound."""
    check_the_sound_engine(outcome)
    for defect, quantity in (OPEN | FIRST).items():
        check_an_open_defect(outcome, defect, quantity)
    for defect, (differing, agreeing) in HIDDEN.items():
        check_a_hidden_defect(outcome, defect, differing, agreeing)
    assert not any(SOUND in text for text in outcome.contradictions)


def test_conformance_sees_open_defects(install_engines: Callable[[Mapping[str, str]], None]) -> None:
    """The author of such an engine would have been told by its own checks."""
    install_engines({"broken": "broken:Broken"})
    from broken import Broken

    from proofroll.conformance import run_check

    with pytest.raises(AssertionError, match="inertia"):
        run_check(Broken, "certificate_holds[open_inertia-matched-cylinder]")
