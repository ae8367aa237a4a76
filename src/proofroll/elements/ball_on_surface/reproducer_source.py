"""Programs that run a ball on a wall without proofroll: an adapter's own steps, cut out, with the numbers they use.

They are for :meth:`proofroll.core.engine_abilities.Reproduces.reproducer`.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from proofroll.core.arrays import FloatArray
from proofroll.core.cut_out import CutOut
from proofroll.core.errors import Refused
from proofroll.core.program_text import assignment
from proofroll.elements.ball_on_surface.model import RollingBall

# Functions of the wall of a ``BODY``, with which a program checks a run against the laws.
WALL = '''

def frame(p):
    """e1 (into the wall), e2, e3 for a ball at p."""
    return np.reshape(BODY.surface.triad(*map(float, p)), (3, 3))


def gap(p):
    """Distance of the ball from the wall [m], negative where it has sunk in."""
    return float(BODY.surface.nearby(*map(float, p))[0])
'''


def cut_program(
    body: RollingBall,
    settings: Any,
    wanted: Sequence[Any],
    uses: Iterable[str],
    run: str,
    instead: Mapping[str, str] = {},
    **values: Any,
) -> str:
    """Text of a program: numbers, the definitions ``wanted`` with all they need, ``BODY``, ``SETTINGS``, ``run``.

    Args:
        body: the ball; the program holds those attributes of it, and of the settings, that its code reads.
        settings: of the engine.
        wanted: functions and classes.
        uses: names of attributes that ``run`` reads.
        run: text that defines ``run(times)``.
        instead: texts that replace definitions, by their names.
        values: further numbers, by their names.

    Raises:
        Refused: the wall moves, or is not homogeneous.
    """
    if body.wall_rate is not None:
        raise Refused("programs are written only for walls that stand")
    if body.surface.generators is None:
        raise Refused("programs are written only for walls that slide along themselves")
    uses = {*uses, "triad", "nearby", "surface"}
    cut = CutOut([*wanted, type(body.surface)], uses, instead)
    constants = f"\n\nBODY = {cut.literal(body)}\nSETTINGS = {cut.literal(settings)}\n"
    return f"{cut.head}\n{assignment(**ball_numbers(body), **values)}\n\n{cut.text}{constants}{WALL}{run}"


def ball_numbers(body: RollingBall) -> dict[str, float | FloatArray]:
    """Numbers of the ball, by their names in programs."""
    return {
        "RADIUS": body.ball.radius,
        "MASS": body.ball.mass,
        "INERTIA": body.ball.inertia,
        "GRAVITY": body.gravity,
        "POSITION": body.p0,
        "VELOCITY": body.v0,
        "SPIN": body.w0,
    }
