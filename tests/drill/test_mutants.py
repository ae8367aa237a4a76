"""The drill of mutants: every planted fault is detected, nearly every one named, and honest engines are not accused."""

from __future__ import annotations

import functools
import html
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from proofroll.conformance import run_check
from proofroll.core.diagnosis import CLOSES, METHOD, Cause, Evidence, diagnose, hypotheses_of
from proofroll.core.diagnosis.fitting import change_by
from proofroll.core.diagnosis.vectors import ReportedVector
from proofroll.core.plugins import load_element_kinds
from proofroll.core.truth import truth
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate
from proofroll_drill.command import drill
from proofroll_drill.mutants import balls, contact_models, joint_laws, mechanism_samples
from proofroll_drill.mutants.base import Mutant
from proofroll_drill.mutants.drilling import ENOUGH, judged_without_fault, mutant, mutants, tried, without_fault


@functools.cache
def _drilled() -> dict[str, object]:
    done = CliRunner().invoke(drill, ["mutants", "--json"])
    assert done.exit_code == 0, done.output
    return dict(json.loads(done.stdout))


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.timeout(900)  # two minutes of processor time, on a machine that may have much else to do
def test_every_mutant_is_detected_and_most_are_named() -> None:
    """At least thirty engines with one fault each: all are detected, nine of ten named, of contacts and joints all."""
    found = _drilled()
    rows = found["mutants"]
    assert isinstance(rows, list)
    assert found["tried"] == len(rows) >= 30
    assert [row["mutant"] for row in rows if not row["detected"]] == []
    assert sum(row["named"] for row in rows) == found["named"] >= ENOUGH * len(rows)
    assert all(row["said"] for row in rows if row["named"])
    of_laws = {kind.__name__ for kind in (*contact_models.FAULTS, *joint_laws.FAULTS)}
    assert [row for row in rows if row["mutant"] in of_laws and not row["named"]] == []


WITHOUT_FAULT = {(kind.__bases__, repr(kind.scene), kind.until): kind for kind in map(without_fault, mutants())}
NIGHTLY = pytest.mark.nightly
# Scenes whose truth takes little time: every third engine on them runs before a change lands. The others are for the
# night, as the drill of mutants is.
QUICK = {"sphere_in_cylinder", "two_bounces", "double_pendulum", "heavy_top", "free_body", "saturated_servo"}


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    "kind",
    [
        pytest.param(kind, id=kind.__name__, marks=NIGHTLY if place % 3 or kind.scene[0] not in QUICK else ())
        for place, kind in enumerate(WITHOUT_FAULT.values())
    ],
)
def test_an_engine_without_a_fault_is_not_detected(kind: type[Mutant]) -> None:
    """Errors of an engine without the fault are no sign of it, and are small on every scene."""
    found = tried(type("Harmless", (kind,), {"fault": "none"}))
    assert not found.detected, found.by
    assert [item for item in judged_without_fault(kind) if item.error > 2e-3 * item.scale] == []


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize("fault", [pytest.param("PyramidForCone", marks=pytest.mark.drill), "FrictionOfOneFoot"])
def test_a_fault_of_contacts_is_detected_and_named(fault: str) -> None:
    """A law of friction that is not the scene's, or the coefficient of one of three feet, is found, and its cause."""
    found = tried(mutant(fault))
    assert found.detected
    assert found.named, found.said


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.drill_of("RoughJoint", "CoarseGear")
@pytest.mark.parametrize(
    "fault", ["RoughJoint", "PushingJoint", "TightClamp", "SwappedGains", "UndampedServo", "InverseGear", "CoarseGear"]
)
def test_a_law_of_joints_that_is_another_is_named(fault: str) -> None:
    """Friction, stops, armature, limits, gains and gears of joints that are not the scene's are named as such."""
    pytest.importorskip("pinocchio")
    found = tried(mutant(fault))
    assert found.detected
    assert found.named, found.said


@pytest.mark.nightly
@pytest.mark.parametrize("scene", [pytest.param("gyroscope_cart", marks=pytest.mark.drill), "heavy_top"])
def test_late_reactions_of_a_fast_rotor_are_named(scene: str) -> None:
    """Reactions of the step before are named where they change little, beside errors of the step that change less."""
    found = tried(type("LateReactionOfRotor", (mechanism_samples.LateReaction,), {"scene": (scene, {})}))
    assert found.named, found.by


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("scene", "parameters", "until"),
    [
        ("sphere_in_cylinder", {}, 0.3),
        ("slide_to_roll", {"speed": 1.0}, 0.2),
        ("double_pendulum", {}, 0.3),
        pytest.param("slider_crank", {}, 0.2, marks=pytest.mark.drill),
        pytest.param("arm_pd", {}, 0.3, marks=pytest.mark.drill),
        pytest.param("pendulum_friction", {}, 0.4, marks=pytest.mark.drill),
    ],
)
def test_small_errors_of_an_honest_engine_have_no_cause(scene: str, parameters: dict[str, float], until: float) -> None:
    """A run that scatters about the truth, as an engine's own tolerance makes it, is accused of nothing."""
    loaded = load_scene(scene, **parameters)
    true = truth(loaded, np.arange(0, until, 0.008))
    noisy, random = true.copy(deep=True), np.random.default_rng(7)
    for name in ("p_WB", "v_WB", "w_WB"):
        noisy[name] += 1e-5 * random.standard_normal(noisy[name].shape) * float(abs(noisy[name]).max())
    for element in loaded.elements:
        for run in (true, noisy):
            assert diagnose(Evidence(element, [], run, true, 1e-3), hypotheses_of(element)) == []


