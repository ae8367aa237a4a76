"""Replay page of a user's own run beside the truth."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import reduce
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.dataset import BY_STEPS, ended_early, part, until_end
from proofroll.core.element import Element
from proofroll.core.errors import InputError, ProofrollError
from proofroll.core.multi_element import each_alone
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.files.scene_file import is_scene, load_scene, read_scene_file
from proofroll.report.kinds import kind_of, report_kinds
from proofroll.report.labels import engine_words, preset_name, settings_text, step
from proofroll.report.replay.library import three
from proofroll.report.replay.records import Ghost, Replay, ReplayCase, Replayed, ReplayKind
from proofroll.report.replay.replay import case_content, distance
from proofroll.report.run.curves import curves_alone, curves_beside_truth
from proofroll.studies.comparison.planning import point_name

if TYPE_CHECKING:
    import xarray as xr

_WRITES = "proofroll run … --out writes one"


def run_page(path: Path, run: xr.Dataset) -> str:
    """HTML page of a run as :func:`replay_page`; where that has no truth or drawing, of its curves alone, with why."""
    from proofroll.report.page.html import templates
    from proofroll.report.pages import rendered

    try:
        return replay_page(path, run)
    except ProofrollError as problem:
        why = problem.advice if isinstance(problem, InputError) else str(problem)
        title = ", ".join(filter(None, (str(run.attrs.get(key, "")) for key in ("scene", "engine"))))
        caption = f"The run alone: {why}."
        return rendered(
            templates(), "run_replay.html", title=title or path.stem, curves=curves_alone(run), caption=caption
        )


def replay_page(
    path: Path,
    run: xr.Dataset,
    scene_of_run: str | None = None,
    beside: Sequence[xr.Dataset] = (),
    true: xr.Dataset | None = None,
    untold: str = "",
    script: str = "",
    version: str = "",
) -> str:
    """HTML page that replays runs: the truth of their scene, solid, and the runs, translucent; without a truth alone.

    Below are the four curves of the first engine's run that are furthest off, with the truth's; without a truth all.

    In a scene of several elements, each is a case of its own, for no force couples them. Behind the end of a truth
    that ends early neither it nor the run is drawn; the caption says when and why it ends.

    Args:
        path: of the file, for messages.
        run: the run to show.
        scene_of_run: name or path of its scene; None: as the file says.
        beside: further runs of the same scene with the same parameters, shown at the instants that all have.
        true: truth at the instants of the longest run; None: it is computed.
        untold: clause on why no truth is shown; empty: it is shown where there is one.
        script: name of a script beside the page that sets the version of the page written last; empty: there is none.
        version: of this page, which loads itself again as soon as the script's is another.

    Raises:
        InputError: the file names no scene, the scene has changed since, nothing draws such scenes, or the runs are of
            several scenes or share no two instants.
        ProofrollError: the scene has no truth.
    """
    from proofroll.report.page.html import templates
    from proofroll.report.pages import rendered

    name = scene_of_run or str(run.attrs.get("scene_path", run.attrs.get("scene", "")))
    scene = _scene(path, run, name)
    parts = list(zip(scene.elements, each_alone(scene), strict=True))
    drawers = [_drawer(path, scene, element, alone, run) for element, alone in parts]
    usual = load_scene(name).parameters
    label = point_name({name: value for name, value in scene.parameters.items() if value != usual[name]})
    run, *beside = _at_common_instants(path, [run, *beside])
    longest = max([run, *beside], key=lambda rival: rival.sizes["time"])
    if untold:
        true = longest
    elif true is None:
        true = truth(scene, longest["time"].to_numpy())
    run, *beside = until_end(scene, true, dict(enumerate([run, *beside]))).values()
    judged = next((item for item in (run, *beside) if item.attrs["engine"] != "truth"), run)
    cases: list[ReplayCase] = []
    packed: list[str] = []
    captions: list[str] = []
    group = scene.title if len(parts) == 1 or not label else f"{scene.title}, {label}"
    for (element, alone), drawer in zip(parts, drawers, strict=True):
        true_part, run_part, *others = (part(scene, element, whole) for whole in (true, run, *beside))
        shown = element.name if len(parts) > 1 else label or scene.title
        has_truth = not untold and bool(np.isfinite(true_part["p_WB"]).all())  # else laws alone judge a run
        solid, ghosts = (true_part, [run_part, *others]) if has_truth else (run_part, others)
        replayed = Replayed(
            scene=alone, true=solid, file="", ghosts=_ghosts(ghosts, solid), group=group, label=shown,
            solid=_by_steps(true) or "truth" if has_truth else str(run.attrs["engine"]),
        )  # fmt: skip
        case, numbers = case_content(replayed, drawer)
        cases.append(case)
        packed.append(numbers)
        captions.append(_caption([run, *beside], _by_steps(true) or "truth" if has_truth else "", untold))
    if has_truth and (end := ended_early(true)) is not None:
        captions.append(f"What lies behind {end[0]:.6g} s is not drawn, for the truth ends there: {end[1]}.")
    return rendered(
        templates(),
        "run_replay.html",
        title=scene.title,
        curves=(has_truth and curves_beside_truth(scene, judged, true)) or curves_alone(run),
        replay=Replay(three(), 0, cases, packed),
        caption=" ".join(dict.fromkeys(captions)),
        replay_scripts=[kind.replay_script for kind in report_kinds().values() if kind.replay_script],
        of_curves=str((judged if has_truth else run).attrs["engine"]) if beside else "",
        script=script,
        version=version,
    )


def _at_common_instants(path: Path, runs: Sequence[xr.Dataset]) -> list[xr.Dataset]:
    """Runs at the instants that all of them have, but for those that some end too early for.

    Raises:
        InputError: runs of several scenes, or without two common instants.
    """
    if len({str(run.attrs.get("scene_digest")) for run in runs}) > 1:
        raise InputError("run", path, "the runs are of several scenes or parameters; show each alone")
    # instants of one grid differ by the round-off of k · every alone
    keys = [np.round(run["time"].to_numpy(), 12) for run in runs]
    longest = max(keys, key=len)
    if all(np.array_equal(key, longest[: len(key)]) for key in keys):
        return list(runs)
    common = reduce(np.intersect1d, keys)
    if len(common) < 2:
        raise InputError("run", path, "the runs share no two instants; make them with one --every")
    return [run.isel(time=np.flatnonzero(np.isin(key, common))) for run, key in zip(runs, keys, strict=True)]


def _drawer(path: Path, scene: Scene, element: Element, alone: Scene, run: xr.Dataset) -> ReplayKind:
    """Replay kind that draws an element of a run; ``alone``: the scene of this element only. Raises InputError."""
    of = f" of {element.name}" if len(scene.elements) > 1 else ""
    kind = kind_of(alone)
    if kind is None or not kind.replay_script:
        what = f"the element {element.name} of " if of else ""
        raise InputError("run", path, f"nothing that is installed draws {what}the scene {scene.title}")
    run_part = part(scene, element, run)
    if "p_WB" not in run_part:
        raise InputError("run", path, f"it has no poses of bodies (p_WB){of}; {_WRITES}")
    if not (np.diff(run_part["time"]) > 0).all() or not np.isfinite(run_part["p_WB"]).all():
        raise InputError("run", path, f"its times have to rise, and its poses{of} to be numbers; {_WRITES}")
    return kind.replay()


def _by_steps(true: xr.Dataset) -> str:
    """Name of a reference that is no truth; empty: it is one."""
    return "reference by steps" if true.attrs.get(BY_STEPS) else ""


def _caption(runs: Sequence[xr.Dataset], solid: str, untold: str) -> str:
    """Sentence on what is shown; ``solid``: ``truth``, or what is shown for it; empty: the first run."""
    names = [
        f"{run.attrs['engine']} ({settings_text(json.loads(run.attrs['settings']))})"
        for run in runs
        if run.attrs["engine"] != "truth"
    ]
    if not names:
        return f"The {solid}."
    if not solid:
        first, *others = names
        beside = f", solid, and {', '.join(others)}, translucent" if others else " alone"
        return f"{first}{beside}: {untold or 'no truth tells the whole motion'}."
    agreeing = "where it agrees it is hidden" if len(names) == 1 else "where they agree they are hidden"
    return f"The {solid}, solid, and {', '.join(names)}, translucent; {agreeing} in it."


def _scene(path: Path, run: xr.Dataset, name: str) -> Scene:
    """Scene of a run with everything asked of its truth. Raises InputError if it is unknown or has changed."""
    try:
        digest, *_ = [str(run.attrs[key]) for key in ("scene_digest", "engine", "status")]
        parameters, _ = [dict(json.loads(run.attrs[key])) for key in ("parameters", "settings")]
    except (KeyError, ValueError, TypeError):
        name = ""
    if not name:
        raise InputError("run", path, f"it does not say which scene it is of, in which engine; {_WRITES}")
    if not is_scene(name):
        raise InputError("scene", name, "the scene of this run is not there; say where it lies by --scene PATH")
    ran, declared = str(run.attrs.get("scene")), read_scene_file(name).parameters
    if lacking := sorted(parameters.keys() - declared):
        raise InputError("scene", name, f"the run is one of {ran}, and this scene has no {', '.join(lacking)}")
    scene = load_scene(name, **parameters)
    if digest not in {scene.digest, scene.fully_asked.digest}:
        advice = f"the scene {name} has changed since this run of {ran}, or is another; run it, or say which by --scene"
        raise InputError("run", path, advice)
    return scene.fully_asked


def _name(run: xr.Dataset) -> str:
    """Engine, formulation, preset and step of a run for a reader."""
    settings = json.loads(run.attrs["settings"])
    named = engine_words(str(run.attrs["engine"]), str(settings.get("formulation") or ""))
    return ", ".join(filter(None, (named, preset_name(settings.get("preset")), step("dt", settings.get("dt")))))


def _ghosts(runs: Sequence[xr.Dataset], true: xr.Dataset) -> list[Ghost]:
    """Each run as a ghost, but the truth itself."""
    return [
        Ghost(
            key=str(number),
            engine=str(run.attrs["engine"]),
            settings=json.loads(run.attrs["settings"]),
            name=_name(run) if len(runs) > 1 else str(run.attrs["engine"]),
            colour=number,
            distance=distance(run["p_WB"].to_numpy(), true["p_WB"].to_numpy()),
            motion=run,
            file="",
            message="" if run.attrs["status"] == "done" else str(run.attrs["message"]),
        )
        for number, run in enumerate(runs)
        if run.attrs["engine"] != "truth"
    ]
