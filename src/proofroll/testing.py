"""Agreement with the truth as an assertion, for tests of engines and of what is built on them.

The pytest plug-in of this package gives :func:`assert_agrees` as a fixture of that name; nothing of it is loaded before
a test asks for it. pytest is not needed here.
"""

import os
from collections.abc import Mapping
from typing import Any

from proofroll.core.errors import InputError
from proofroll.core.scene import Scene
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import recorded, simulate
from proofroll.studies.judging.judge import Judged, judge

__all__ = ["Judged", "assert_agrees"]


def assert_agrees(
    scene: str | Scene,
    engine: Any,
    *,
    tolerance: Mapping[str, object] | str | float,
    because: str,
    until: float = 1.0,
    every: float | None = None,
    **settings: Any,
) -> Judged:
    """Asserts that an engine moves a scene as the truth does.

    Args:
        scene: name, path of a folder, or :func:`proofroll.load_scene`.
        engine: ``name[key=value,…]``; a class, which no package needs to announce; an engine that is built, at time 0;
            or a trajectory, as for :func:`proofroll.judge`.
        tolerance: allowed error, as for :func:`proofroll.judge`.
        because: reason for which that is close enough.
        until: last time [s]; of an engine.
        every: interval between samples [s]; by default 0.01 s, or the nearest whole number of steps.
        **settings: of the engine.

    Returns:
        what was found, if it agrees.

    Raises:
        AssertionError: it does not, or did not reach the end; the text says what is off, by how much and when, what is
            allowed, and how well the truth is known.
        InputError: something that was given does not exist or makes no sense.
        Missing, Refused: the engine is not installed, or cannot represent the scene.
    """
    __tracebackhide__ = True  # pytest then shows the line of the test and the sentence, not the frames in here
    if not because.strip():
        raise InputError("because", because, "say why the tolerance is close enough")
    scene = load_scene(scene) if isinstance(scene, str) else scene
    if isinstance(engine, os.PathLike | Mapping) or hasattr(engine, "data_vars"):
        run, name = engine, "the trajectory"
    elif hasattr(engine, "advance") and not isinstance(engine, type):
        run, name = recorded(engine, scene, until=until, every=every), type(engine).__name__
    else:
        run = simulate(scene, engine, until=until, every=every, **settings)
        name = engine if isinstance(engine, str) else engine.name
    status = run.attrs.get("status", "done") if hasattr(run, "attrs") else "done"
    if status != "done":
        raise AssertionError(f"{name} {status} on {scene.name}: {run.attrs['message']}")
    judged = judge(run, scene, tolerance, because=because)
    if not judged.agrees:
        raise AssertionError(f"{name} {judged}")
    return judged
