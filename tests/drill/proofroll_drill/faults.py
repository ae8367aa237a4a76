"""The drill as a whole."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial

from proofroll_drill import command_faults, engine_faults, process_faults
from proofroll_drill.row import Drilled
from proofroll_drill.site import site

# Faults wait rather than compute, so that two at once are no burden.
_AT_ONCE = 2
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
        drills: list[Callable[[], Drilled]] = [
            *(partial(drill, here, sound) for drill in _OTHERS),
            *(partial(engine_faults.drill_engine, here, sound, fault) for fault in engine_faults.ENGINE_FAULTS),
            *(partial(engine_faults.drill_damage, here, sound, name) for name in engine_faults.DAMAGES),
        ]

        def run(drill: Callable[[], Drilled]) -> Drilled:
            row = drill()
            if progress:
                progress(row.fault)
            return row

        rows = list(pool.map(run, drills))
    return rows[len(_OTHERS) :] + rows[: len(_OTHERS)]
