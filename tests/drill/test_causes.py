"""Causes of planted faults that look like others: numbers that are read back or not, and reactions at time 0."""

from __future__ import annotations

import dataclasses
from typing import Any

import pytest
from placed_balls import placed, scene_with

from proofroll.core.diagnosis import Evidence
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.diagnosis.residuals import residuals_of
from proofroll.files.scene_file import load_scene
from proofroll_drill.mutants.base import Mutant
from proofroll_drill.mutants.drilling import _built, mutant, tried

TOPS = ("StandardGravity", "HeavierTop", "StifferTop", "AxialTop", "TransverseTop", "HigherTop", "AsideTop")
REACTIONS = (
    "OnParent", "BodyReaction", "Swapped", "AboutCentre", "LoopReaction", "LoopSwapped",
    pytest.param("LoopAboutCentre", marks=pytest.mark.drill),
)  # fmt: skip


@pytest.mark.parametrize("name", TOPS)
def test_a_number_that_is_read_back_is_the_cause(name: str) -> None:
    """A number that was built otherwise and is named by the certificate is the only cause."""
    found = tried(mutant(name))
    assert found.named
    assert found.said.startswith("the engine's model has")
    assert ";" not in found.said


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.nightly_of("LoopAboutCentre")
@pytest.mark.drill_of("LoopReaction")
@pytest.mark.parametrize("name", REACTIONS)
def test_reactions_that_are_told_wrongly_at_time_0_are_named(name: str) -> None:
    """The certificate's forces and moments show sign, axes, joint and point, in trees and in loops."""
    found = tried(mutant(name))
    assert found.named, found.said


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize("name", ["TiltedAxis", "CentreVelocity", "Unnormalised"])
def test_what_the_first_steps_or_the_end_of_a_run_tell_is_named(name: str) -> None:
    """An axis that the first turning shows, velocities of the centres of mass, and quaternions that grow are named."""
    found = tried(mutant(name))
    assert found.named, found.said


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    "name",
    [
        *("FrictionSign", "MassTwice", "NoSpin", "Shifted", "GravityUp"),
        *(
            pytest.param(name, marks=pytest.mark.drill)
            for name in ("InertiaTwice", "GravityAlongY", "AgainstSpin", "Damped", "StaleAxes", "LocalSpin")
        ),
    ],
)
def test_faults_of_a_body_that_rolls_on_a_wall_are_named(name: str) -> None:
    """Wrong numbers, laws, axes and times of a ball on its wall are named as those of any mechanism are."""
    found = tried(mutant(name))
    assert found.named, found.said


class SilentBall(Mutant):
    """Ball with one per cent of inertia too much, which the engine does not report."""

    fault = "inertia 1.01 times, and nothing is said of it"
    scene = ("sphere_in_cylinder", {})

    def misread(self, scene: Scene) -> Scene:
        """A little stiffer."""
        ball = placed(scene).ball  # type: ignore[attr-defined]  # it is a ball
        return scene_with(scene, ball=dataclasses.replace(ball, inertia_ratio=1.01 * ball.inertia_ratio))

    def built(self) -> Any:
        """Nothing but how close to the wall it is."""
        found = self.inner.built()
        kept = ("regularised", "gap", "mu_static", "mu_kinetic", "rolling_resistance")
        return dataclasses.replace(
            found, **{item.name: None for item in dataclasses.fields(found) if item.name not in kept}
        )


@pytest.mark.drill
def test_three_free_numbers_do_not_explain_two() -> None:
    """A ball whose friction and first steps show a little more inertia is not accused of another gravity."""
    found = tried(SilentBall)
    assert found.detected
    assert not found.said


def test_a_number_that_was_built_wrongly_leaves_no_equations_to_fit() -> None:
    """Accelerations beside a mass that the certificate names as another are no evidence of a second cause."""
    kind = mutant("HeavierTop")
    scene = load_scene(kind.scene[0], **kind.scene[1])
    lines = {line.quantity: {**line.as_dict(), "holds": False} for line in _built(kind, scene)[1]}
    element, moved = scene.elements[0], [line for name, line in lines.items() if "acceleration" in name]
    assert residuals_of(Evidence(element, moved))
    assert not residuals_of(Evidence(element, [*moved, lines["mass"]]))
