"""Agreement with the truth as an assertion, for tests of engines and of packages that use them.

The pytest plug-in of this package offers :func:`assert_agrees` as a fixture of that name. This module does not need
pytest.
"""

import os
from collections.abc import Mapping
from typing import Any

from proofroll.core.errors import InputError
from proofroll.core.scene import Scene
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate, simulate_built
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
        engine: ``name[key=value,…]``; a class, which no package needs to announce; an engine built by the caller, at
            time 0; or a trajectory, as for :func:`proofroll.judge`.
        tolerance: allowed error, as for :func:`proofroll.judge`.
        because: reason for this tolerance.
        until: last time of an engine's run [s].
        every: sampling interval [s]; by default 0.01 s, or the nearest whole number of steps.
        **settings: of the engine.

    Returns:
        The judgement, if it agrees.

    Raises:
        AssertionError: the run differs, or ended early; the text has each error with its time, its tolerance and
            the error bar of the truth.
        InputError: an argument names something unknown or makes no sense.
        Missing, Refused: the engine is not installed, or cannot represent the scene.
    """
    __tracebackhide__ = True  # pytest then shows the line of the test, not the frames of this function

    if not because.strip():
        raise InputError("because", because, "say why the tolerance is close enough")
    scene = load_scene(scene) if isinstance(scene, str) else scene
    if isinstance(engine, os.PathLike | Mapping) or hasattr(engine, "data_vars"):
        run, name = engine, "the trajectory"
    elif hasattr(engine, "advance") and not isinstance(engine, type):
        run, name = simulate_built(engine, scene, until=until, every=every), type(engine).__name__
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
