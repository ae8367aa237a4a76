"""Each place of the package that proposes a command, and the test that runs what it proposes."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest
from named_commands import proposed, unknown_words

pytestmark = pytest.mark.usefixtures("parsed_sources")

TESTS = Path(__file__).parents[1]
# A command that names a thing by a placeholder, or that is prose: its words are commands and options of today.
WORDS = "test_words_of_each_line_are_of_today"
# Where proofroll proposes a command -> the test that runs it, once for each place in the file.
RUN_BY = {
    "cli/command_groups.py: proofroll recommend SCENE --plot FILE.svg": [WORDS],
    "cli/command_groups.py: proofroll run SCENE --engine NAME --plot FILE, and of a stored run": [WORDS],
    "cli/command_groups.py: proofroll replay RUN": [WORDS],
    "cli/command_groups.py: proofroll replay [NAME]..., of runs that": [WORDS],
    "cli/command_groups.py: proofroll run --keep NAME keeps": [WORDS],
    "cli/command_groups.py: proofroll diff ENGINE@OLD ENGINE@NEW [SCENE]...": [WORDS],
    "cli/command_groups.py: proofroll paper onset": [WORDS],
    "cli/command_groups.py: proofroll paper regimes": [WORDS],
    "cli/command_groups.py: proofroll paper figures": [WORDS],
    "cli/command_groups.py: proofroll check --keys [WORD]": [WORDS],
    "cli/comparing.py: proofroll new comparison writes a file with one": [WORDS],
    "cli/engines.py: proofroll engines --capabilities starts each, and shows what it can represent.": [WORDS],
    "cli/engines.py: proofroll check says it requires.": [WORDS],
    "cli/judge.py: proofroll judge FILE SCENE": [WORDS],
    "cli/judge.py: proofroll judge FILE --scene SCENE": [WORDS],
    "cli/judge.py: proofroll judge": ["test_a_mapping_of_a_run_is_judged_with_its_scene"],
    "cli/lists.py: proofroll scenes NAME lists the parameters of one.": [WORDS],
    "cli/new.py: proofroll judge": ["test_the_lines_of_a_probe_judge_its_record"],
    "cli/new.py: proofroll check {}": ["test_what_is_written_anew_can_be_used_as_proposed"] * 2,
    "cli/new.py: proofroll run {} --engine truth": ["test_what_is_written_anew_can_be_used_as_proposed"],
    "cli/new.py: proofroll compare {}": ["test_what_is_written_anew_can_be_used_as_proposed"],
    "cli/new.py: proofroll check --keys WORD": [WORDS],
    "cli/written_files.py: proofroll run --out or of a report, or names of run --keep": [WORDS],
    "cli/report.py: proofroll report": ["test_lines_of_a_page"],
    "cli/run.py: proofroll compare": ["test_a_run_is_compared_as_it_was"],
    "cli/run.py: proofroll replay lists and shows what is kept.": [WORDS],
    "cli/templates/engine/README.md: proofroll run double_pendulum --engine @name@": [WORDS],
    "cli/templates/engine/README.md: proofroll compare my_claim.toml": [WORDS],
    "cli/templates/engine/README.md: proofroll new comparison my_claim --scene double_pendulum": [WORDS],
    "cli/templates/scene.toml: proofroll check --keys WORD": [WORDS],
    "cli/diff.py: proofroll engines add {} --requirement {}=={}": [WORDS],
    "cli/diff.py: proofroll engines": [WORDS],
    "cli/watch.py: proofroll engines tells what is installed": [WORDS],
    "engines/mujoco/own_lines.py: proofroll export writes it": [WORDS],
    "files/comparison_file.py: proofroll report": ["test_a_study_that_is_no_comparison_names_its_command"],
    "files/kept_runs.py: proofroll run … --keep NAME keeps one.": [WORDS],
    "files/scene_file.py: proofroll new scene writes one": [WORDS],
    "pytest_plugin.py: proofroll fuzz {} next": [WORDS],
    "report/answer/sentences.py: proofroll compare": ["test_lines_of_a_page"],
    "report/answer/sentences.py: proofroll recommend": [
        "test_lines_of_a_page",
        "test_lines_for_a_model_hold_all_tolerances",
    ],
    "report/changes.py: proofroll report writes one": [WORDS] * 2,
    "report/page/first_screen.py: proofroll recommend SCENE searches longer.": [WORDS],
    "report/page/html.py: proofroll run": ["test_lines_of_a_page"],
    "report/page/records.py: proofroll report {} one": [WORDS],
    "report/page/records.py: proofroll report --budget 3600 runs all, each briefly first": [WORDS],
    "report/parts.py: proofroll self.command.split()": ["test_a_map_of_ones_own_is_made_by_its_command"],
    "report/run/plot.py: proofroll run … --out writes a file that has": [WORDS],
    "report/run/plot.py: proofroll replay lists these": [WORDS],
    "report/run/plot.py: proofroll run … --out writes one": [WORDS],
    "report/run/replay.py: proofroll run … --out writes one": [WORDS],
    "report/templates/page.html: proofroll compare SCENE --engine 'mujoco[dt=2e-3]' --tolerance '1 mm'": [WORDS],
    "report/templates/page.html: proofroll findings": [WORDS],
    "report/templates/page.html: proofroll replay": [WORDS],
    "report/templates/parts.html: proofroll compare {}": ["test_a_comparison_that_is_cut_names_its_file"],
    "report/templates/parts.html: proofroll report {}": ["test_a_comparison_that_is_cut_names_its_file"],
    "report/terminal/tables.py: proofroll compare NAME": [WORDS],
    "report/terminal/verdicts.py: proofroll new comparison).": [WORDS],
    "robots/command.py: proofroll run FILE --engine truth --set …": [WORDS],
    "robots/command.py: proofroll compare SCENE --engine NAME": [WORDS],
    "running/interpreters.py: proofroll engines add {} --requirement PACKAGE==VERSION makes one that has all": [WORDS],
    "running/interpreters.py: proofroll engines remove {}@{}, and add it again": [WORDS],
    "running/make_environment.py: proofroll engines add {} --requirement {}==VERSION": [WORDS],
    "running/make_environment.py: proofroll engines remove {}@{} first": [WORDS],
    "studies/comparison/planning.py: proofroll new comparison writes a file with others": [WORDS],
    "studies/versions/two_runs.py: proofroll run SCENE --out FILE.nc writes one that does": [WORDS],
    "vocabulary/document.py: proofroll check --keys WORD": [WORDS],
    "vocabulary/document.py: proofroll check NAME": [WORDS],
}


def test_every_line_has_its_test() -> None:
    """A command that is proposed somewhere new is in the list, with a test that is there; none in it is gone."""
    assert Counter(proposed()) == Counter({line: len(tests) for line, tests in RUN_BY.items()})
    files = (TESTS / name for name in ("unit/test_proposed.py", "test_proposed_lines.py", "report/test_whole.py"))
    written = "".join(path.read_text(encoding="utf-8") for path in files)
    named = {test for tests in RUN_BY.values() for test in tests}
    assert {test for test in named if f"def {test}(" not in written} == set()


def test_words_of_each_line_are_of_today() -> None:
    """Each command that any line has is one, with the options behind it; what is none is seen."""
    lines = [line.replace("proofroll ", "`proofroll ") for line in proposed() if "self." not in line]
    assert [word for line in lines for word in unknown_words(line)] == []
    assert unknown_words("`proofroll robots`, `proofroll recommend SCENE --best`") == ["robots", "recommend --best"]
