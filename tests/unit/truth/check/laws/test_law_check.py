"""Records in closed form hold all laws; a fault of a millionth in any part is seen, and named by its law."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from tests.unit.truth.check.laws.conftest import HandMade, bounce, free_body, pendulum, sliding

from proofroll.elements.mechanism import Body
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair

MILLIONTH = 1 + 1e-6
HONEST = 1e-3  # largest residual of a record by hand, in parts of its allowance; 1e-5 is seen


@pytest.mark.parametrize("record", [free_body, pendulum, sliding, bounce])
def test_a_motion_in_closed_form_holds_all_laws(record: Callable[[], HandMade]) -> None:
    """A record of round-off leaves a small part of each allowance."""
    residuals = record().residuals()
    assert residuals.first is None
    assert max(part for part, _, _ in residuals.largest.values()) < HONEST
    assert {"place", "turn"} <= set(residuals.largest)


def _scaled(values: np.ndarray) -> np.ndarray:
    return values * MILLIONTH


def _raised(p: np.ndarray) -> np.ndarray:
    return p + np.array([[0.0, 0.0, 1e-6], [0.0, 0.0, 0.0]])  # the body, not the world


FAULTS = {
    "a velocity that is not the rate of the place": (free_body().changed(v=_scaled), ("place", "stone")),
    "an angular velocity that is not that of the rotation": (free_body().changed(w=_scaled), ("turn", "stone")),
    "gravity": (free_body().of(gravity=(0.0, 0.0, -9.81 * MILLIONTH)), ("momentum", "stone")),
    "effort": (pendulum().changed(effort=_scaled), ("effort", "motor")),
    "place of a joint": (pendulum().changed(p=_raised), ("joint place", "pivot")),
    "friction": (
        sliding().of(pairs=(Pair("contact", ("skin", "floor"), friction=0.2 * MILLIONTH),)),
        ("slip", "contact"),
    ),
    "normal force": (sliding().changed(force=_scaled), ("momentum", "ball")),
    "radius": (
        sliding().of(
            geometries=(Geometry("skin", "ball", "sphere", radius=0.1 * MILLIONTH), Geometry("floor", "world", "plane"))
        ),
        ("gap", "contact"),
    ),
    "a plane that tilts": (
        sliding().of(
            geometries=(
                Geometry("skin", "ball", "sphere", radius=0.1),
                Geometry("floor", "world", "plane", normal=(1e-6, 0.0, 1.0)),
            )
        ),
        ("surface", "contact"),
    ),
    "restitution": (bounce(0.5 * MILLIONTH), ("restitution", "contact")),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_of_a_millionth_is_named(name: str) -> None:
    """The first violation is the law that the fault breaks, for the part that has it."""
    record, violation = FAULTS[name]
    assert record.broken() == violation


def test_inertia_is_that_of_the_scene() -> None:
    """A driven pendulum with another moment of inertia would need another torque as it speeds up."""
    body = Body("stone", 2.0, com=(0.0, 0.0, 0.3), inertia=(0.1, 0.2, 0.25))
    record = free_body()
    wobbling = record.changed(w=lambda w: w + np.array([1e-3, 0.0, 0.0]))
    assert record.of(bodies=(replace(body, inertia=(0.1, 0.2, 0.25 * MILLIONTH)),)).broken() == ("", "")
    assert wobbling.broken()[0] == "turn"


def test_a_tilted_plane_has_another_normal() -> None:
    """The gradient of a surface is in closed form: a tilt of a millionth is four orders beyond its allowance."""
    record, _ = FAULTS["a plane that tilts"]
    assert record.residuals().largest["normal"][0] > 1e3


def test_a_contact_that_pulls_is_seen() -> None:
    """A normal force is not below zero."""
    assert "pull" in {
        law for law, (part, _, _) in sliding().changed(force=lambda f: -f).residuals().largest.items() if part > 1
    }


def test_an_impact_that_slides_has_kinetic_friction() -> None:
    """Its impulse lies within the static cone, opposes the slip that is left, and is mu P."""
    assert bounce(speed=5.0).broken() == ("", "")
    assert bounce(speed=5.0, kinetic=0.2 * MILLIONTH).broken() == ("impact cone", "contact")


@pytest.mark.parametrize("part", [MILLIONTH, 1 / MILLIONTH])
def test_newtons_law_holds_for_contacts_that_are_struck_together(part: float) -> None:
    """Each leaves with e of its speed at least, and one with no more: a ball with two skins bounces as with one."""
    assert bounce(count=2).broken() == ("", "")
    law, name = bounce(restitution=0.5 * part, count=2).broken()
    assert law == "restitution"
    assert name.startswith("contact")


def test_a_slip_that_goes_on_beyond_its_stop_is_seen() -> None:
    """A motion that ignores the reversal of friction inside a piece breaks the law of momentum, by far."""
    assert sliding(until=0.7).broken() == ("", "")
    record = sliding(until=0.8)
    assert record.broken()[0] == "momentum"
    assert record.residuals().largest["momentum"][0] > 1e6


def test_an_impact_before_its_time_is_seen() -> None:
    """A ball that rebounds a micrometre above the floor breaks the law of events."""
    record = bounce()
    early = record.changed(p=_raised)
    assert early.broken() == ("event", "contact")


def test_the_sentence_names_what_breaks_a_law() -> None:
    """A violation is a sentence about what breaks it; without one there is a clause on the laws that hold."""
    honest, fault = free_body().residuals(), free_body().changed(v=_scaled).residuals()
    assert honest.broken("the motion") == ""
    assert honest.held().startswith("holds ")
    assert fault.broken("the motion").startswith(
        'the motion breaks the law "place = integral of the velocity" for stone'
    )
    assert "please report it" in fault.broken("the motion")


def test_laws_take_no_code_of_the_routes() -> None:
    """The package imports numpy, scipy, itself and names of kinds of joints alone; data of mechanisms for types."""
    import ast
    from pathlib import Path

    import proofroll.truth.check.laws as package

    for file in Path(package.__file__).parent.glob("*.py"):
        tree = ast.parse(file.read_text(encoding="utf-8"))
        typed = {
            id(inner)
            for node in ast.walk(tree)
            if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"
            for inner in ast.walk(node)
        }
        for node in ast.walk(tree):
            if (
                isinstance(node, ast.ImportFrom)
                and id(node) not in typed
                and (node.module or "").startswith("proofroll")
            ):
                allowed = ("proofroll.truth.check.laws", "proofroll.elements.mechanism.scene.joint_kinds")
                assert (node.module or "").startswith(allowed), f"{file.name} imports {node.module}"


def test_the_check_of_an_answer_takes_what_its_method_says() -> None:
    """Beside the laws its module imports the dataset and its words for events and ends, and where contacts act."""
    import ast
    from pathlib import Path

    import proofroll.truth.check.answer as module

    tree = ast.parse(Path(str(module.__file__)).read_text(encoding="utf-8"))
    taken = {
        f"{node.module}.{alias.name}"
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("proofroll")
        for alias in node.names
        if not (node.module or "").startswith("proofroll.truth.check.laws")
    }
    assert taken == {
        "proofroll.core.arrays.FloatArray",
        "proofroll.core.columns.Columns",
        "proofroll.core.dataset.ENDS",
        "proofroll.core.events.EventKind",
        "proofroll.core.events.IMPACTS",
        "proofroll.core.events.JUMPS",
        "proofroll.core.events.events_of",
        "proofroll.elements.mechanism.dynamics.placed.Placed",
        "proofroll.elements.mechanism.dynamics.switches.with_stops_at_start",
        "proofroll.elements.mechanism.run.contacts.observables.follow_contacts",
        "proofroll.elements.mechanism.run.element.MechanismElement",
    }
