"""MuJoCo: soft contact at the level of accelerations, generalised coordinates, one first- or fourth-order step."""

from typing import Any

__all__ = ["Mujoco", "mjspec"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from proofroll.engines.mujoco.adapter import Mujoco, mjspec  # which a reader of robots does not need

    return {"Mujoco": Mujoco, "mjspec": mjspec}[name]
