"""The drill as a whole."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial

from proofroll_drill import command_faults, engine_faults, process_faults
from proofroll_drill.row import Drilled
from proofroll_drill.site import site

# Faults wait rather than compute, so that two at once are no burden.
_AT_ONCE = 2
# A fault that takes longer has caught the drill itself [s]; it needs some seconds, on any machine some minutes at most.
_LIMIT = 600.0
_OTHERS = (
    command_faults.drill_interrupt,
    command_faults.drill_full_disk,
    command_faults.drill_two_runs,
    process_faults.drill_killed,
    process_faults.drill_killed_in_c,
    process_faults.drill_hung_up,
    process_faults.drill_pool,
    process_faults.drill_storing,
)


def fault_drill(progress: Callable[[str], None] | None = None) -> list[Drilled]:
    """Makes every fault happen, each in a folder of its own, and says what it cost.

    Args:
        progress: called with the name of each fault when it is over.
    """
    with site() as here, ThreadPoolExecutor(_AT_ONCE) as pool:
        sound = engine_faults.prepare(here)
        # The longest first.
        drills: list[tuple[str, Callable[[], Drilled]]] = [
            *((drill.__name__, partial(drill, here, sound)) for drill in _OTHERS),
            *((it.name, partial(engine_faults.drill_engine, here, sound, it)) for it in engine_faults.ENGINE_FAULTS),
            *((name, partial(engine_faults.drill_damage, here, sound, name)) for name in engine_faults.DAMAGES),
        ]

        def run(drill: tuple[str, Callable[[], Drilled]]) -> Drilled:
            row = within(*drill)
            if progress:
                progress(row.fault)
            return row

        rows = list(pool.map(run, drills))
    return rows[len(_OTHERS) :] + rows[: len(_OTHERS)]


def within(name: str, drill: Callable[[], Drilled], seconds: float = _LIMIT) -> Drilled:
    """The row of a fault; one that takes longer, or that ends the drill itself, is not contained.

    A thread that hangs is left behind: who drills must end by :func:`os._exit` where :attr:`Drilled.hung` says so.
    """
    rows: list[Drilled] = []

    def run() -> None:
        try:
            rows.append(drill())
        except Exception as error:
            said = f"{type(error).__name__}: {error}"
            rows.append(Drilled(name, False, said, 0, 0, 0, 0, 0, 0, problem="the drill itself failed"))

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    thread.join(seconds)
    return (
        rows[0]
        if rows
        else Drilled(name, False, "", 0, 0, 0, 0, 0, 0, problem=f"the drill itself hung for {seconds:g} s", hung=True)
    )
