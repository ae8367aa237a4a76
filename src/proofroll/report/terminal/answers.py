"""Answers of a report's runs on the terminal: a sentence, a line for each scene, and one for each engine."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from proofroll.core.number_format import number
from proofroll.files.scene_file import is_scene, read_scene_file
from proofroll.report.labels import SYMBOLS, engine_words
from proofroll.report.page.answer import ColumnAnswer, answer, speed_range, told
from proofroll.report.page.choice_cell import CANNOT, NO_RUN, ChoiceCell
from proofroll.report.page.choice_matrix import ChoiceMatrix
from proofroll.report.terminal.screen import WIDTH

_SPEED = 11


def answers(matrix: ChoiceMatrix, tolerance: float, forces: bool) -> list[ColumnAnswer]:
    """Answer for each column of a matrix; where forces are asked for and not judged, for the motion alone."""
    columns = answer(matrix, tolerance, forces=False).columns
    return [item.both if forces and item.both.judged else item for item in columns]


def advice_lines(
    columns: Sequence[ColumnAnswer],
    over_all: str,
    costs: Sequence[Mapping[str, Any]],
    durations: Mapping[str, float],
    tolerance: str,
    *,
    forces: bool,
    every_setting: bool,
) -> Iterator[str]:
    """Lines of advice: for one scene all its formulations, for several a line for each scene and each engine.

    Args:
        columns: answers for kinds and scenes.
        over_all: sentence on all scenes.
        costs: every formulation in each kind and scene.
        durations: scene -> time over which runs were compared [s].
        tolerance: with its unit, as ``--tolerance`` takes it.
        forces: True if forces were asked for.
        every_setting: True to list the formulations of several scenes, too.
    """
    scenes = [item for item in columns if not item.column.whole]
    silent = [item.column.name for item in scenes if forces and not item.asked.forces]
    asked = f"{tolerance}{', with forces' if forces and len(silent) < len(scenes) else ''}"
    of_motion = f" Forces are not judged in {', '.join(silent)}: there by the motion alone." if silent else ""
    shown = f"Tolerance: {asked}. {_shown_over(durations)}{of_motion}"
    models = [cost for cost in costs if cost["engine"].partition(" ")[0] not in scenes[0].matrix.witnesses]
    of = {name: [cost for cost in models if cost["of"] == name] for name in (cost["of"] for cost in models)}
    of_scene = {item.column.name: of.get(item.column.name) or of.get(item.column.group, []) for item in scenes}
    if len(scenes) == 1:
        (item,), name = scenes, scenes[0].column.name
        yield from (*take_lines(item, tolerance, shown), "", *setting_lines(of_scene[name]), "")
        command = f"  proofroll recommend {name} --tolerance '{tolerance}'"
        yield from ("Lines for your model:", f"{command}{' --forces' if item.asked.forces else ''} --lines")
        yield "Lead open: an engine that holds it ran no coarser step:" if lead_open(item) else "Finer steps:"
        yield f"{command} --measure"
        return
    yield from (*kind_sentences(columns), "", *scene_lines(columns))
    for item in columns:
        if item.column.whole and len(item.column.scenes) > 1:
            yield from ("", *engine_lines(item))
    for name, lines in of_scene.items() if every_setting else ():
        yield from ("", name, *setting_lines(lines))
    yield from ("", over_all) if len(columns) - len(scenes) > 1 else ()
    yield from ("", shown, "One scene by name: its next settings, and with --lines the lines for your model.")


def _shown_over(durations: Mapping[str, float]) -> str:
    """Sentence on the times over which runs were compared, beside the duration of a scene that has a longer one."""
    texts: dict[str, list[str]] = {}
    for scene, time in sorted(durations.items()):
        whole = read_scene_file(scene).duration if is_scene(scene) else None
        of = f" of {number(whole)} s" if whole and whole > time else ""
        texts.setdefault(f"{number(time)} s{of}", []).append(scene)
    clauses = [f"{text} ({', '.join(named)})" if len(texts) > 1 else text for text, named in texts.items()]
    return f"Shown over {', '.join(clauses)}."


def kind_sentences(columns: Sequence[ColumnAnswer]) -> list[str]:
    """Sentence for each kind of scenes: the engine to take, its speeds, where others are better, and with forces."""
    sentences = []
    for item in columns:
        taken = item.taken
        if not item.column.whole:
            continue
        kind, count = item.column.title.lower(), len(item.column.scenes)
        if taken is None:
            several = f"none of {count} scenes is held by any engine"
            sentences.append(f"{item.column.title}: {several if count > 1 else item.closest_words}.")
            continue
        of = f"{taken.held} of {count} {'' if kind.endswith('s') else 'scenes of '}" if count > 1 else ""
        words = f"{item.matrix.title(taken.engine)} for {of}{kind} ({speed_range(taken)})"
        sentences.append(f"{'; '.join([words, *item.exceptions])}.{_with_forces(item)}")
    return sentences


def _with_forces(item: ColumnAnswer) -> str:
    """Sentence on the answer where forces count, if it was not asked for and is another."""
    taken = item.both.taken
    if item.asked.forces or not item.both.judged or (taken and item.taken and taken.engine == item.taken.engine):
        return ""
    if taken is None:
        return " With forces: none."
    return f" With forces: {item.matrix.title(taken.engine)} for {taken.held} of {taken.scenes}."


def scene_lines(columns: Sequence[ColumnAnswer]) -> Iterator[str]:
    """A line for each scene: its name, the speed, and what to take; then ties and open leads."""
    scenes = [item for item in columns if not item.column.whole]
    width = max(len("scene"), *(len(item.column.name) for item in scenes))
    yield f"{'scene':{width}}{'× real time':>{_SPEED + 2}}  take"
    for item in scenes:
        speed = item.taken.text if item.taken else "–"
        take = told(item.matrix, item.taken) if item.taken else item.closest_words
        head = f"{item.column.name:{width}}{speed:>{_SPEED + 2}}  "
        yield textwrap.fill(take, WIDTH, initial_indent=head, subsequent_indent=" " * len(head))
    ties = [f"{item.column.name} {item.matrix.title(tie.engine)}" for item in scenes for tie in item.tied]
    lead = sum(lead_open(item) for item in scenes)
    last = [f"Ties: {', '.join(ties)}."] if ties else []
    last += [f"Lead open in {lead}: a rival that holds it ran no coarser step."] if lead else []
    yield from ["", " ".join(last)] if last else []


def lead_open(item: ColumnAnswer) -> bool:
    """True if an engine that holds the tolerance, but is not the one to take, ran no coarser step that fails."""
    return any(cell.open for cell in item.standings[1:] if cell.holds)


def engine_lines(item: ColumnAnswer) -> Iterator[str]:
    """A line for each engine in a kind of several scenes: how many it holds, its speeds, and its relative cost."""
    width = max(len(item.matrix.title(cell.engine)) for cell in item.standings)
    yield f"{'engine':{width}}{'holds':>10}{'× real time':>{_SPEED + 5}}  cost relative to the cheapest"
    least = [min((cell.cost for cell in cells if cell.holds), default=0.0) for cells in _by_scene(item)]
    for cell in item.standings:
        if cell.state in {NO_RUN, CANNOT}:
            continue
        speeds = speed_range(cell) if cell.held else "–"
        title, count = item.matrix.title(cell.engine), f"{cell.held} of {len(cell.each)}"
        yield f"{title:{width}}{count:>10}{speeds:>{_SPEED + 5}}  {_relative(item, cell, least)}"


def _by_scene(item: ColumnAnswer) -> list[tuple[ChoiceCell, ...]]:
    return list(zip(*(cell.each for cell in item.standings), strict=True))


def _relative(item: ColumnAnswer, cell: ChoiceCell, least: Sequence[float]) -> str:
    """Range of an engine's costs over the cheapest of each scene, and what keeps it from the other scenes."""
    ratios = sorted(mine.cost / cost for mine, cost in zip(cell.each, least, strict=True) if mine.holds and cost)
    ends = list(dict.fromkeys(number(ratio) for ratio in (ratios[:1] + ratios[-1:])))
    words = ["the cheapest" if ends == ["1"] else f"{' to '.join(ends)} times"] if ends else []
    silent = [mine for mine in cell.each if mine.state in {NO_RUN, CANNOT}]
    words += [f"{len(silent)} not run"] if silent else []
    failing = [
        f"{'off by ' if mine.why.startswith('off by') else ''}{mine.text} in {scene.name}"
        for mine, scene in zip(cell.each, item.column.scenes, strict=False)
        if not mine.holds and mine not in silent
    ]
    return "; ".join([*words, *failing[:1], *([f"{len(failing) - 1} more"] if len(failing) > 1 else [])])


