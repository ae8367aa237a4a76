"""Questions by name: of a scene, or of the comparison of a scene."""

from __future__ import annotations

from collections.abc import Mapping

from proofroll.files.comparison_file import load_comparison
from proofroll.files.scene_file import is_scene, load_scene, read_scene_file
from proofroll.studies.answer.question import AnswerQuestion
from proofroll.studies.comparison.planning import with_edges


def question_named(name: str, parameters: Mapping[str, object], until: float | None = None) -> AnswerQuestion:
    """Question about a scene, or about the first brief point of a comparison; what is given counts more.

    Args:
        name: of a scene, of a comparison, or the path of either or of a robot file.
        parameters: values of parameters, as text or numbers.
        until: length of the runs [s]; None: the duration of the scene's file, or else that of the comparison, or 2 s.

    Raises:
        InputError: there is neither, or a value makes no sense.
    """
    scene, point = name, dict(parameters)
    if not is_scene(name):
        comparison = with_edges(load_comparison(name).briefly())
        scene = comparison.scene
        point = {**next(iter(comparison.combinations())), **point}
        until = until or read_scene_file(scene).duration or comparison.until
    loaded = load_scene(scene, **point)  # type: ignore[arg-type]  # text is checked and converted there
    return AnswerQuestion.of(scene, {key: loaded.parameters[key] for key in point}, until)
