"""Exudyn's modules without types: its stubs leave ``self`` out of every method and so describe other signatures."""

from __future__ import annotations

from typing import Any

import exudyn
import exudyn.itemInterface

exu: Any = exudyn
items: Any = exudyn.itemInterface
Output: Any = exudyn.OutputVariableType


def loads(system: Any) -> list[str]:
    """Exudyn's names of the types of all loads in a system."""
    return [str(system.GetLoad(number)["loadType"]) for number in range(system.systemData.NumberOfLoads())]
