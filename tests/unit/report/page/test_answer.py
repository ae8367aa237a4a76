"""The answer that chips, cards, tables, the terminal and ``recommend`` have in common."""

from __future__ import annotations

from dataclasses import replace

import pytest
from table_lines import ARM, FORCE, LINE, line

from proofroll.report.page.answer import ReaderQuestion, answer, listed
from proofroll.report.page.choice_matrix import ChoiceStudy, choice_matrix
from proofroll.report.page.profile import profile
from proofroll.report.terminal.answers import answers, engine_lines, kind_sentences, scene_lines

STUDIES = {name: ChoiceStudy(f"A {name}", f"c{number}") for number, name in enumerate(("arm", "chain", "ball"))}
BETA = line(engine="beta", row=3, error=1e-9, cost=0.5)
OWN = line(engine="gamma", row=4, error=1e-12, cost=1e-6, own_equations=True)
BALL = line(study="ball", scene="ball", group="ball rolling", error=0.1)
NAMES = {"alpha": "Alpha"}


def test_the_cheapest_engine_of_each_kind_is_told_and_a_witness_never_is() -> None:
    """Engines by the number of kinds, then kinds that nothing holds; the words of the tolerance are a length."""
    found = answer(choice_matrix([*ARM, BETA, OWN, BALL], STUDIES, NAMES), 1e-3, False)
    assert found.sentence == (
        "The cheapest that holds 1 mm per metre of the true path: Alpha for trees; No engine for rolling balls."
    )
    assert [item.engine for item in found.kinds[0].standings] == ["alpha", "beta"]
    assert answer(choice_matrix([*ARM, BETA, BALL], STUDIES), 1e-8, False).chips[0].title == "beta"
    assert answer(choice_matrix([*ARM, BETA], STUDIES), 1e-3, False, {"beta"}).chips[0].title == "beta"
    assert "and forces within 1e-3 of the largest" in ReaderQuestion(1e-3, True).words
    assert "2e-3 of the path" in ReaderQuestion(2e-3, False).words


def test_the_most_accurate_and_the_worst_default_are_told_of_engines_alone() -> None:
    """Least error without luck of all settings and steps, largest of defaults at their own step; witnesses are none."""
    rough = line(engine="beta", row=3, error=0.2, cost=0.5)
    found = answer(choice_matrix([*ARM, rough, OWN], STUDIES, NAMES), 1e-3, False).scenes[0]
    assert found.most_accurate == (pytest.approx(2e-7, rel=1e-3), "Alpha joints, tuned")
    assert found.worst_default == (pytest.approx(0.2), "beta joints, default")
    alone = answer(choice_matrix([*ARM, rough, OWN], STUDIES, NAMES), 1e-3, False, {"alpha"}).scenes[0]
    assert alone.worst_default == (pytest.approx(5e-4), "Alpha joints, default"), "not at a finer step"
    both = answer(choice_matrix([*ARM, rough], STUDIES, NAMES), 1e-3, True).scenes[0]
    assert both.most_accurate == (pytest.approx(1e-6, rel=1e-3), "Alpha joints, tuned"), "beta reports no forces"
    assert answer(choice_matrix([OWN], STUDIES), 1e-3, False).scenes[0].most_accurate is None


def test_a_tie_is_told_of_rough_costs_alone() -> None:
    """Costs known to a factor of two that are nearer than that tie; clean ones do not."""
    dear = choice_matrix([line(error=1e-9, cost=0.2), replace(BETA, cost=23.0)], STUDIES)
    assert answer(dear, 1e-4, False).kinds[0].next_words == "beta joints, 120× the cost, lead open"
    for clean, words in ((False, "beta joints, a tie"), (True, "beta joints, 1.5× the cost, lead open")):
        lines = [line(error=1e-9, cost=0.2, clean=clean), replace(BETA, cost=0.3, clean=clean)]
        matrix = choice_matrix(lines, STUDIES)
        item = answer(matrix, 1e-4, False).kinds[0]
        assert item.next_words == words
        assert [tied.engine for tied in item.tied] == ([] if clean else ["beta"])


