"""First message of a worker, which reveals a different proofroll or the wrong place."""

import platform
import sys
from collections.abc import Mapping
from functools import cache
from typing import Any

import proofroll
from proofroll.running.identity import digest

# Version of the protocol of requests and answers; see docs/worker_protocol.md.
PROTOCOL = 2


def identify_and_settle(place: str) -> dict[str, Any]:
    """Identity of this worker, which from now on serves only engines ``NAME@place``."""
    from proofroll.running import loading

    loading.serve_place(place)
    return own() | {"interpreter": sys.executable, "python": platform.python_version()}


@cache
def own() -> dict[str, Any]:
    """Version of the protocol, and version and code hash of this proofroll."""
    return {"protocol": PROTOCOL, "proofroll": proofroll.__version__, "code": digest([])}


def mismatch(answer: Mapping[str, Any]) -> str:
    """Reason why a worker with this identity cannot serve this process; empty: it can.

    Its code must be the same, not only its version, as the worker reads scenes, certifies and records.
    """
    mine = own()
    if answer.get("protocol") != PROTOCOL:
        return f"speaks protocol {answer.get('protocol')} of workers, and this proofroll speaks {PROTOCOL}"
    if answer.get("proofroll") != mine["proofroll"]:
        return f"has proofroll {answer.get('proofroll')}, and this is {mine['proofroll']}"
    if answer.get("code") != mine["code"]:
        return f"has other code of proofroll {mine['proofroll']} than this one"
    return ""
