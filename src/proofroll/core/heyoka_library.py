"""Availability of heyoka, which is optional."""

from importlib import metadata, util

import numpy as np

from proofroll.core.errors import Missing

# Tightest tolerance of a step, relative to the state; tighter ones make no difference.
TIGHTEST = float(np.finfo(float).eps)


def available() -> bool:
    """True if heyoka is installed."""
    return util.find_spec("heyoka") is not None


def require_heyoka(what: str) -> None:
    """Raises Missing, which is no refusal by an engine, unless heyoka is installed; ``what`` names its user."""
    if not available():
        raise Missing(f"{what} needs heyoka, which is not installed here: pip install 'proofroll[fast]' (Linux)")


def with_heyoka(version: str) -> str:
    """Version text that also names heyoka's version if installed, so that stored results depend on it."""
    return f"{version}, heyoka {metadata.version('heyoka')}" if available() else version
