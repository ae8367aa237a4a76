"""Surprises: what a run of an engine shows by itself, and what its steps or its words merely suggest."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from proofroll.core.errors import InputError, ProofrollError
from proofroll.core.verdict import Judgement, LimitResult, Verdict
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll_fuzz import evaluation
from proofroll_fuzz import surprises as kinds
from proofroll_fuzz.drawing import all_families, drawn_scene
from proofroll_fuzz.relations import write_scene

_JUDGEMENT = Judgement("v", "m/s", 0.1, 0.0, 1e-3, 1.0, Verdict.DIFFERS, limit=LimitResult.NOT_SHOWN)


@pytest.mark.parametrize(("errors", "wrong"), [([0.1, 0.1, 0.1], True), ([0.1, 0.2, math.inf], False)])
def test_a_step_that_is_too_long_to_end_leaves_no_steady_error(errors: list[float], wrong: bool) -> None:
    """Errors that are alike at all steps are wrong, but where the longest step has no result they are not alike."""
    assert kinds._is_wrong(_JUDGEMENT, False, errors) is wrong


def test_messages_about_parts_of_a_pair_are_one_kind() -> None:
    """A pair and a part of it have the same words."""
    assert kinds._words("pai1 has no contact") == kinds._words("pai12.3 has no contact")


@pytest.mark.parametrize(
    ("late", "event", "errors", "alone"),
    [
        (1, 0.0398, [0.1, 0.1], True),
        (2, 0.0398, [0.1, 0.1], False),
        (1, 0.032, [0.1, 0.1], False),
        (1, 0.032, [0.01, 0.1], True),
        (1, 0.0598, [0.1, 0.1], False),
    ],
)
def test_a_sample_right_behind_an_event_shows_no_wrong_limit(
    late: int, event: float, errors: list[float], alone: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is off at the first sample behind an impact alone may not have followed it yet; what stays off is wrong."""
    monkeypatch.setattr(kinds, "_errors", lambda *_: errors)
    times, sizes = np.array([0.0, 0.02, 0.04, 0.06]), np.zeros(4)
    sizes[2 : 2 + late] = 5.0
    monkeypatch.setattr(kinds, "_apart", lambda *_: kinds._Apart(times, sizes))
    run: Any = SimpleNamespace(facts=SimpleNamespace(step=1e-3), rungs=[SimpleNamespace(value=2e-3)])
    reference: Any = SimpleNamespace(events=[SimpleNamespace(time=event)])
    assert kinds._late_alone(run, _JUDGEMENT, reference) is alone


def test_a_broken_installation_is_no_invalid_scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is wrong with the package ends a hunt, which would draw scenes without end."""

    def load(_: str) -> None:
        raise ProofrollError("the folder models/ is missing; reinstall proofroll")

    monkeypatch.setattr(evaluation, "load_scene", load)
    with pytest.raises(ProofrollError, match="reinstall"):
        evaluation.evaluate_scene(tmp_path, "truth", Runner(Store(tmp_path / "cases")), 1.0)


def test_an_error_of_the_comparison_is_a_find_and_ends_no_hunt(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A scene that the reader takes, and that a comparison cannot end, is a surprise of its own."""

    def fail(*_: object, **__: object) -> None:
        raise InputError("joints.j.q0", 0.0, "the motion begins with -0.8; leave q0 out")

    write_scene(tmp_path, drawn_scene(all_families(), 0).tables)
    monkeypatch.setattr(evaluation, "_compared", fail)
    evaluated = evaluation.evaluate_scene(tmp_path, "truth", Runner(Store(tmp_path / "cases")), 1.0)
    assert [str(item.kind).startswith("proofroll; fails; joints") for item in evaluated.surprises] == [True]
