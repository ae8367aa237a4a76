"""An engine that computes in float32 and says so: certified, judged with its errors, and never accused of its floor."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from flat_judging import judged_curve
from single_precision import OnePrecision, Single, SingleSettings

from proofroll.conformance import checks
from proofroll.core.certificate import certify, first_difference
from proofroll.core.convergence import richardson, scatter_of
from proofroll.core.diagnosis import Evidence
from proofroll.core.diagnosis.samples import single_precision_run
from proofroll.core.engine import precision_of
from proofroll.core.errors import InputError
from proofroll.core.first_steps import certificate
from proofroll.core.multi_element import build
from proofroll.core.truth import truth
from proofroll.core.verdict import LimitResult, Verdict
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate
from proofroll.studies.judging.judge import judge as judge_run

SCENES = ("pendulum", "double_pendulum", "free_body")
TIMES = np.linspace(0, 1, 21)
# Round-off that is told of runs with some noise, which is as large as has been seen beside it.
SCATTER = 16
_NIGHTLY = pytest.mark.nightly


def first_lie(name: str, **changes: Any) -> str | None:
    """What the certificate of the engine says on a scene."""
    scene, settings = load_scene(name), SingleSettings(**changes)
    return first_difference(certificate(Single, build(Single, scene, settings), scene, settings))


@pytest.mark.parametrize("formulation", ["euler", "rk4"])
@pytest.mark.parametrize("name", SCENES)
def test_single_precision_is_certified(name: str, formulation: str) -> None:
    """What the engine holds in 24 bits is the scene, where it says its precision."""
    assert first_lie(name, formulation=formulation) is None


@pytest.mark.parametrize("name", SCENES)
def test_a_wrong_mass_is_no_round_off(name: str) -> None:
    """A mass that is off by a thousandth is refused in either precision."""
    assert "mass is 1.001" in str(first_lie(name, heavier=1.001))
    assert "mass is 1.001" in str(first_lie(name, heavier=1.001, precision="double"))


def test_who_says_no_precision_is_told_how() -> None:
    """A float32 engine that does not say so is refused with the setting that it lacks."""
    scene = load_scene("pendulum", mass=1.3)
    said = first_difference(certify(build(Single, scene, SingleSettings()), scene))
    assert 'single precision (float32): settings of the engine must say precision = "single"' in str(said)


def test_another_precision_is_one_line() -> None:
    """A precision that nobody knows is named with those that there are."""
    with pytest.raises(InputError, match=r"half.: settings say double or single"):
        precision_of(SimpleNamespace(precision="half"))


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.drill_of("double_pendulum")
@pytest.mark.parametrize("name", SCENES)
def test_errors_stay_errors(name: str) -> None:
    """Places are judged with the error that 24 bits leave, above that of doubles, and agree to a thousandth."""
    scene = load_scene(name)
    errors = {}
    for precision in ("single", "double"):
        run = simulate(scene, Single, until=0.1, every=0.05, precision=precision, formulation="rk4")
        found = judge_run(run, scene, {"positions": "0.1 %"})
        errors[precision] = found.compared[0].judgement.error
        assert found.agrees
    assert errors["single"] > 10 * errors["double"]


@pytest.mark.drill
def test_a_declared_precision_is_no_cause() -> None:
    """A run in float32 has that as a cause of its difference only where nobody said so."""
    scene, times = load_scene("double_pendulum"), np.linspace(0, 0.5, 51)
    true = truth(scene, times)
    run = true.assign({name: true[name].astype(np.float32).astype(float) for name in ("p_WB", "v_WB", "w_WB")})
    engine = build(Single, scene, SingleSettings())
    causes = {}
    for precision in ("single", "double"):
        settings = SingleSettings(precision=precision)
        lines = [dataclasses.replace(line, difference=0.0).as_dict() for line in certify(engine, scene, settings)]
        causes[precision] = list(single_precision_run.test(Evidence(scene.elements[0], lines, run, true)))
    assert [cause.id for cause in causes["double"]] == ["float32"]
    assert causes["single"] == []


def rungs(truncation: float, noise: float, order: int = 4) -> list[np.ndarray]:
    """Curves at the steps 1, 1/2, 1/4: an error that falls with its order, and round-off that grows with the steps."""
    rng = np.random.default_rng(1)
    shape, steps = np.sin(3 * TIMES), (1.0, 0.5, 0.25)
    return [np.cos(TIMES) + truncation * h**order * shape + noise / h * rng.standard_normal(21) for h in steps]


def test_no_order_is_fitted_through_a_floor() -> None:
    """Where round-off adds to the last difference neither an order nor a limit is shown; above it both are."""
    mixed = richardson(rungs(1e-5, 3e-7), (1.0, 0.5, 0.25), 4, SCATTER * 3e-7)
    assert np.isnan(mixed.order)
    assert not mixed.shown
    clear = richardson(rungs(1e-2, 1e-7), (1.0, 0.5, 0.25), 4, SCATTER * 1e-7)
    assert clear.order == pytest.approx(4, abs=0.1)
    assert clear.shown


def test_far_above_round_off_all_is_judged_as_in_doubles() -> None:
    """Curves of no single law and of a strange order are judged as in doubles where round-off is far below them."""
    strange = [np.cos(TIMES) + 0.1 * h**2.5 * np.sin((3 + h) * TIMES) for h in (1.0, 0.5, 0.25)]
    steps = (1.0, 0.5, 0.25)
    scatter = scatter_of("single", 1.0, 2000)
    found, double = richardson(strange, steps, 4, scatter), richardson(strange, steps, 4)
    assert [found.order, found.error_bar] == pytest.approx([double.order, double.error_bar], rel=0, abs=0, nan_ok=True)
    assert found.shown
    assert double.shown
    near = richardson(strange, steps, 4, 100 * scatter)
    assert near.rounded
    assert not near.shown
    assert scatter_of("double", 1.0, 2000) == 0.0


@pytest.mark.parametrize(("truncation", "noise"), [(0.0, 1e-6), (1e-5, 1e-6), (1e-5, 1e-5), (1e-3, 1e-7), (1e-3, 1e-5)])
@pytest.mark.parametrize("tolerance", [1e-8, 1e-6, 1e-4])
def test_nobody_has_another_limit_by_a_floor(truncation: float, noise: float, tolerance: float) -> None:
    """Round-off that grows with the number of steps is no other limit, at any tolerance."""
    curves = rungs(truncation, noise)
    limit = richardson(curves, (1.0, 0.5, 0.25), 4, SCATTER * noise)
    found = judged_curve(
        "x", "m", curves[0], np.cos(TIMES), truth_error_bar=1e-15, tolerance=tolerance, scale=1.0, limit=limit,
        ladder=True, precision="single",
    )  # fmt: skip
    assert found.limit != LimitResult.ANOTHER


def test_another_motion_is_another_limit_in_single_precision_too() -> None:
    """A model that is off by a hundredth at every step is told as that, with its order and at its floor."""
    for truncation, noise in ((1e-3, 1e-8), (0.0, 1e-6)):
        curves = [1.01 * curve for curve in rungs(truncation, noise)]
        limit = richardson(curves, (1.0, 0.5, 0.25), 4, SCATTER * noise)
        found = judged_curve(
            "x", "m", curves[0], np.cos(TIMES), truth_error_bar=1e-15, tolerance=1e-4, scale=1.0, limit=limit,
            ladder=True, precision="single",
        )  # fmt: skip
        assert (found.verdict, found.limit) == (Verdict.DIFFERS, LimitResult.ANOTHER)


@pytest.fixture
def single(install_engines: Callable[[Any], None]) -> None:
    """The engine, announced."""
    install_engines({"single": "single_precision:Single"})


COMPARISON = """
title = "Single precision"
question = "Does it hold?"
scene = "free_body"
until = 0.2
every = 0.02

