"""Engines that do to their process what an engine must never do; installed by tests under throwaway names."""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from proofroll.core import certificate
from proofroll.core.errors import Diverged, Refused
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface import certificate as ball_certificate
from proofroll.elements.ball_on_surface.element import rolling_ball
from proofroll.elements.ball_on_surface.mechanics import initial_response
from proofroll.elements.ball_on_surface.model import BallCapability
from proofroll.elements.ball_on_surface.rolling_equations import closed_form
from proofroll.elements.ball_on_surface.sampling import BallBuilt, BallSample


@dataclass(frozen=True)
class HostileSettings:
    """The least that an engine's settings may be."""

    formulation: str = "only"
    preset: str = "matched"
    dt: float = 1e-2

    @property
    def resolution(self) -> str:
        """See :class:`proofroll.core.engine.Settings`."""
        return "dt"

    @property
    def order(self) -> int | None:
        """The closed form has no order."""
        return None


class Oracle:
    """Well behaved: answers with the closed form, and says so to standard output and standard error."""

    name: ClassVar[str] = "oracle"
    provides: ClassVar[Mapping[str, frozenset[str]]] = {
        "only": frozenset({BallCapability.ROLLING, BallCapability.CURVED_SURFACE})
    }
    settings: ClassVar[type[HostileSettings]] = HostileSettings
    presets: ClassVar[Mapping[str, Mapping[str, HostileSettings]]] = {"only": {"matched": HostileSettings()}}

    @staticmethod
    def version() -> str:
        """See :class:`proofroll.core.engine.Engine`."""
        return "1"

    @classmethod
    def build(cls, scene: Scene, settings: HostileSettings) -> Self:  # noqa: ARG003 -- the protocol's signature
        """See :class:`proofroll.core.engine.Engine`."""
        return cls(scene)

    def __init__(self, scene: Scene) -> None:
        self.body = rolling_ball(scene)
        self.t = 0.0

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        self.t = t

    def sample(self) -> BallSample:
        """See :class:`proofroll.core.engine.Engine`."""
        motion = closed_form(self.body, np.array([self.t]))
        assert motion is not None  # the engine does not provide rolling resistance
        return BallSample(motion.p_WB[0], motion.v_WB[0], motion.w_WB[0], force=motion.force[0])

    def built(self) -> BallBuilt:
        """See :class:`proofroll.core.engine.Engine`."""
        return BallBuilt(mass=self.body.ball.mass, acceleration=initial_response(self.body)[0])


class Steady(Oracle):
    """Closed form; the environment makes the motion faster by a part of it, but for its first twentieth of a second."""

    name = "steady"

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        off = float(os.environ.get("PROOFROLL_TEST_OFF", "0")) if t > 0.05 else 0.0
        super().advance(t * (1 + off))


class Garbage(Oracle):
    """Prints what looks like answers, on every stream, and closes standard output."""

    name = "garbage"

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        sys.stdout.write('{"status": "done"}\n\x00 not UTF-8: ')
        os.write(1, b"\xff\xfe\n" * 10000)
        os.write(2, b"warning: nothing is well\n")
        super().advance(t)


class Exits(Oracle):
    """Ends its process, as some libraries do on a licence error."""

    name = "exits"

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        sys.stderr.write(f"fatal: no licence at {t}\n")
        sys.stderr.flush()
        os._exit(7)


class Segfaults(Oracle):
    """Dies by a signal."""

    name = "segfaults"

    def advance(self, t: float) -> None:  # noqa: ARG002 -- the protocol's signature
        """See :class:`proofroll.core.engine.Engine`."""
        os.kill(os.getpid(), signal.SIGSEGV)


class Hangs(Oracle):
    """Never comes back, and does not listen to a polite signal."""

    name = "hangs"

    def advance(self, t: float) -> None:  # noqa: ARG002 -- the protocol's signature
        """See :class:`proofroll.core.engine.Engine`."""
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        time.sleep(600)


class HangsAloud(Hangs):
    """Hangs, and tells its process's id to the named pipe of the environment, which that process then keeps open."""

    name = "hangs_aloud"

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        self.pipe = os.open(os.environ["HANGS_ALOUD"], os.O_WRONLY)
        os.write(self.pipe, f"{os.getpid()}\n".encode())
        super().advance(t)


