"""A person's own run in motion, beside the truth, as a page of its own."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from proofroll.core.errors import InputError
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.files.scene_file import is_scene, load_scene, read_scene_file
from proofroll.files.trajectory_file import STORED, write
from proofroll.report.kinds import kind_of, report_kinds
from proofroll.report.labels import settings_text
from proofroll.report.replay import case_content, distance
from proofroll.report.replay_library import three
from proofroll.report.replay_records import Ghost, Replay, Replayed
from proofroll.studies.planning import point_name

if TYPE_CHECKING:
    import xarray as xr

_WRITES = "proofroll run … --out writes such a file"


def replay_page(path: Path, run: xr.Dataset, scene_of_run: str | None = None) -> str:
    """The page of what a file holds: the truth of the run's scene, solid, and the run, translucent.

    Args:
        path: of the file, for messages.
        run: what it holds.
        scene_of_run: name or path of its scene; None: as the file says.

    Raises:
        InputError: it does not say of what it is a run, the scene is another by now, or nothing draws such scenes.
        ProofrollError: the scene has no truth.
    """
    from proofroll.report.html import templates
    from proofroll.report.pages import rendered

    name = scene_of_run or str(run.attrs.get("scene_path", run.attrs.get("scene", "")))
    scene = _scene(path, run, name)
    kind = kind_of(scene)
    if kind is None or not kind.replay_script:
        raise InputError("run", path, f"nothing that is installed draws the scene {scene.title}")
    if "p_WB" not in run:
        raise InputError("run", path, f"it has no poses of bodies (p_WB); {_WRITES}")
    usual = load_scene(name).parameters
    label = point_name({name: value for name, value in scene.parameters.items() if value != usual[name]})
    with tempfile.TemporaryDirectory() as folder:
        file, own = (Path(folder) / f"{name}{STORED}" for name in ("truth", "run"))
        true = truth(scene, run["time"].to_numpy())
        write(true, file)
        write(run, own)
        replayed = Replayed(scene, file, _ghosts(own, run, true), scene.title, label or scene.title)
        case, numbers = case_content(replayed, kind.replay(), lambda _: "")
    return rendered(
        templates(),
        "run_replay.html",
        scene=scene,
        replay=Replay(three(), 0, [case], [numbers]),
        said=_said(run),
        replay_scripts=[other.replay_script for other in report_kinds() if other.replay_script],
    )


def _said(run: xr.Dataset) -> str:
    engine = str(run.attrs["engine"])
    if engine == "truth":
        return "The truth."
    settings = settings_text(json.loads(run.attrs["settings"]))
    return f"The truth, solid, and {engine} ({settings}), translucent; where it agrees it is hidden in the truth."


def _scene(path: Path, run: xr.Dataset, name: str) -> Scene:
    """The scene of a run, with all that can be asked of its truth."""
    try:
        digest, parameters = str(run.attrs["scene_digest"]), dict(json.loads(run.attrs["parameters"]))
    except (KeyError, ValueError):
        name = ""
    if not name:
        raise InputError("run", path, f"it does not say which scene it is of; {_WRITES}")
    if not is_scene(name):
        raise InputError("scene", name, "the scene of this run is not there; say where it lies by --scene PATH")
    ran, here = str(run.attrs.get("scene")), read_scene_file(name).parameters
    if lacking := sorted(parameters.keys() - here):
        raise InputError("scene", name, f"the run is one of {ran}, and this scene has no {', '.join(lacking)}")
    scene = load_scene(name, **parameters)
    if digest not in {scene.digest, scene.fully_asked.digest}:
        advice = f"the scene {name} has changed since this run of {ran}, or is another; run it, or say which by --scene"
        raise InputError("run", path, advice)
    return scene.fully_asked


def _ghosts(path: Path, run: xr.Dataset, true: xr.Dataset) -> list[Ghost]:
    """The run as a ghost; none if it is the truth itself."""
    engine = str(run.attrs["engine"])
    if engine == "truth":
        return []
    settings = json.loads(run.attrs["settings"])
    message = "" if run.attrs["status"] == "done" else str(run.attrs["message"])
    away = distance(run["p_WB"].to_numpy(), true["p_WB"].to_numpy())
    return [Ghost("", engine, settings, engine, 0, away, path, message)]
