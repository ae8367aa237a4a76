"""What of a setting is not the engine's own is said wherever the engine is judged or recommended by it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest
from invented import stability_study

from proofroll.core.engine_abilities import TellsCaveats
from proofroll.core.first_steps import certificate
from proofroll.core.plugins import engine_names, load_engine
from proofroll.core.verdict import Verdict
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.files.scene_file import load_scene
from proofroll.report.comparison.closing import closing_notes
from proofroll.report.labels import family_and_caveat, with_caveat
from proofroll.report.stability.tables import silent_lines
from proofroll.running.case import EngineFacts
from proofroll.running.engine_questions import resolve

CONTACT = MechanismCapability.CONTACT
OURS = "integrated by proofroll"


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("engine", "words"),
    [
        ("pinocchio[formulation=composite,preset=default]", OURS),
        ("pinocchio[formulation=impulses,preset=matched]", "integrated by proofroll around its contact solver"),
        ("exudyn[formulation=carrier,preset=default]", "adaptive step"),
        ("exudyn[formulation=carrier,preset=matched]", ""),
        ("exudyn[formulation=spheres,preset=matched]", "proofroll's own contact forces at the start"),
        ("exudyn[formulation=spheres,preset=default]", "own contact forces at the start"),
        ("mujoco[formulation=chart,preset=default]", ""),
    ],
)
def test_an_engine_says_what_is_not_its_own(engine: str, words: str) -> None:
    """Where proofroll integrates, or where what is on by default is off, the settings say so; elsewhere nothing."""
    name, _, options = engine.rstrip("]").partition("[")
    (facts,) = resolve([(name, dict(option.split("=") for option in options.split(",")))])
    assert isinstance(facts, EngineFacts)
    assert words in facts.caveat
    assert bool(facts.caveat) == bool(words)


def test_a_caveat_is_one_clause() -> None:
    """Whatever engine tells one, it fits into a sentence: one line without a full stop."""
    told = 0
    for name in engine_names():
        kind = load_engine(name)
        for settings in (item for presets in kind.presets.values() for item in presets.values()):
            if isinstance(kind, TellsCaveats):
                said = kind.caveat(settings)
                told += bool(said)
                assert "\n" not in said
                assert not said.endswith(".")
    assert told


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("engine", "need", "words"),
    [
        (
            "mujoco[formulation=geoms,preset=default]",
            CONTACT,
            "contact by a pyramid of friction, time constant = 0.02 s",
        ),
        ("mujoco[formulation=geoms,preset=matched]", CONTACT, "contact by a convex cone, where sliding contacts open"),
        ("mujoco[formulation=geoms,preset=tuned]", CONTACT, "hard contact by Coulomb's law"),
        ("pinocchio[formulation=impulses,preset=tuned]", CONTACT, "hard contact by Coulomb's law"),
        (
            "pinocchio[formulation=impulses,convex=true]",
            CONTACT,
            "contact by a convex cone, where sliding contacts open",
        ),
        ("projection[formulation=dependent]", CONTACT, "hard contact by Coulomb's law"),
        ("exudyn[formulation=spheres]", CONTACT, "softened contact, k = 1e+06 N/m, v_reg = 0.0001 m/s"),
        ("mujoco[formulation=joints]", CONTACT, ""),
        ("projection[formulation=dependent]", "revolute joints", ""),
        ("mujoco[formulation=chart,preset=matched]", "rolling without slip", ""),
    ],
)
def test_an_engine_says_which_law_of_contact_it_has(engine: str, need: str, words: str) -> None:
    """The family of a row's law is in its facts, with what softens it, where a scene asks for such a law."""
    name, _, options = engine.rstrip("]").partition("[")
    (facts,) = resolve([(name, dict(option.split("=") for option in options.split(",")))])
    assert isinstance(facts, EngineFacts)
    assert facts.on({need}).family == words


def test_formulations_of_contact_say_which_law_they_have() -> None:
    """No formulation that holds bodies which touch is silent about its law, in any preset."""
    for name in engine_names():
        kind = load_engine(name)
        for formulation, provided in kind.provides.items():
            if CONTACT in provided:
                presets = kind.presets[formulation].values()
                assert all(kind.family(settings)[CONTACT] for settings in presets), (name, formulation)


@pytest.mark.parametrize(
    ("engine", "formulation", "preset", "scene", "words"),
    [
        ("mujoco", "geoms", "matched", "sled", ["contact by a convex cone, where sliding contacts open"]),
        ("mujoco", "geoms", "matched", "slide_to_roll", ["contact by a convex cone, where sliding contacts open"]),
        ("projection", "dependent", "default", "slide_to_roll", ["hard contact by Coulomb's law"]),
        ("mujoco", "joints", "default", "pendulum", []),
    ],
)
def test_a_certificate_names_the_law_of_contact(
    engine: str, formulation: str, preset: str, scene: str, words: list[str]
) -> None:
    """Bodies that touch have a line on their law of contact; where none is asked for is none."""
    kind = load_engine(engine)
    settings, loaded = kind.presets[formulation][preset], load_scene(scene)
    told = [line.quantity for line in certificate(kind, kind.build(loaded, settings), loaded, settings)]
    assert [text for text in told if "law of contact" in text] == [f"law of contact: {law}" for law in words]


def test_a_recommendation_says_which_law_a_choice_has() -> None:
    """Family and caveat of a measured point are one clause beside it."""
    point: Any = SimpleNamespace(family="hard contact", caveat="somebody else's steps")
    assert family_and_caveat(point) == "hard contact; somebody else's steps"
    assert family_and_caveat(SimpleNamespace(family="", caveat="")) == ""


def test_notes_close_a_comparison_in_four_lines() -> None:
    """Schemes, caveats, equations of the truth and contact laws are a line each; an engine with all its rows is one."""
    common = {"verdict": Verdict.AGREES, "resolution": "dt", "resolution_value": 1e-3, "scheme": "Euler"}
    words = {"caveat": "", "family": "soft contact", "shared": "", "formulation": "free", "setting": "default"}
    row = SimpleNamespace(
        name="machine", observables={"z": SimpleNamespace(largest=1.0, truth_error_bar=0.0)}, **common, **words
    )
    rows: list[Any] = [
        row,
        replace_all(row, name="tool", shared="same equations as the first route"),
        replace_all(row, setting="matched", family="hard contact", caveat="integrated by others", scheme=""),
        replace_all(row, setting="tuned", verdict=Verdict.REFUSED, observables={}, scheme=""),
    ]
    assert closing_notes(SimpleNamespace(rows=rows)) == [
        "Same integration scheme (agreement is not independent evidence): machine free default, tool: Euler.",
        "Caveats: machine free matched: integrated by others.",
        "Equations of the truth: tool: same equations as the first route.",
        "Contact law: machine free default, tool: soft contact; machine free matched: hard contact.",
    ]


def replace_all(row: Any, **changes: Any) -> Any:
    """A copy of a row with these changes."""
    return SimpleNamespace(**{**vars(row), **changes})


def test_a_caveat_stands_beside_a_name_that_is_blamed() -> None:
    """A caveat is in brackets behind the name that it belongs to."""
    assert with_caveat("machine free", "somebody else's steps") == "machine free (somebody else's steps)"
    assert with_caveat("machine free", "") == "machine free"


def test_silent_failures_carry_the_caveat() -> None:
    """The line that blames a setting says what of it is not the engine's own."""
    mapped = stability_study()
    mapped = replace(mapped, points=[replace(point, caveat="somebody else's steps") for point in mapped.points])
    (blamed,) = silent_lines(mapped)
    assert "somebody else's steps" in blamed