class Raises(Oracle):
    """Raises something over two lines."""

    name = "raises"

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        raise RuntimeError(f"matrix is singular\nat t = {t}")


class SaysExit(Oracle):
    """Calls ``sys.exit`` in the middle of a run."""

    name = "says_exit"

    def advance(self, t: float) -> None:  # noqa: ARG002 -- the protocol's signature
        """See :class:`proofroll.core.engine.Engine`."""
        sys.exit("goodbye")


class NotANumber(Oracle):
    """Its velocity is NaN from 0.1 s on."""

    name = "not_a_number"

    def sample(self) -> BallSample:
        """See :class:`proofroll.core.engine.Engine`."""
        right = super().sample()
        v = right.v_WB * (np.nan if self.t >= 0.1 else 1.0)
        return BallSample(right.p_WB, v, right.w_WB, force=right.force)


class GivesUp(Oracle):
    """Says that it diverged."""

    name = "gives_up"

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        if t > 0.06:
            raise Diverged(f"the step size fell to nothing at {t:g} s")
        super().advance(t)


class Refuses(Oracle):
    """Refuses every scene, with its reason."""

    name = "refuses"

    @classmethod
    def build(cls, scene: Scene, settings: Any) -> Self:  # noqa: ARG003 -- the protocol's signature
        """See :class:`proofroll.core.engine.Engine`."""
        raise Refused("no wheel, no ball")


class BlamesMemory(Oracle):
    """Calls a lack of memory its own divergence."""

    name = "blames_memory"

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        try:
            raise MemoryError
        except MemoryError:
            raise Diverged(f"the step failed at {t:g} s") from None


class BlamesFile(Oracle):
    """Calls a file that cannot be read a refusal."""

    name = "blames_file"

    @classmethod
    def build(cls, scene: Scene, settings: Any) -> Self:  # noqa: ARG003 -- the protocol's signature
        """See :class:`proofroll.core.engine.Engine`."""
        try:
            raise OSError(24, "Too many open files")
        except OSError as error:
            raise Refused("no model") from error


class Interrupted(Oracle):
    """Somebody sends it Ctrl-C, which it takes for its own failure."""

    name = "interrupted"

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        try:
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(600)
        except KeyboardInterrupt:
            raise Diverged(f"the solver stopped at {t:g} s") from None


class Commands(Oracle):
    """Its message is a command to the terminal."""

    name = "commands"

    def advance(self, t: float) -> None:  # noqa: ARG002 -- the protocol's signature
        """See :class:`proofroll.core.engine.Engine`."""
        raise Diverged("\x1b]0;owned\x07\x9b2J it stopped")


class JudgesItself(Oracle):
    """Puts a certificate that always holds in the place of the one that judges it."""

    name = "judges_itself"

    def __init__(self, scene: Scene) -> None:
        certificate.Line.holds = property(lambda _: True)  # type: ignore[assignment,method-assign]  # that is the fault
        super().__init__(scene)


class MovesTheBar(Oracle):
    """Widens what counts as round-off."""

    name = "moves_the_bar"

    def __init__(self, scene: Scene) -> None:
        certificate.EXACT = 1.0
        super().__init__(scene)


class SignsForTheBall(Oracle):
    """Puts lines of its own in the place of an element's, whose module is loaded with it."""

    name = "signs_for_the_ball"

    def __init__(self, scene: Scene) -> None:
        ball_certificate.certify = lambda *_: []  # type: ignore[assignment]  # that is the fault
        super().__init__(scene)


# Entry points of all of them, and of some that do no harm, so that tests of either share worker processes; "absent"
# needs a module that nobody has.
ENTRY_POINTS = {
    kind.name: f"hostile:{kind.__name__}"
    for kind in [*vars().values()]
    if isinstance(kind, type) and issubclass(kind, Oracle)
} | {
    "broken": "broken:Broken",
    "laddered": "laddered:Laddered",
    "tiny": "tiny:Tiny",
    "grown": "tiny:Grown",
    "absent": "no_such_module_anywhere:Engine",
    "misspelt": "hostile:NoSuchClass",
}
