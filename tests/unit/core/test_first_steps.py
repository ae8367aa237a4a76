"""The first acceleration, derived from an engine's own steps."""

from __future__ import annotations

import dataclasses

import pytest
from nonconforming import Clamped, Damped, Mute, Unresisting
from tiny import Tiny, TinySettings

from proofroll.core.certificate import first_difference
from proofroll.core.errors import Diverged
from proofroll.core.first_steps import MOST, derivable, first_steps
from proofroll.core.scene import Scene
from proofroll.files.scene_file import load_scene

SLOW = load_scene("sphere_in_cylinder", speed=1.2, axial_speed=0.2, radial_spin=5.0, rolling_resistance=5e-4)


def test_an_honest_engine_has_the_scenes_acceleration(scene: Scene) -> None:
    """What steps of 1e-3 s give is the scene's acceleration, to a tolerance that would show a thousandth of it."""
    for kind in (Tiny, Mute):
        lines = first_steps(kind, scene, TinySettings())
        assert [line.quantity.partition(" of")[0] for line in lines] == ["acceleration", "angular acceleration"]
        assert first_difference(lines) is None
        assert max(line.tolerance for line in lines) < 1e-3


@pytest.mark.parametrize("liar", [Damped, Clamped, Unresisting])
def test_who_is_silent_is_seen_by_its_motion(liar: type[Tiny]) -> None:
    """Damping, a clamp on the spin and a resistance left out are in the first steps, whatever the adapter says."""
    lines = [dataclasses.replace(line, tolerance=min(line.tolerance, MOST)) for line in first_steps(
        liar, SLOW, TinySettings()
    )]  # fmt: skip
    sentence = first_difference(lines)
    assert sentence is not None
    assert "of the first steps" in sentence


def test_nothing_is_derived_where_nothing_can_be() -> None:
    """An engine that fails, a ball at rest under resistance and steps too coarse to tell give no line, and no error."""

    class Fails(Tiny):
        def advance(self, t: float) -> None:
            raise Diverged(f"it fell before {t:g} s")

    assert derivable(Fails, SLOW, TinySettings()) == []
    rest = load_scene("inclined_plane", speed=0.0, cross_speed=0.0, rolling_resistance=5e-4)
    assert first_steps(Tiny, rest, TinySettings()) == []
    assert derivable(Tiny, load_scene("sphere_in_cylinder", speed=6.0), TinySettings(dt=0.05)) == []
    assert len(derivable(Tiny, SLOW, TinySettings())) == 2
