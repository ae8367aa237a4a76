"""Allowance of a conformance run for what one step beside an event does."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

from proofroll.conformance import response
from proofroll.conformance.subject import Subject, UnlikeSceneError, contrasts
from proofroll.core.events import Event, with_events
from proofroll.core.plugins import load_engine
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.run.element import the_mechanism
from proofroll.files.scene_file import load_scene

STEP, APART = 1e-3, 2e-8


def jumping(times: tuple[float, ...], names: tuple[str, ...]) -> xr.Dataset:
    """A ball whose velocities jump by 1 and, moments later, by 2."""
    t = np.array(times)
    values = 1.0 * (t > 0.05) + 2.0 * (t > 0.05 + APART)
    both = {name: (("time", "axis"), values[:, None] * [1.0, 0.0, 0.0]) for name in names}
    found = xr.Dataset({**both, "p_WB": (("time", "axis"), np.zeros((len(t), 3)))}, {"time": t})
    return with_events(found, [Event("impact", time, time, time) for time in (0.05, 0.05 + APART)])


@pytest.mark.parametrize(
    ("names", "allowed"), [(("v_WB", "w_WB"), {"p_WB", "v_WB", "w_WB"}), (("v_WB",), {"p_WB", "v_WB"}), ((), set())]
)
def test_jumps_that_follow_at_once_count_together(
    monkeypatch: pytest.MonkeyPatch, names: tuple[str, ...], allowed: set[str]
) -> None:
    """Two jumps within a moment allow a step's way at their sum; elements without velocities are allowed nothing."""
    scene = load_scene("bouncing_ball")
    monkeypatch.setattr(response, "_trajectory", lambda _, times: jumping(times, names))
    found = response._beside_events(scene, STEP, jumping((0.0, 0.1), names))
    assert set(found) == allowed
    if names:
        assert found["p_WB"] == pytest.approx(3 * STEP)


MUJOCO, PINOCCHIO = ("mujoco", "joints"), ("pinocchio", "impulses")
# Law -> an engine that has it with its formulation, and what a weaker or stronger law changes of a part of the scene.
PLANTED: dict[str, tuple[tuple[str, str], Callable[[Mechanism], Mapping[str, object]]]] = {
    "limit_of_efforts": (MUJOCO, lambda m: {"actuators": (replace(m.actuators[0], limit=1.3 * 5.0),)}),
    "stiffness_of_servos": (MUJOCO, lambda m: {"actuators": (replace(m.actuators[0], kp=1.1 * m.actuators[0].kp),)}),
    "held_targets": (MUJOCO, lambda m: {"control": replace(m.control, delay=1)}),  # type: ignore[type-var]  # it has one
    "damping": (MUJOCO, lambda m: {"joints": tuple(replace(joint, damping=0.5 * joint.damping) for joint in m.joints)}),
    "stops": (MUJOCO, lambda m: {"joints": tuple(replace(joint, limits=None) for joint in m.joints)}),
    "rebounds_from_stops": (
        PINOCCHIO,
        lambda m: {"joints": tuple(replace(joint, restitution=0.8 * joint.restitution) for joint in m.joints)},
    ),
    "restitution": (PINOCCHIO, lambda m: {"pairs": (replace(m.pairs[0], restitution=0.8 * m.pairs[0].restitution),)}),
    "friction_of_contacts": (
        PINOCCHIO,
        lambda m: {"pairs": tuple(replace(pair, friction=0.8 * pair.friction) for pair in m.pairs)},
    ),
}


@pytest.mark.drill
@pytest.mark.one_in(4)
@pytest.mark.parametrize("law", [*contrasts()])
@pytest.mark.parametrize("dropped", [True, False])
def test_a_law_of_another_strength_is_found(law: str, dropped: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """An honest engine passes; one that drops a law, or has it with another strength, fails by the part it has."""
    (name, formulation), fault = PLANTED[law]
    pytest.importorskip(name, reason=f"the law is planted in {name}; pip install 'proofroll[{name}]'")
    engine, (scene, without) = load_engine(name), contrasts()[law]
    settings, moved = engine.presets[formulation]["matched"], response._moved
    response.law_acts(Subject(engine, settings, scene), without)
    element = the_mechanism(scene)
    changed = replace(element, mechanism=replace(element.mechanism, **fault(element.mechanism)))
    planted = without if dropped else replace(scene, elements=(changed,))
    monkeypatch.setattr(response, "_moved", lambda run, times, true: moved(replace(run, scene=planted), times, true))
    with pytest.raises(UnlikeSceneError, match=r"the law has -?\d.* of its strength"):
        response.law_acts(Subject(engine, settings, scene), without)