[tolerances.tight]
positions = "1e-4 m"
because = "a small bound"

[[rows]]
engine = "single[formulation=rk4,dt=1e-4]"
tolerance = "tight"
expect = "agrees"
because = "it computes with 24 bits"
"""


@pytest.mark.nightly
@pytest.mark.usefixtures("single")
def test_a_comparison_tells_precision_and_floor(
    command_line: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    """A row says f32, in tables and JSON, and where its ladder ends; it agrees and nobody accuses it."""
    file = tmp_path / "single.toml"
    file.write_text(COMPARISON)
    code, out, err = command_line("compare", str(file), "--out", str(tmp_path), "--json")
    assert code == 0, err
    (row,) = json.loads(out)["rows"]
    assert (row["precision"], row["setting"], row["verdict"]) == ("single", "matched f32", "agrees")
    (run,) = json.loads(out)["runs"]
    (judged,) = run["judgements"]
    assert judged["limit"] != "another limit"
    assert judged["order"] is None
    assert judged["reason"].endswith("single precision")
    code, out, err = command_line("compare", str(file), "--out", str(tmp_path), "--orders")
    assert "rk4, matched f32" in out
    assert "single precision" in out, out
    code, out, err = command_line("run", "free_body", "--engine", "single", "--until", "0.01")
    assert ", f32, dt 1e-3 s reached 0.01 s" in out


@pytest.mark.one_in(4)
@pytest.mark.parametrize(
    "check",
    [
        pytest.param(check, id=check.name, marks=_NIGHTLY if "[rk4" in check.name else ())
        for check in checks(Single)
        if "entry_point" not in check.name
        # what is built hangs on no formulation
        if "[rk4" not in check.name or not check.name.startswith(("builds", "certificate"))
    ],
)
def test_single_precision_conforms(check: Callable[[], None]) -> None:
    """The checks for engines' authors let an engine in float32 pass."""
    check()


@pytest.mark.nightly
def test_conformance_can_run_each_preset_in_a_process_of_its_own() -> None:
    """A switch of the whole process fails no check of another preset there; without, one accuses the other."""
    name = "certificate_holds[{}-matched-pendulum]"
    names = [name.format("euler"), name.format("rk4"), "precision_is_told"]
    together, alone = ({check.name: check for check in checks(OnePrecision, apart=apart)} for apart in (False, True))
    for one in names:
        alone[one]()
    together[names[0]]()
    with pytest.raises(AssertionError, match="this process computes in double precision"):
        together[names[1]]()
    with pytest.raises(
        AssertionError, match="no installed package has the entry point"
    ):  # a failure there is told as here
        alone["name_is_the_entry_point"]()
