"""The first acceleration, derived from an engine's own steps."""

from __future__ import annotations

import dataclasses

import pytest
from nonconforming import Clamped, Damped, Mute, Unresisting
from tiny import Tiny, TinySettings

from proofroll.core.arrays import FloatArray
from proofroll.core.certificate import certify, first_difference
from proofroll.core.engine import Regularised
from proofroll.core.errors import Diverged, Refused
from proofroll.core.first_steps import MOST, certificate, derivable, first_steps
from proofroll.core.multi_element import build
from proofroll.core.scene import Scene
from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.ball.rolling_equations import reduced_rates
from proofroll.papers.blajer_2006.ball.sampling import BallBuilt
from proofroll.running.simulation import simulate

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


class Parrot(Tiny):
    """Repeats the scene's numbers, and moves in half its gravity."""

    def rates(self, x: FloatArray) -> FloatArray:
        """Of another scene."""
        return reduced_rates(dataclasses.replace(self.body, gravity=self.body.gravity / 2), x)[0]


class SoftParrot(Parrot):
    """Says besides that its acceleration is a little soft."""

    def built(self) -> BallBuilt:
        """With an excuse."""
        return dataclasses.replace(super().built(), regularised={"acceleration": Regularised(1e-3, "it gives way")})


@pytest.mark.parametrize("liar", [Parrot, SoftParrot])
def test_who_repeats_the_scenes_numbers_is_seen_by_its_motion(liar: type[Tiny]) -> None:
    """The first steps of an engine are looked at although it says the right acceleration."""
    engine = build(liar, SLOW, TinySettings())
    assert first_difference(certify(engine, SLOW)) is None
    seen = {line.quantity: line.holds for line in certificate(liar, engine, SLOW, TinySettings())}
    assert seen["acceleration"]
    assert not seen["acceleration of the first steps"]
    with pytest.raises(Refused, match="acceleration of the first steps"):
        simulate(SLOW, liar, until=0.1)


def test_an_honest_engine_that_speaks_is_believed(scene: Scene) -> None:
    """The certificate of an engine that says the right acceleration holds, and shows what its first steps say."""
    lines = certificate(Tiny, build(Tiny, scene, TinySettings()), scene, TinySettings())
    assert first_difference(lines) is None
    assert [line.quantity for line in lines if "of the first steps" in line.quantity]


def test_nothing_is_derived_where_nothing_can_be() -> None:
    """An engine that fails and steps too coarse to tell give no line, and no error."""

    class Fails(Tiny):
        def advance(self, t: float) -> None:
            raise Diverged(f"it fell before {t:g} s")

    assert derivable(Fails, SLOW, TinySettings()) == []
    assert derivable(Tiny, load_scene("sphere_in_cylinder", speed=6.0), TinySettings(dt=0.05)) == []
    assert len(derivable(Tiny, SLOW, TinySettings())) == 2
