"""Engines that harm their process: they crash, hang, print or patch; tests install them under temporary names."""

from __future__ import annotations

import contextlib
import os
import resource
import signal
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from proofroll.core import certificate
from proofroll.core.errors import Diverged, Refused
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run import certificate as body_certificate
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.papers.blajer_2006.ball.as_body import RunOnBody, on_body, rolling_ball
from proofroll.papers.blajer_2006.ball.mechanics import initial_response
from proofroll.papers.blajer_2006.ball.model import ROLLS
from proofroll.papers.blajer_2006.ball.rolling_equations import closed_form
from proofroll.papers.blajer_2006.ball.sampling import BallBuilt, BallSample

_LEAKED: list[int] = []  # descriptors that an engine keeps


@dataclass(frozen=True)
class HostileSettings:
    """Minimal settings of an engine."""

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
    """Well-behaved engine that answers with the closed form."""

    name: ClassVar[str] = "oracle"
    provides: ClassVar[Mapping[str, frozenset[str]]] = {"only": ROLLS - {MechanismCapability.TURNING_FRICTION}}
    settings: ClassVar[type[HostileSettings]] = HostileSettings
    presets: ClassVar[Mapping[str, Mapping[str, HostileSettings]]] = {"only": {"matched": HostileSettings()}}

    @staticmethod
    def version() -> str:
        """See :class:`proofroll.core.engine.Engine`."""
        return "1"

    @classmethod
    def build(cls, scene: Scene, settings: HostileSettings) -> RunOnBody:  # noqa: ARG003 -- the protocol's signature
        """See :class:`proofroll.core.engine.Engine`."""
        return on_body(cls(scene), scene)

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
    """Closed form that runs faster after 0.05 s, by the relative amount in the variable PROOFROLL_TEST_OFF."""

    name = "steady"

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        off = float(os.environ.get("PROOFROLL_TEST_OFF", "0")) if t > 0.05 else 0.0
        super().advance(t * (1 + off))


class Exits(Oracle):
    """Ends its process, as some libraries do on a licence error."""

    name = "exits"

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        sys.stderr.write(f"fatal: no licence at {t}\n")
        sys.stderr.flush()
        os._exit(7)


class Hangs(Oracle):
    """Hangs, and ignores SIGTERM."""

    name = "hangs"

    def advance(self, t: float) -> None:  # noqa: ARG002 -- the protocol's signature
        """See :class:`proofroll.core.engine.Engine`."""
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        time.sleep(600)


class HangsAloud(Hangs):
    """Hangs after writing its process id to the named pipe in the variable HANGS_ALOUD, which it keeps open."""

    name = "hangs_aloud"

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        self.pipe = os.open(os.environ["HANGS_ALOUD"], os.O_WRONLY)
        os.write(self.pipe, f"{os.getpid()}\n".encode())
        super().advance(t)


class Leaks(Oracle):
    """Opens files until no more can be opened, and keeps them."""

    name = "leaks"

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        super().advance(t)
        resource.setrlimit(resource.RLIMIT_NOFILE, (64, resource.getrlimit(resource.RLIMIT_NOFILE)[1]))
        with contextlib.suppress(OSError):
            while True:
                _LEAKED.append(os.open(os.devnull, os.O_RDONLY))


class LimitsFiles(Oracle):
    """Allows its process no file above 1 kB."""

    name = "limits_files"

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        super().advance(t)
        resource.setrlimit(resource.RLIMIT_FSIZE, (1024, resource.getrlimit(resource.RLIMIT_FSIZE)[1]))


class Raises(Oracle):
    """Raises an error with a message of two lines."""

    name = "raises"

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        raise RuntimeError(f"matrix is singular\nat t = {t}")


class NotANumber(Oracle):
    """Reports a velocity of NaN from 0.1 s on."""

    name = "not_a_number"

    def sample(self) -> BallSample:
        """See :class:`proofroll.core.engine.Engine`."""
        right = super().sample()
        v = right.v_WB * (np.nan if self.t >= 0.1 else 1.0)
        return BallSample(right.p_WB, v, right.w_WB, force=right.force)


class GivesUp(Oracle):
    """Raises Diverged after 0.06 s."""

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
    def build(cls, scene: Scene, settings: Any) -> RunOnBody:  # noqa: ARG003 -- the protocol's signature
        """See :class:`proofroll.core.engine.Engine`."""
        raise Refused("no wheel, no ball")


class Commands(Oracle):
    """Raises an error whose message has control sequences for the terminal."""

    name = "commands"

    def advance(self, t: float) -> None:  # noqa: ARG002 -- the protocol's signature
        """See :class:`proofroll.core.engine.Engine`."""
        raise Diverged("\x1b]0;owned\x07\x9b2J it stopped")


class JudgesItself(Oracle):
    """Patches the certificate so that it always holds."""

    name = "judges_itself"

    def __init__(self, scene: Scene) -> None:
        certificate.Line.holds = property(lambda _: True)  # type: ignore[assignment,method-assign]  # that is the fault
        super().__init__(scene)


class MovesTheBar(Oracle):
    """Patches the certificate's tolerance for round-off to 1."""

    name = "moves_the_bar"

    def __init__(self, scene: Scene) -> None:
        certificate.EXACT = 1.0
        super().__init__(scene)


class SignsForTheBall(Oracle):
    """Patches the ball's certificate to have no lines."""

    name = "signs_for_the_ball"

    def __init__(self, scene: Scene) -> None:
        body_certificate.certify = lambda *_: []  # type: ignore[assignment]  # that is the fault
        super().__init__(scene)


# Entry points of these engines and of some harmless ones, so that tests of both share worker processes. The module of
# "absent" does not exist.
ENTRY_POINTS = {
    kind.name: f"hostile:{kind.__name__}"
    for kind in [*vars().values()]
    if isinstance(kind, type) and issubclass(kind, Oracle)
} | {
    "laddered": "laddered:Laddered",
    "tiny": "tiny:Tiny",
    "grown": "tiny:Grown",
    "absent": "no_such_module_anywhere:Engine",
    "misspelt": "hostile:NoSuchClass",
}
