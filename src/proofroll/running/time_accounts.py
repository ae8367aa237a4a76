"""Where the time of a case goes."""

from __future__ import annotations

import time


class TimeAccounts:
    """Where the time of a case goes.

    Attributes:
        seconds: wall seconds by cause [s].
        processor: seconds of this process by cause [s], whoever else computes on the machine.
    """

    _counted = 0.0  # of the processor, in the cases before: what has passed since was the start, and other requests

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        now = time.process_time()
        self.processor: dict[str, float] = {"process start": now - TimeAccounts._counted}
        self._since = time.perf_counter(), now

    def on(self, cause: str, **parts: tuple[float, float]) -> None:
        """What has passed since the last call went to ``cause``, but for ``parts`` of it that had another.

        Each part is a pair of wall and processor seconds [s].
        """
        now = time.perf_counter(), time.process_time()
        for index, account in enumerate((self.seconds, self.processor)):
            found = {key.replace("_", " "): part[index] for key, part in parts.items()}
            found[cause] = now[index] - self._since[index] - sum(found.values())
            for key, value in found.items():
                account[key] = account.get(key, 0.0) + value
        self._since, TimeAccounts._counted = now, now[1]