def test_a_tie_is_told_in_the_chip_in_a_fixed_order() -> None:
    """Whichever of two engines with rough costs came out cheaper, the chip names both, by name."""
    for cheap, dear in ((0.2, 0.3), (0.3, 0.2)):
        lines = [line(error=1e-9, cost=cheap, clean=False), replace(BETA, cost=dear, clean=False)]
        chips = answer(choice_matrix(lines, STUDIES, NAMES), 1e-4, False).chips
        assert [(chip.engines, chip.title) for chip in chips] == [(("alpha", "beta"), "Alpha or beta")]


def test_where_nothing_holds_it_the_closest_is_told() -> None:
    """By what it is off."""
    item = answer(choice_matrix([BALL], STUDIES), 1e-3, False).kinds[0]
    assert item.closest_words.startswith("none; closest alpha joints: off by 0.1")


def test_scenes_that_the_engine_to_take_does_not_hold_name_their_own() -> None:
    """Another engine with its speed, or what comes closest; the chip has the number of scenes that are held."""
    wrong = replace(LINE, study="chain", scene="chain", error=0.5)
    item = answer(choice_matrix([LINE, wrong], STUDIES), 1e-3, False)
    assert item.kinds[0].exceptions == ["chain: none; closest alpha joints: off by 0.5, finer steps come closer"]
    assert [(chip.title, chip.words) for chip in item.chips] == [("alpha", "for 1 of 2 scenes of trees")]
    other = line(engine="beta", row=3, study="chain", scene="chain", error=1e-9, cost=0.5)
    item = answer(choice_matrix([LINE, wrong, other], STUDIES), 1e-3, False)
    assert item.kinds[0].exceptions == ["chain: beta joints, ≥ 2×"]
    assert item.kinds[0].next_words == "beta joints"
    dear = replace(LINE, study="chain", scene="chain", cost=5.0)
    item = answer(choice_matrix([LINE, dear, other], STUDIES), 1e-3, False)
    assert item.kinds[0].exceptions == ["chain: beta joints, ≥ 2×"], "a tenth of the cost"


def test_forces_are_told_where_they_change_the_choice() -> None:
    """The same, another setting, none, or not judged."""
    for lines, words in (
        ([LINE, replace(FORCE, error=1e-9)], "✓ the same choice"),
        ([LINE, FORCE], "✗ none"),
        ([LINE], "not judged"),
    ):
        matrix = choice_matrix(lines, STUDIES)
        assert answer(matrix, 1e-3, False).kinds[0].forces_words == words


def test_a_kind_is_held_with_one_setting_or_with_one_by_scene() -> None:
    """Of scenes that need different presets two are named, more are not, and forces that change one are told."""
    chain = replace(LINE, study="chain", scene="chain")
    tuned = replace(chain, row=9, preset="tuned", setting="tuned", cost=2 * LINE.cost)
    third = replace(tuned, study="ball", scene="ball", row=10, preset="matched", setting="matched")
    for others, words in (
        ([chain], "joints, default"),
        ([tuned], "joints, default or tuned"),
        ([tuned, third], "joints, settings vary"),
    ):
        taken = answer(choice_matrix([LINE, *others], STUDIES), 1e-3, False).kinds[0].taken
        assert taken is not None
        assert taken.held_with == words
    forces = [replace(FORCE, error=1e-9), replace(FORCE, study="chain", scene="chain", error=0.5)]
    forces.append(replace(forces[1], row=9, preset="tuned", setting="tuned", cost=tuned.cost, error=1e-9))
    matrix = choice_matrix([LINE, chain, tuned, *forces], STUDIES)
    assert answer(matrix, 1e-3, False).kinds[0].forces_words == "alpha joints, ≥ 50–100×"