CLAIM = """title = "A mutant"
question = "Does it agree?"
scene = "sphere_in_cylinder"
until = 0.1
every = 0.01
[tolerances.close]
because = "it is refused before it is judged"
z = "1e-3 m"
[[rows]]
engine = "mutant[preset=default,dt=0.002]"
tolerance = "close"
"""


@pytest.mark.nightly
def test_everybody_is_told_the_same_cause(
    proofroll: Callable[..., tuple[int, str, str]],
    install_engines: Callable[[dict[str, str]], None],
    tmp_path: Path,
) -> None:
    """A conformance check, run and report, data and page, name the cause of a wrong model in the same words."""
    liar = balls.ToldInertia
    with pytest.raises(AssertionError) as told:
        run_check(liar, f"certificate_holds[{liar.formulation}-default-cylinder]")
    install_engines({"mutant": "proofroll_drill.mutants.balls:ToldInertia"})
    claim = tmp_path / "claim.toml"
    claim.write_text(CLAIM, encoding="utf-8")
    ran = proofroll("run", liar.scene[0], "--engine", "mutant[preset=default,dt=0.002]", "--json")
    assert proofroll("report", str(claim), "--json", "--out", str(tmp_path / "out"))[0] == 1
    assert ran[1], ran[2]
    (cause,) = json.loads(ran[1])["diagnosis"]
    assert liar.named[0] in cause["sentence"]
    assert f"cause: the engine's model has {liar.named[0]}" in str(told.value)
    report = json.loads((tmp_path / "out" / "report.json").read_text(encoding="utf-8"))
    assert [item["sentence"] for item in report["comparisons"][0]["rows"][0]["diagnosis"]] == [cause["sentence"]]
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert f"{cause['sentence']}: {cause['remedy']}." in html.unescape(page)


def test_every_hypothesis_says_its_grounds() -> None:
    """Each hypothesis of each kind of element has a name of its own and says what it tests and why that is proof."""
    kinds = [kind for kind in load_element_kinds() if hasattr(kind, "hypotheses")]
    assert {kind.name for kind in kinds} >= {"mechanism"}
    for kind in kinds:
        names = [item.id for item in kind.hypotheses()]
        assert all(len(item.grounds) > 20 for item in kind.hypotheses())
        assert len(names) - len(set(names)) <= 2  # three loads are one hypothesis


def test_a_factor_near_one_accuses_nobody() -> None:
    """A coarse step changes inertia by less than a hundredth; mistakes are known factors, or further off."""
    factors = (0.99752, 1.00249, 0.0, 0.5, 1.05)
    assert [change_by(factor) > METHOD for factor in factors] == [False, False, True, True, True]


def test_a_cause_that_leaves_too_much_is_not_told() -> None:
    """A hypothesis that leaves more of a difference than it may proves nothing, and one that leaves little does."""
    base = {"id": "x", "says": "it does x", "quantity": "N", "unit": "N", "before": 1.0, "remedy": "do y"}
    assert not Cause(**base, after=1.1 * CLOSES).proven
    assert Cause(**base, after=0.049).sentence == "it does x (N off by 1 N, by 0.05 N with that)"


def test_a_jump_a_moment_later_is_no_other_clock() -> None:
    """A force that is constant but for one jump fits any shift of time, which proves none."""
    time = np.linspace(0.0, 1.0, 51)
    true, said = (np.stack([np.where(time < jump, 1.0, 0.2)] * 3, axis=-1) for jump in (0.5, 0.54))
    assert not [
        cause for cause in ReportedVector("force", "the force", "N", said, true, time).causes(1e-3) if cause.proven
    ]


@pytest.mark.nightly
def test_a_ball_that_jumps_is_not_told_of_gravity() -> None:
    """A soft contact that throws the ball off the wall again and again has neither gravity nor a pyramid to blame."""
    scene = load_scene("slide_to_roll", speed=2.0, back_spin=400.0)
    run = simulate(scene, "mujoco", until=0.5, every=0.01, formulation="geoms", preset="default")
    true = truth(scene, run["time"].to_numpy())
    assert np.any(run["N"] == 0)
    assert diagnose(Evidence(scene.elements[0], [], run, true, 2e-3), hypotheses_of(scene.elements[0])) == []
