"""The engine of the drill: the projection method, which on request does what an engine must never do.

Each formulation has one fault, as long as the folder named by ``PROOFROLL_DRILL`` says that it is not cured.
"""

from __future__ import annotations

import ctypes
import dataclasses
import fcntl
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np

from proofroll.core.engine import Sample
from proofroll.core.errors import Diverged, Refused
from proofroll.core.plugins import load_engine
from proofroll.core.scene import Scene
from proofroll.papers.blajer_2006.projection.run import ProjectionBallSettings

Projection = load_engine("projection")

FOLDER = "PROOFROLL_DRILL"
_FOREVER = 600.0
# Of 32 MB each: four times what a worker of the drill may have, which the machine bears.
_HOARD = 64


def _raises() -> None:
    raise RuntimeError("the matrix is singular\nand this is a second line")


def _hangs() -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    time.sleep(_FOREVER)


def _hangs_in_c() -> None:
    """No thread of Python runs meanwhile, as in many a solver."""
    ctypes.PyDLL(None).sleep(int(_FOREVER))


def _allocates() -> None:
    hoard: list[np.ndarray] = []
    while len(hoard) < _HOARD:
        hoard.append(np.ones(4_000_000))  # 32 MB that are really there
        time.sleep(0.02)  # the drill must not be what brings a machine down
    time.sleep(_FOREVER)  # nobody watches: the row's limit of time ends it, and the row is red


def _segfaults() -> None:
    ctypes.string_at(0)


def _says_exit() -> None:
    sys.exit("no licence")


def _exits() -> None:
    os._exit(7)


def _aborts() -> None:
    os.abort()


def _garbage() -> None:
    sys.stdout.write('{"status": "done"}\n\x00 no answer\n')
    os.write(1, b"\xff\xfe not UTF-8\n" * 1000)
    os.write(2, b"warning: nothing is well\n")


def _floods() -> None:
    for _ in range(64):
        os.write(1, b"this is printed again and again\n" * 32768)


def _writes_everywhere() -> None:
    for descriptor in range(3, 64):
        try:
            os.write(descriptor, b'{"status": "done", "message": "all is well"}\n')
        except OSError:
            continue


def _asks() -> None:
    input("Licence key? ")


def _half() -> None:
    """The process is ended by the system as soon as it has written the first kB of its result."""
    signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1024, resource.getrlimit(resource.RLIMIT_FSIZE)[1]))


def _interrupted() -> None:
    try:
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(_FOREVER)
    except KeyboardInterrupt:
        raise Diverged("it diverged") from None


def _no_memory() -> None:
    try:
        np.ones(1 << 50)
    except MemoryError:
        raise Diverged("it diverged") from None


def _no_file() -> None:
    try:
        Path("/no/such/licence").read_bytes()
    except OSError as error:
        raise Refused("it refuses") from error


def _commands() -> None:
    raise Diverged("\x1b]0;all is well\x07\x1b[2J\x9b31m\u202e")


def _leaves_a_child() -> None:
    """The child holds every open file of its parent, the pipe of the answers among them, and outlives it."""
    subprocess.Popen([sys.executable, "-c", f"import time; time.sleep({_FOREVER})"], close_fds=False)
    os._exit(9)


# Formulation -> where the fault shows, and what it does.
DEEDS: Mapping[str, tuple[str, Callable[[], None]]] = {
    "well": ("", lambda: None),
    "raises_in_build": ("build", _raises),
    "raises_in_built": ("built", _raises),
    "raises_in_advance": ("advance", _raises),
    "raises_in_sample": ("sample", _raises),
    "nan": ("nan", lambda: None),
    "wrong_shape": ("shape", lambda: None),
    "hangs": ("advance", _hangs),
    "waits_for_ctrl_c": ("advance", _hangs),
    "allocates": ("advance", _allocates),
    "segfaults": ("advance", _segfaults),
    "aborts": ("advance", _aborts),
    "says_exit": ("advance", _says_exit),
    "exits": ("advance", _exits),
    "half": ("advance", _half),
    "garbage": ("advance", _garbage),
    "floods": ("advance", _floods),
    "writes_everywhere": ("advance", _writes_everywhere),
    "asks": ("advance", _asks),
    "leaves_a_child": ("advance", _leaves_a_child),
    "interrupted": ("advance", _interrupted),
    "no_memory": ("advance", _no_memory),
    "no_file": ("build", _no_file),
    "commands": ("advance", _commands),
    "waits_for_its_parent": ("advance", _hangs),
    "computes_without_its_parent": ("advance", _hangs_in_c),
    "waits_for_its_terminal": ("advance", _hangs),
}


@dataclass(frozen=True)
class DrillSettings:
    """The formulation is the fault."""

    formulation: str = "well"
    preset: str = "matched"
    dt: float = 5e-3
    resolution: ClassVar[str] = "dt"
    order: ClassVar[int] = 4


class Drill:
    """The projection method with a fault."""

    name: ClassVar[str] = "drill"
    provides: ClassVar[Mapping[str, frozenset[str]]] = dict.fromkeys(DEEDS, Projection.provides["rotating_frame"])
    settings: ClassVar[type[DrillSettings]] = DrillSettings
    presets: ClassVar[Mapping[str, Mapping[str, DrillSettings]]] = {
        name: {"matched": DrillSettings(name)} for name in DEEDS
    }

    @staticmethod
    def version() -> str:
        """See :class:`proofroll.core.engine.Engine`."""
        return str(Projection.version())

    @classmethod
    def build(cls, scene: Scene, settings: DrillSettings) -> Self:
        """See :class:`proofroll.core.engine.Engine`."""
        return cls(scene, settings)

    def __init__(self, scene: Scene, settings: DrillSettings) -> None:
        folder = Path(os.environ[FOLDER])
        cured = (folder / "cured" / settings.formulation).exists()
        self._where, self._deed = DEEDS["well" if cured else settings.formulation]
        self._mark = folder / f"alive-{settings.formulation}"
        self._do("build")
        self._inner = Projection.build(
            scene, ProjectionBallSettings(formulation="rotating_frame", integrator="rk4", dt=settings.dt)
        )
        self._t = 0.0

    def _do(self, where: str) -> None:
        if self._where == where:
            self._alive = self._mark.open("w")  # only now: whoever waits for it kills in the middle of the deed
            fcntl.flock(self._alive, fcntl.LOCK_SH)  # held by this process and every child of it, until the last ended
            os.set_inheritable(self._alive.fileno(), True)
            self._deed()

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        self._do("advance")
        self._inner.advance(t)
        self._t = t

    def sample(self) -> Sample:
        """See :class:`proofroll.core.engine.Engine`."""
        right: Sample = self._inner.sample()
        if self._t == 0:
            return right
        self._do("sample")
        wrong: dict[str, Any] = {"nan": {"v_WB": right.v_WB * np.nan}, "shape": {"p_WB": right.p_WB[:2]}}
        return dataclasses.replace(right, **wrong.get(self._where, {}))

    def built(self) -> Any:
        """See :class:`proofroll.core.engine.Engine`."""
        self._do("built")
        return self._inner.built()
