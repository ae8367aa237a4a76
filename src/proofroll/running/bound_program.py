"""Programs that end with the process that started them, with all that they started, however that one ends."""

import contextlib
import os
import signal
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

# Beside the program a shell of its group waits for the end of a pipe of which only the starting process can write.
_GUARDED = '(read -r line <&"$0"; kill -KILL 0) >/dev/null 2>&1 & exec "$@"'


class BoundProgram(subprocess.Popen[str]):
    """Program in a session of its own, which :meth:`end` ends with all that it started.

    The same happens when this process ends, even if it is killed.

    Args:
        command: absolute path of the program, and its arguments.
        environment: variables of its environment; None: that of this process.
        options: further ones of ``subprocess.Popen``.

    Raises:
        OSError: no program, or one that cannot be executed.
    """

    def __init__(
        self, command: Sequence[str | Path], environment: Mapping[str, str] | None = None, **options: Any
    ) -> None:
        if not os.access(command[0], os.X_OK):
            raise PermissionError(f"{command[0]} cannot be executed")
        self._life: int | None
        life, self._life = os.pipe()  # never written to
        try:
            super().__init__(
                ["/bin/sh", "-c", _GUARDED, str(life), *command],
                stdout=subprocess.PIPE,
                env=environment,
                pass_fds=(life,),
                start_new_session=True,
                text=True,
                encoding="utf-8",
                errors="replace",
                **options,
            )
        except BaseException:
            os.close(self._life)
            raise
        finally:
            os.close(life)

    def end(self) -> None:
        """Ends it with all that it started; what still holds its pipes is not waited for."""
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self.pid, signal.SIGKILL)
        self.wait()
        for pipe in (self.stdin, self.stdout, self.stderr):
            if pipe is not None:
                with contextlib.suppress(OSError):  # what was not sent
                    pipe.close()
        if self._life is not None:
            os.close(self._life)
            self._life = None


def printed_by(
    command: Sequence[str | Path],
    environment: Mapping[str, str],
    time_limit: float | None = None,
    folder: str | None = None,
) -> tuple[int, str, str]:
    """Exit code of a program, and what it wrote to its output and to standard error.

    Raises:
        OSError: no program, or one that cannot be executed.
        subprocess.TimeoutExpired: a program that takes longer than ``time_limit`` [wall s].
    """
    program = BoundProgram(command, environment, stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, cwd=folder)
    try:
        printed, errors = program.communicate(timeout=time_limit)
    finally:
        program.end()
    return program.returncode, printed, errors
