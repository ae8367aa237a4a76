"""Writes docs/gallery: every scene with picture, claim, truth and verdicts, from real runs: ``make gallery``.

Each scene has a page; docs/gallery.md shows their pictures by kind. Pages of the scenes that are named are made;
without names those that are lacking, and those whose comparison, scene, settings or pinned libraries have changed.
"""

from __future__ import annotations

import dataclasses
import json
import re
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path

from made_from import facts, stamp
from markdown_tables import caveat_list, choice_table, remark_list, verdict_table

from proofroll.core.comparison import Comparison
from proofroll.core.number_format import number
from proofroll.core.verdict import Verdict
from proofroll.files.comparison_file import load_comparison
from proofroll.files.data_folders import data_folder
from proofroll.files.scene_file import read_scene_file, scene_names
from proofroll.files.toml import study_of
from proofroll.report.comparison.lines import lines_of
from proofroll.report.comparison.records import ReportedComparison
from proofroll.report.comparison.spread import ALONE
from proofroll.report.comparison.summary import outcome_content
from proofroll.report.labels import engine_title, engine_words
from proofroll.report.long_table import TableLine
from proofroll.report.page.html import templates
from proofroll.report.page.scene_sheet import scene_sheet
from proofroll.running.idle_workers import Workers
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll.studies.comparison.compare import compare
from proofroll.studies.comparison.outcome import Outcome

DOCS = Path(__file__).resolve().parent
PICTURES = DOCS / "gallery"
# A picture stands alone on white; in a report the page's own style sheet says the same.
STYLE = """<style>path,circle{fill:none;stroke:#1b1f24;stroke-width:1.2;stroke-linejoin:round;stroke-linecap:round}
.faint{stroke:#5b6570;stroke-width:.7;stroke-dasharray:2 3}.hidden{stroke:#5b6570;stroke-width:.9;stroke-dasharray:4 3}
.axis{stroke:#5b6570;stroke-width:.9;stroke-dasharray:9 3 2 3}.wall{fill:#eceef1}.ball{fill:#d5dae0}
.motion{stroke:#1a6f5f;stroke-width:1.6}.force{stroke:#9c3a1e;stroke-width:1.8}[class$=head]{stroke:none;fill:#1b1f24}
.motion-head,.motion-letter{fill:#1a6f5f}.force-head,.force-letter{fill:#9c3a1e}
text{font:italic 15px Georgia,serif;fill:#1b1f24}.sub{font-size:10.5px;font-style:normal}</style>"""
HEAD = """# Gallery of scenes

Scenes with what they ask, what is true of them, and what each engine makes of them. Written by `make gallery`
from real runs of the comparisons, with the values that a brief report has; do not edit it. Errors are the largest over
all points of the parameters; what the words mean: [read a verdict](read_a_verdict.md). Which step to take
for a tolerance says [an answer](answers.md).

```{include} gallery/matrix.inc
```

```{toctree}
:hidden:
:glob:

gallery/*
```

Under each picture are the engines that hold the motion to 1e-4 of the path.
"""
# Heading of scenes without a comparison.
UNCOMPARED = "without a comparison"
# Part of the path that the matrix asks for.
TOLERANCE = 1e-4
# From the best to the worst; a formulation is refused only if each of its settings is.
BEST_FIRST = [*(item for item in Verdict if item is not Verdict.REFUSED), Verdict.REFUSED]
# Line of a page with the hash of all that decides it.
MADE = "<!-- made from {} -->\n"
# Line of a page that the matrix is made from: what each formulation is at that tolerance, by group of scenes.
KEPT = re.compile(r"^<!-- at 1e-4: (.*) -->$", flags=re.MULTILINE)


def comparisons() -> dict[str, tuple[str, Comparison]]:
    """The first comparison of each scene that has one, with its path's name; nothing is timed here."""
    folder = data_folder("comparisons")
    files = [path for path in sorted(folder.rglob("*.toml")) if study_of(path) is None]
    named = [(str(path.relative_to(folder).with_suffix("")), load_comparison(str(path))) for path in files]
    found: dict[str, tuple[str, Comparison]] = {}
    for name, comparison in sorted(named, key=lambda item: item[1].order):
        found.setdefault(comparison.scene, (name, dataclasses.replace(comparison.briefly(), timed=False)))
    return found


