"""Impulses by blocks: the exact cone of each contact and the bounds of dry friction, where Pinocchio's ADMM stops."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pinocchio")

from proofroll.core.errors import Diverged
from proofroll.core.plugins import load_engine
from proofroll.engines.pinocchio.contact import blocks as blocks_module
from proofroll.engines.pinocchio.contact.blocks import Block, impulses_by_blocks
from proofroll.engines.pinocchio.contact.impulses import ImpulseSteps
from proofroll.files.scene_file import load_scene

PRESETS = load_engine("pinocchio").presets["impulses"]


@pytest.mark.parametrize("seed", range(8))
def test_impulses_obey_the_laws(seed: int) -> None:
    """Contacts press, stay in their cones and slip against their friction; joints stay in their bounds."""
    random = np.random.default_rng(seed)
    blocks = [Block(0, 0.6), Block(3, 0.1), Block(6, 0.0), Block(9, None, 0.02), Block(10, None)]
    rows = random.normal(size=(11, 14))
    G, g = rows @ rows.T, random.normal(size=11)
    f, change = impulses_by_blocks(G, g, blocks, np.zeros(11), 1e-9)
    u = g + G @ f
    assert change < 1e-11
    for block in blocks[:3]:
        (x, y, normal), (slip_x, slip_y, gap) = f[block.rows], u[block.rows]
        assert min(normal, gap) >= -1e-9
        assert abs(normal * gap) < 1e-9
        friction, slip, bound = np.hypot(x, y), np.hypot(slip_x, slip_y), block.friction * normal  # type: ignore[operator]
        assert friction <= bound + 1e-9
        assert abs(x * slip_x + y * slip_y + bound * slip) < 1e-8, "friction is largest where it slips, and against it"
    assert abs(f[9]) <= 0.02
    assert abs(f[9]) == pytest.approx(0.02) or abs(u[9]) < 1e-9
    assert min(f[10], u[10]) >= -1e-9
    assert abs(f[10] * u[10]) < 1e-9


@pytest.mark.parametrize("noise", [0.0, 1e-17])
@pytest.mark.parametrize("seed", range(4))
def test_a_body_in_a_plane_gives_way_in_two_directions(seed: int, noise: float) -> None:
    """Contacts that nothing moves across a plane have the impulses of the plane, and none but round-off across it."""
    random = np.random.default_rng(seed)
    rows, g = random.normal(size=(6, 8)), random.normal(size=6) - np.array([0, 0, 2, 0, 0, 2])
    rows[[1, 4]] *= noise
    g[[1, 4]] *= noise
    f, change = impulses_by_blocks(rows @ rows.T, g, [Block(0, 0.6), Block(3, 20.0)], np.zeros(6), 1e-9)
    u = g + rows @ rows.T @ f
    assert change < 1e-9
    for slip, across, normal in ((0, 1, 2), (3, 4, 5)):
        assert min(f[normal], u[normal]) >= -1e-9
        assert abs(f[normal] * u[normal]) < 1e-9
        assert abs(f[across]) < 1e-9
        bound = (0.6 if not slip else 20.0) * f[normal]
        assert abs(f[slip]) <= bound + 1e-9
        assert abs(u[slip]) < 1e-9 or f[slip] * np.sign(u[slip]) == pytest.approx(-bound, abs=1e-8)


def test_sweeps_end_where_round_off_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """A change within the tolerance that no longer falls ends the sweeps; one above it goes on to the last."""
    random, sweeps = np.random.default_rng(3), [0]
    rows = random.normal(size=(6, 8))
    G, g = rows @ rows.T, random.normal(size=6) - np.array([0, 0, 1, 0, 0, 1])
    exact = blocks_module._contact

    def rough(*arguments: Any) -> list[float]:
        sweeps[0] += 1
        return [value * (1 + 1e-10 * (-1) ** (sweeps[0] // 2)) for value in exact(*arguments)]

    monkeypatch.setattr(blocks_module, "_contact", rough)
    counts = {}
    for tolerance in (1e-8, 0.0):
        sweeps[0] = 0
        f, change = impulses_by_blocks(G, g, [Block(0, 0.5), Block(3, 0.5)], np.zeros(6), tolerance)
        counts[tolerance] = sweeps[0] / 2
    assert 0 < change < 1e-8
    assert f.any()
    assert counts[1e-8] < 200
    assert counts[0.0] > 1900


@pytest.mark.drill
def test_blocks_and_admm_find_the_same_motion(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where Pinocchio's ADMM finds the impulses, blocks find the same; a run that had to take them says so."""
    scene, settings = load_scene("sled"), replace(PRESETS["matched"], dt=1e-3)
    kind = load_engine("pinocchio")
    usual = kind.build(scene, settings)
    usual.advance(0.1)
    places = usual.sample().p_WB
    assert not usual.remarks()

    def stops(*_: object, **__: object) -> None:
        raise Diverged("it stops")

    monkeypatch.setattr(ImpulseSteps, "_found", stops)
    run = kind.build(scene, settings)
    run.advance(0.1)
    np.testing.assert_allclose(run.sample().p_WB, places, atol=1e-8)
    assert "solves its matrices by blocks" in run.remarks()[0]
