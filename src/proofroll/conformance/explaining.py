"""Why a check of the motion fails, for the author: what a longer run against the truth proves."""

from __future__ import annotations

import math

import numpy as np

from proofroll.conformance.subject import Subject
from proofroll.core.certificate import certify
from proofroll.core.dataset import from_samples
from proofroll.core.diagnosis.of_scene import diagnosed
from proofroll.core.errors import Diverged, InputError, Refused

# So many samples, a hundredth of the natural time apart: splines through them resolve the motion.
_SAMPLES, _PART = 36, 100


class UnlikeSceneError(AssertionError):
    """What an engine built or did is not what the scene says; the causes are looked for where they are told."""

    def __init__(self, subject: Subject, sentence: str) -> None:
        super().__init__(sentence)
        self.subject = subject


def explained(error: UnlikeSceneError) -> str:
    """The sentence of a failed check, with the proven causes of the difference behind it, if there are any."""
    from proofroll.core.truth import truth

    subject, sentence = error.subject, str(error)
    scene, step = subject.scene, subject.settings.dt if subject.fixed_step else None
    interval = scene.natural_time / _PART
    if step is not None:
        interval = max(math.floor(interval / step), 1) * step
    times = np.asarray(interval * np.arange(_SAMPLES), dtype=np.float64)
    try:
        engine = subject.build()
        lines = [line.as_dict() for line in certify(engine, scene)]
        causes = [] if all(line["holds"] for line in lines) else diagnosed(scene, lines, step=step)
        if not causes:
            samples = [engine.sample()]
            for t in times[1:].tolist():
                engine.advance(t)
                samples.append(engine.sample())
            causes = diagnosed(scene, lines, from_samples(scene, times, samples), truth(scene, times), step)
    except (Diverged, Refused, InputError):
        return sentence  # the check has said what it found; there is no run that tells more
    except Exception as behind:  # anybody's engine, on a longer run than the check made
        return f"{sentence}\nno cause was found: {type(behind).__name__}: {behind}"
    return "\n".join([sentence, *(f"cause: {item.sentence}: {item.cause.remedy}" for item in causes)])