def failures(content: ReportedComparison) -> str:
    """Why rows have no result, a line each."""
    return "".join(
        f"- {engine_words(row.name, row.formulation)} {row.setting} {row.verdict}, {row.reason}.\n"
        for row in content.rows
        if row.verdict in {Verdict.REFUSED, Verdict.FAILED}
    )


def picture(scene: str) -> str:
    """Draws the scene into a file; its line of Markdown, empty where there is no drawing."""
    text, label = drawn_scene(scene, scene)
    if not text:
        return ""
    (PICTURES / f"{scene}.svg").write_text(text, encoding="utf-8")
    return f"```{{image}} {scene}.svg\n:alt: {scene}, {label}\n```\n"


def drawn_scene(scene: str, name: str) -> tuple[str, str]:
    """A scene as SVG that stands alone, and what it shows; both empty where there is no drawing."""
    drawings = scene_sheet(scene, []).drawings
    if not drawings:
        return "", ""
    markup = str(templates().get_template("scene.html").module.picture(drawings[0], name))  # type: ignore[attr-defined]
    width, height = drawings[0].box[2:]
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:g}" height="{height:g}"'
    lines = [line for line in markup.splitlines() if line.strip()]
    text = "\n".join(lines).replace("<svg", head, 1).replace(">", f">\n{STYLE}", 1)
    return text + "\n", drawings[0].label


def truth(outcome: Outcome, laws_alone: bool) -> str:
    """By which routes the truth was found, and how well it is known at the first point, if the motion is unique."""
    point = next(iter(outcome.points.values()))
    result = point.result
    if point.reference is None:
        return f"There is none: {result.message}."
    dataset, name = point.reference.dataset, point.scene.deciding
    if laws_alone:
        return f"{result.message}. So engines are {ALONE}."
    said = f"{result.message}."
    if name in dataset and "error_bar" in dataset[name].attrs:
        bar, unit = dataset[name].attrs["error_bar"], dataset[name].attrs["units"]
        said += f" Error bar of {name}: {number(float(bar))} {unit}."
    return said


def standings(outcome: Outcome) -> str:
    """What each formulation is at the tolerance of the matrix, as a line that no reader sees."""
    order, content = BEST_FIRST, outcome_content(outcome)
    held = {(run[0].engine, run[0].formulation) for run in runs_of(lines_of(outcome)) if holds(run)}
    found: dict[str, Verdict] = {}
    for row in content.rows:
        name = f"{row.name} {row.formulation or ''}".strip()
        at_best = Verdict.CONVERGES if row.verdict is Verdict.AGREES else row.verdict
        verdict = Verdict.AGREES if (row.name, row.formulation or "") in held else at_best
        found[name] = min(found.get(name, verdict), verdict, key=order.index)
    return f"<!-- at 1e-4: {json.dumps({content.group: found})} -->\n"


def runs_of(lines: Iterable[TableLine]) -> list[list[TableLine]]:
    """Lines of each setting with each of its steps, over all points."""
    runs: dict[tuple[int, float | None], list[TableLine]] = {}
    for line in lines:
        runs.setdefault((line.row, line.step), []).append(line)
    return list(runs.values())


def holds(run: list[TableLine]) -> bool:
    """True if the motion that summaries show is within the tolerance of the matrix at every point."""
    motion = [line for line in run if line.role == "motion" and line.headline and line.scale]
    return bool(motion) and all(line.relative <= TOLERANCE for line in motion)


def standings_by_group(page: str) -> dict[str, dict[str, str]]:
    """Group of a scene -> what each formulation is at the tolerance of the matrix, from its page."""
    kept = KEPT.search(page)
    return json.loads(kept[1]) if kept else {}


