"""Exudyn's modules without types: its stubs leave ``self`` out of every method and so describe other signatures."""

from __future__ import annotations

from typing import Any

import exudyn
import exudyn.itemInterface

exu: Any = exudyn
items: Any = exudyn.itemInterface
Output: Any = exudyn.OutputVariableType
