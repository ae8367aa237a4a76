"""Mechanisms whose applied forces, bushings and prescribed motions act in other axes, at other places, or late."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, ClassVar

from proofroll.core.scene import Scene
from proofroll.elements.mechanism.scene.signal import Formula, Signal, delayed
from proofroll_drill.mutants.base import STEP, planted
from proofroll_drill.mutants.mechanism_models import MechanismMutant, each


class OfMotion(MechanismMutant):
    """Base of mutants of one prescribed motion; they start as the scene says."""

    scene: ClassVar[Any] = ("shaken_pendulum", {})

    def __init__(self, scene: Scene, settings: Any) -> None:
        super().__init__(scene, settings)
        equations = self.inner._equations
        equations._moved = [(number, self.changed(signal)) for number, signal in equations._moved]

    def changed(self, motion: Signal) -> Signal:
        """Motion that it follows."""
        return motion


def _reworded(words: str) -> Callable[[Any, Any], Formula]:
    """Method ``changed`` of a mutant: another formula of the motion, with its own in braces."""
    return lambda _, motion: Formula(words.format(motion.text), motion.numbers)


def _weaker(force: Any) -> Any:
    """Force with a tenth less, in formula and number."""
    x, y, z = force.value
    return 0.9 * x, 0.9 * y, Formula(f"0.9*({z.text})", z.numbers)


def _exchanged(values: Any) -> Any:
    """Numbers of a bushing with y and z exchanged."""
    a, b, c, d, e, f = values
    return a, c, b, d, f, e


_slung = partial(planted, MechanismMutant, scene=("slung_load", {}))
_mounted, _moved = partial(planted, MechanismMutant, scene=("engine_on_mounts", {})), partial(planted, OfMotion)
FAULTS = (
    _slung(
        "InWorldAxes",
        "applied force in the wrong frame",
        "force thrust acts along the axes of the world, not of craft",
        other=each("forces", "thrust", frame=lambda _: "world"),
    ),
    _slung(
        "AtCentre",
        "applied force at the centre of mass",
        "force wind acts at the centre of mass of load",
        other=each("forces", "wind", position=lambda _: (0, 0.02, -0.3)),
    ),
    _slung(
        "Mirrored",
        "applied force at its mirrored point",
        "force thrust acts at the opposite place of craft",
        other=each("forces", "thrust", position=lambda force: tuple(-x for x in force.position)),
    ),
    # none that a hypothesis tries by name
    _slung(
        "Elsewhere",
        "applied force at the wrong point",
        "force wind acts along a line through (-0.0228, 0.127, -0.215) m of load",
        other=each("forces", "wind", position=lambda _: (0.05, 0.13, -0.2)),
    ),
    _slung(
        "Unopposed",
        "applied moment without reaction",
        "moment winch has no reaction on load",
        other=each("forces", "winch", reaction=lambda _: "world"),
    ),
    _slung(
        "LateForce",
        "applied force a step late",
        "force thrust is a step late",
        other=each("forces", "thrust", value=lambda force: tuple(delayed(part, STEP) for part in force.value)),
    ),
    _slung("Weak", "applied force 0.9 times", "force thrust 0.9 times", other=each("forces", "thrust", value=_weaker)),
    _mounted(
        "Exchanged",
        "axes of a bushing exchanged",
        "bushing rear exchanges y and z",
        other=each(
            "bushings",
            "rear",
            stiffness=lambda item: _exchanged(item.stiffness),
            damping=lambda item: _exchanged(item.damping),
        ),
    ),
    _mounted(
        "Upright",
        "bushing in the axes of the body",
        "bushing left acts along the axes of world, not of its frame there",
        other=each("bushings", "left", orientation_a=lambda _: (0, 0, 0), orientation_b=lambda _: (0, 0, 0)),
    ),
    _moved(
        "LateMotion",
        "prescribed motion a step late",
        "the motion of shaker is a step late",
        changed=lambda _, motion: delayed(motion, STEP),
    ),
    _moved(
        "BackwardsMotion",
        "prescribed motion with the wrong sign",
        "the motion of shaker has the opposite sign",
        changed=_reworded("-({})"),
    ),
    _moved(
        "InDegrees",
        "prescribed motion in degrees",
        "the motion of motor is taken for degrees",
        scene=("driven_four_bar", {}),
        changed=_reworded("({})*pi/180"),
    ),
)