def write_matrix(pages: Iterable[str]) -> None:
    """Writes the matrix of the gallery's pages, which the first page of the documentation shows, too."""
    groups: dict[str, dict[str, list[str]]] = {}
    for page in pages:
        for group, rows in standings_by_group(page).items():
            for row, state in rows.items():
                groups.setdefault(group, {}).setdefault(row, []).append(state)
    (PICTURES / "matrix.inc").write_text(choice_table(groups), encoding="utf-8")


def grid(pages: Mapping[str, str]) -> str:
    """Pictures of the scenes by kind, each with the engines that hold it, as links to their pages."""
    groups: dict[str, list[str]] = {}
    for scene, page in pages.items():
        group, rows = next(iter(standings_by_group(page).items()), (UNCOMPARED, {}))
        engines = {row.partition(" ")[0] for row, state in rows.items() if state == Verdict.AGREES}
        holding = ", ".join(
            engine_title(name) for name in dict.fromkeys(row.partition(" ")[0] for row in rows) if name in engines
        )
        image = f"[![{scene}](gallery/{scene}.svg)](gallery/{scene}.md)\n\n" if f"{scene}.svg" in page else ""
        words = f"✓ {holding}" if holding else "held by none" if rows else ""
        card = f":::{{container}} scene\n{image}[{scene}](gallery/{scene}.md)  \n{words}\n:::\n"
        groups.setdefault(group, []).append(card)
    parts = [f"## {group}\n\n::::{{container}} scenes\n{''.join(cards)}::::\n" for group, cards in groups.items()]
    return "\n".join(parts)


def section(scene: str, comparison: Comparison | None, runner: Runner) -> str:
    """Page of one scene."""
    file = read_scene_file(scene)
    parts = [f"# {scene}\n\n{file.title}. *{file.source}.*\n", picture(scene)]
    if comparison is None:
        parts.append("No comparison of it comes with proofroll.\n")
        return "\n".join(parts)
    outcome = compare(comparison, runner)
    content = outcome_content(outcome)
    path = f"comparisons: {comparison.name}"
    parts.append(standings(outcome))
    said = truth(outcome, content.laws_alone)
    parts += [f"**Asked** ({path}): {comparison.question}\n", f"**True**: {said}\n"]
    # Without costs, which are measured in turns where that is asked.
    table = "".join(line.rstrip("\n").rsplit("|", 2)[0] + "|\n" for line in verdict_table(content).splitlines())
    parts += [table, failures(content) + caveat_list(content) + remark_list(content)]
    return "\n".join(part for part in parts if part)


def pages() -> dict[str, str]:
    """Pages of the gallery by scene."""
    return {page.stem: page.read_text(encoding="utf-8") for page in sorted(PICTURES.glob("*.md"))}


def stale(
    kept: dict[str, str], known: dict[str, tuple[str, Comparison]], workers: Workers | None = None
) -> dict[str, str]:
    """Scenes whose page is lacking or made from something else, each with the line that a new page ends with."""
    made = {}
    for scene in scene_names():
        name = known[scene][0] if scene in known else ""
        made[scene] = MADE.format(stamp(name, facts(name, workers))) if name else ""
    return {scene: line for scene, line in made.items() if scene not in kept or line not in kept[scene]}


def main(names: list[str]) -> None:
    """Writes all pages; those that are asked for, or out of date, are made anew."""
    PICTURES.mkdir(exist_ok=True)
    runner = Runner(Store(DOCS.parent / "out" / "cases"))
    known, kept = comparisons(), pages()
    fresh = {scene: text for scene, text in kept.items() if scene not in names}
    for scene, made in stale(fresh, known, runner.workers).items():
        if names and scene not in names:
            continue
        kept[scene] = section(scene, known.get(scene, ("", None))[1], runner) + made
        (PICTURES / f"{scene}.md").write_text(kept[scene], encoding="utf-8")
        sys.stderr.write(f"{scene}\n")
    ordered = {name: kept[name] for name in scene_names() if name in kept}
    write_matrix(ordered.values())
    (DOCS / "gallery.md").write_text(f"{HEAD}\n{grid(ordered)}", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