def test_what_fails_is_told_in_the_words_of_its_comparison() -> None:
    """One reason for a formulation, the gravest first; none of what holds the tolerance, or of a refusal elsewhere."""
    wrong = line(engine="delta", row=5, error=0.5, limit="another limit", verdict="differs", preset="default")
    refused = line(engine="eta", row=6, status="refused", verdict="refused")
    short = {0: (["differs"], "it is soft"), 5: (["differs"], "it falls"), 6: (["differs"], "it hops elsewhere")}
    matrix = choice_matrix([LINE, wrong, refused], STUDIES | {"arm": STUDIES["arm"]._replace(short=short)})
    told = answer(matrix, 1e-6, False).kinds[0].failures
    assert [(item.name, item.why) for item in told] == [
        ("delta joints, default", "it falls"), ("alpha joints, default", "it is soft"),
    ]  # fmt: skip
    assert [item.why for item in answer(matrix, 1e-2, False).kinds[0].failures] == ["it falls"]


def test_what_another_setting_mends_is_told_of_defaults_alone() -> None:
    """Of a formulation that holds the tolerance with one setting the failing default is told, and no other setting."""
    settings = [
        line(error=error, row=row, preset=preset, setting=preset, limit="another limit")
        for row, (preset, error) in enumerate({"default": 0.5, "matched": 0.4, "tuned": 1e-9}.items())
    ]
    short = {row: (["differs"], f"reason {row}") for row in range(2)}
    studies = STUDIES | {"arm": STUDIES["arm"]._replace(short=short)}
    for chosen, told in (
        (settings, ["! alpha joints, default"]),
        (settings[1:], []),
        (settings[1:2], [" alpha joints, matched"]),
    ):
        found = answer(choice_matrix(chosen, studies), 1e-4, False).kinds[0].failures
        assert [f"{item.text} {item.name}" for item in found] == told


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["trees"], "trees"),
        (["rolling balls", "slipping balls"], "rolling and slipping balls"),
        (["closed loops", "rolling balls", "slipping balls"], "rolling and slipping balls and closed loops"),
        (["closed loops", "trees", "contact"], "closed loops, trees and contact"),
    ],
)
def test_kinds_are_listed_as_in_a_sentence(words: list[str], text: str) -> None:
    """What ends alike is told once."""
    assert listed(words) == text


def test_the_terminal_shows_the_same_answer() -> None:
    """A sentence for each kind, a line for each scene with speed, setting and step, and what is tied or open."""
    columns = answers(choice_matrix([*ARM, BETA, BALL], STUDIES, NAMES), 1e-3, forces=False)
    assert kind_sentences(columns) == [
        "Alpha for trees (≥ 100×).",
        "Rolling balls: none; closest Alpha joints: off by 0.1, finer steps come closer.",
    ]
    assert [" ".join(line.split()) for line in scene_lines(columns)] == [
        "scene × real time take",
        "arm ≥ 100× Alpha joints, default, dt 1e-3 s",
        "ball – none; closest Alpha joints: off by 0.1, finer steps come closer",
        "",
        "Lead open in 1: a rival that holds it ran no coarser step.",
    ]


def test_the_terminal_shows_engines_of_a_kind() -> None:
    """Of a kind of several scenes each engine has its share of them, speeds, relative cost, and what it misses."""
    chain = replace(LINE, study="chain", scene="chain", error=1e-9, cost=0.1)
    lines = [*ARM, BETA, chain, replace(BETA, study="chain", scene="chain", error=0.2)]
    columns = answers(choice_matrix(lines, STUDIES, NAMES), 1e-3, forces=False)
    assert kind_sentences(columns)[0] == "Alpha for 2 of 2 trees (≥ 10–100×)."
    assert [" ".join(line.split()) for line in engine_lines(columns[0])][1:] == [
        "Alpha 2 of 2 ≥ 10–100× the cheapest",
        "beta 1 of 2 ≥ 2× 50 times; off by 0.2 in chain",
    ]


def test_the_profile_counts_the_scenes_of_each_engine() -> None:
    """Scenes held within a ratio of the cheapest engine's cost; a witness has a line and is no rival."""
    matrix = choice_matrix([*ARM, BETA, OWN, BALL], STUDIES)
    found = profile(matrix, answer(matrix, 1e-3, False))
    assert found.scenes == 2
    assert {item.engine: (item.within(1), len(item.ratios)) for item in found.rivals} == {
        "alpha": (1, 1),
        "beta": (0, 1),
    }
    assert [item.engine for item in found.lines if item.witness] == ["gamma"]
