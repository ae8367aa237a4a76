"""The adapter between proofroll and Pinocchio."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Self

import pinocchio as pin

from proofroll.engine import Built, Sample
from proofroll.engines.pinocchio.contact import ContactRun
from proofroll.engines.pinocchio.rows_run import RowsRun
from proofroll.engines.pinocchio.settings import PRESETS, PinocchioSettings
from proofroll.events import Event
from proofroll.scene import Capability, Scene


class Pinocchio:
    """Pinocchio's equations of motion with rows of rolling put to them, or its own solver of contact with friction."""

    name: ClassVar[str] = "pinocchio"
    provides: ClassVar[frozenset[Capability]] = frozenset(
        {
            Capability.ROLLING,
            Capability.CURVED_SURFACE,
            Capability.ROLLING_RESISTANCE,
            Capability.BOUNDED_FRICTION,
        }
    )
    settings: ClassVar[type[Any]] = PinocchioSettings
    presets: ClassVar[Mapping[str, Mapping[str, PinocchioSettings]]] = PRESETS

    def __init__(self, run: ContactRun | RowsRun) -> None:
        self._run = run
        self._t = 0.0

    @staticmethod
    def version() -> str:
        """See :class:`proofroll.engine.Engine`."""
        return str(pin.__version__)

    @classmethod
    def build(cls, scene: Scene, settings: PinocchioSettings) -> Self:
        """See :class:`proofroll.engine.Engine`."""
        return cls((ContactRun if settings.formulation == "contact" else RowsRun)(scene.rolling, settings))

    @classmethod
    def reproducer(cls, scene: Scene, settings: PinocchioSettings) -> str:
        """See :class:`proofroll.engine.Reproduces`."""
        from proofroll.engines.pinocchio.reproducer import source

        return source(scene.rolling, settings)

    def advance(self, t: float) -> None:
        """See :class:`proofroll.engine.Engine`."""
        self._run.advance(self._t, t)
        self._t = t

    def sample(self) -> Sample:
        """See :class:`proofroll.engine.Engine`."""
        return self._run.sample()

    def events(self) -> Sequence[Event]:
        """See :class:`proofroll.engine.LocatesEvents`; none with unbounded friction."""
        return self._run.events()

    def built(self) -> Built:
        """See :class:`proofroll.engine.Engine`."""
        return self._run.built()