def take_lines(item: ColumnAnswer, tolerance: str, shown_over: str) -> Iterator[str]:
    """Answer for one scene in two sentences: what to take at what speed, ties, and over which time it was shown."""
    taken = item.taken
    if taken is None:
        closest = item.closest_words.removeprefix("none; closest ")
        yield f"Nothing that was run holds {tolerance} in {item.column.name}. Closest: {closest}. {shown_over}"
        return
    yield f"Take {told(item.matrix, taken)}: {taken.text} real time."
    ties = "; ".join(f"{told(item.matrix, tie)}: {tie.text}" for tie in item.tied)
    yield f"{f'Tie: {ties}. ' if ties else ''}{shown_over}"


def setting_lines(costs: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """A line for each formulation in a scene or kind, the cheapest first; below it why it does not hold."""
    yield f"  {'setting':{WIDTH - 2 - _SPEED}}{'× real time':>{_SPEED}}"
    for cost in sorted(costs, key=lambda cost: (not cost["holds"], cost["cost"] or 0.0)):
        engine, _, formulation = cost["engine"].partition(" ")
        setting = cost["setting"].removeprefix("at ").replace(" at ", ", ")
        name = ", ".join(filter(None, (engine_words(engine, formulation), setting if cost["holds"] else "")))
        speed = cost["text"] if cost["holds"] else "–"
        yield f"{SYMBOLS.get(cost['state'], '·')} {name:{WIDTH - 2 - _SPEED}}{speed:>{_SPEED}}"
        if not cost["holds"]:
            yield f"    {cost['text']}"
