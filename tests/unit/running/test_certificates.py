"""Certificates of settings that differ in the step alone: one is made in a process."""

from __future__ import annotations

from dataclasses import replace

import pytest

from proofroll.core.certificate import Line
from proofroll.running import run_case
from proofroll.running.case import Case
from proofroll.studies.cases import single_case


@pytest.fixture
def coarse(monkeypatch: pytest.MonkeyPatch) -> Case:
    """A case with a step of 10 ms, in a process that has no certificates yet."""
    monkeypatch.setattr(run_case, "_certificates", {})
    return single_case("pendulum", {}, "projection[integrator=rk4,dt=0.01]", until=0.1, every=0.1, time_limit=60.0)


def at(case: Case, **settings: object) -> Case:
    """The same case with other settings."""
    return replace(case, engine=replace(case.engine, settings=case.engine.settings | settings))


def test_a_certificate_of_a_coarser_step_holds_for_finer_ones(coarse: Case) -> None:
    """It is taken for the same model with a finer step, and not for a coarser one, another setting or another scene."""
    lines: list[Line] = []
    run_case._keep_certificate(coarse, lines)
    assert run_case._known_certificate(at(coarse, dt=1e-3)) is lines
    assert run_case._known_certificate(at(coarse, dt=0.02)) is None
    assert run_case._known_certificate(at(coarse, preset="default")) is None
    assert run_case._known_certificate(replace(coarse, scene_digest="another")) is None
    run_case._keep_certificate(at(coarse, dt=1e-3), [])
    assert run_case._known_certificate(at(coarse, dt=5e-3)) is lines, "the coarsest one stays"
