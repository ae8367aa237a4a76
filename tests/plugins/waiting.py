"""An engine that signals its start and waits for permission, for tests that end a process meanwhile."""

from __future__ import annotations

import os
import time
from pathlib import Path

from hostile import Oracle


class Waiting(Oracle):
    """Writes a file ``begun-PARENT-PID`` into the folder ``WAITING_ROOM``, and waits there for the file ``go``."""

    name = "waiting"

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        room = Path(os.environ["WAITING_ROOM"])
        (room / f"begun-{os.getppid()}-{os.getpid()}").touch()
        while not (room / "go").exists():
            time.sleep(0.01)
        super().advance(t)
