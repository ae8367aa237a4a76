"""heyoka, where it is installed."""

from importlib import metadata, util

import numpy as np

from proofroll.core.errors import Missing

# A step's error relative to the state: no tolerance below can be told from it.
TIGHTEST = float(np.finfo(float).eps)


def available() -> bool:
    """True if heyoka is installed."""
    return util.find_spec("heyoka") is not None


def require_heyoka(what: str) -> None:
    """Check: heyoka is here, which ``what`` needs.

    Raises:
        Missing: it is not installed; no engine has refused anything by that.
    """
    if not available():
        raise Missing(f"{what} needs heyoka, which is not installed here: pip install 'proofroll[fast]' (Linux)")


def with_heyoka(version: str) -> str:
    """A version of something that may run on heyoka: stored answers, refusals too, end where heyoka comes or goes."""
    return f"{version}, heyoka {metadata.version('heyoka')}" if available() else version
