"""Plain data, as JSON can hold it."""

from __future__ import annotations

import math
from typing import Any


def plain(value: Any) -> Any:
    """The value with everything that JSON cannot hold replaced: numbers that are not finite become None."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if hasattr(value, "item"):  # a numpy number
        return plain(value.item())
    return value
